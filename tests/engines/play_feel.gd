extends Node
## Plays the golden cases with the GDScript player, a case in each frame, and prints its plans; renders others as sound;
## changes between a service and the player; then listens to a HapticSpeaker.

const Switch := preload("res://switch_feel.gd")
const Hear := preload("res://hear_feel.gd")
const CHANGES := 20
const GESTURES := {"rubber": "slide", "wood": "carve", "metal": "swing", "fabric": "press", "glass": "strike"}
const CHANGED := 30
const PICTURE_S := 1.0 / 72.0

var _feel: Dictionary
var _cases: Array
var _heard: Array
var _switch: Switch
var _switches: Dictionary[String, Callable]
var _took_us := {}  # interaction and form -> the time of each plan in which something is felt


func _ready() -> void:
	_feel = FeelPlayer.open(FileAccess.get_file_as_string(HapticService.FEEL))
	_cases = JSON.parse_string(FileAccess.get_file_as_string("res://cases.json"))
	_heard = JSON.parse_string(FileAccess.get_file_as_string("res://heard.json"))
	_switch = Switch.new(_feel, CHANGES)
	_switches = _switch.cases()


func _process(_delta: float) -> void:
	if not _cases.is_empty():
		_say("case", _play(_cases.pop_front()))
	elif not _heard.is_empty():
		_say("heard", {"wave": _render(_heard.pop_front())})
	elif not _switches.is_empty():
		var name: String = _switches.keys()[0]
		_say("switch", {name: _switches[name].call()})
		_switches.erase(name)
	else:
		set_process(false)
		var sounds_us := {}
		for material: String in GESTURES:
			sounds_us[GESTURES[material]] = _sound_us(material)
		var hear := Hear.new()
		add_child(hear)
		_say("speaker", await hear.listen())
		for change: String in ["stop", "mute", "release"]:
			_say("change", {"name": change, "wave": _changed(change)})
		_say("done", {"plans_us": _took_us, "sounds_us": sounds_us})


func _surface_of(touch: Dictionary) -> Dictionary:
	return {"material": touch.get("object_id")}


## Renders blocks of samples, with the touches before each.
func _render(asked: Dictionary) -> Array:
	var player := FeelPlayer.new(_feel, _surface_of, asked.rate)
	var wave := []
	for block: int in asked.blocks:
		var now: float = block * asked.block / asked.rate
		for one: Dictionary in asked.touches:
			if one.block == block:
				player.touch(one.touch, now)
		wave.append_array(Array(player.render(asked.block, now)))
	return wave


## Strokes in pictures, of which CHANGED changes what is heard, while the hand goes on.
func _changed(change: String) -> Array:
	var player := FeelPlayer.new(_feel, _surface_of, HapticSpeaker.RATE_HZ)
	var fields := {"hand": "right", "object_id": "rubber", "speed_mps": 0.4, "force_n": 2.0}
	player.touch(fields.merged({"phase": "contact"}), 0.0)
	var wave := []
	for picture in 2 * CHANGED:
		var now := picture * PICTURE_S
		match change if picture == CHANGED else "":
			"stop":
				player.stop()
			"mute":
				player.mute("right", true)
			"release":
				player.touch({"hand": "right", "phase": "release"}, now)
		if picture % 3 == 0 and (picture < CHANGED or change != "release"):
			player.touch(fields.merged({"phase": "slide"}), now)
		wave.append_array(Array(player.render(roundi(PICTURE_S * HapticSpeaker.RATE_HZ), now)))
	return wave


## Returns how long the sound of each picture of two strokes or strikes takes, touched every third picture.
func _sound_us(material: String) -> Array[int]:
	var player := FeelPlayer.new(_feel, _surface_of, HapticSpeaker.RATE_HZ)
	var fields := {"hand": "right", "object_id": material, "interaction": GESTURES[material]}
	var took: Array[int] = []
	for picture in 144:
		var now := picture * PICTURE_S
		if picture % 36 == 30:
			player.touch({"hand": "right", "phase": "release"}, now)
		elif picture % 3 == 0 and picture % 36 < 30:
			var phase := "contact" if picture % 36 == 0 else "slide" if material == "rubber" else "contact"
			var pressed := {"phase": phase, "speed_mps": 0.4, "force_n": 1.0 + picture % 36 / 5.0}
			var before := Time.get_ticks_usec()
			player.touch(fields.merged(pressed), now)
			took.append(Time.get_ticks_usec() - before)
		else:
			took.append(0)
		if player.is_silent():
			took.pop_back()
			continue
		var began := Time.get_ticks_usec()
		player.render(roundi(PICTURE_S * HapticSpeaker.RATE_HZ), now)
		took[-1] += Time.get_ticks_usec() - began
	return took


func _play(case: Dictionary) -> Dictionary:
	var player := FeelPlayer.new(_feel, _surface_of)
	return {"name": case.name, "events": case.events.map(_play_event.bind(player, case.name))}


## Numbers that JSON lacks come as text.
func _number(value: Variant) -> float:
	var told := {"NaN": NAN, "Infinity": INF, "-Infinity": -INF}
	return told.get(value, float(value)) if value is String else value


func _play_event(event: Dictionary, player: FeelPlayer, case: String) -> Dictionary:
	if event.has("touch"):
		player.touch(event.touch.merged({"speed_mps": _number(event.touch.speed_mps), "force_n": _number(event.touch.force_n)}, true), event.at_s)
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
