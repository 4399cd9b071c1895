extends Node
## Plays the golden cases with the GDScript player, a case in each frame, and prints its plans; then changes between a
## service and the player.

const Switch := preload("res://switch_feel.gd")
const CHANGES := 20

var _feel: Dictionary
var _cases: Array
var _switch: Switch
var _switches: Dictionary[String, Callable]
var _took_us := {}  # interaction and form -> the time of each plan in which something is felt


func _ready() -> void:
	_feel = FeelPlayer.open(FileAccess.get_file_as_string(HapticService.FEEL))
	_cases = JSON.parse_string(FileAccess.get_file_as_string("res://cases.json"))
	_switch = Switch.new(_feel, CHANGES)
	_switches = _switch.cases()


func _process(_delta: float) -> void:
	if not _cases.is_empty():
		_say("case", _play(_cases.pop_front()))
	elif not _switches.is_empty():
		var name: String = _switches.keys()[0]
		_say("switch", {name: _switches[name].call()})
		_switches.erase(name)
	else:
		set_process(false)
		_say("done", {"plans_us": _took_us})


func _play(case: Dictionary) -> Dictionary:
	var player := FeelPlayer.new(
		_feel, func(touch: Dictionary) -> Dictionary: return {"material": touch.get("object_id")}
	)
	return {"name": case.name, "events": case.events.map(_play_event.bind(player, case.name))}


func _play_event(event: Dictionary, player: FeelPlayer, case: String) -> Dictionary:
	if event.has("touch"):
		player.touch(event.touch, event.at_s)
	elif event.has("stop"):
		player.stop()
	else:
		var plans := {}
		for form: String in ["amplitude", "parametric"]:
			var began := Time.get_ticks_usec()
			var plan := player.plan(event.plan, form, event.at_s)
			var took := Time.get_ticks_usec() - began
			if not plan.amplitude.is_empty():
				var steps := case.split(" ")
				var kind: String = "%s %s" % [steps[1] if steps[-1] == "0.4" else "several", form]
				_took_us.get_or_add(kind, []).append(took)
			plan.transients = plan.transients.map(
				func(one: Dictionary) -> Array: return [one.amplitude, one.frequency_hz]
			)
			plans[form] = plan
		return plans
	return {}


func _say(what: String, detail: Dictionary) -> void:
	print("PROBE ", JSON.stringify({"what": what, "detail": detail}))
