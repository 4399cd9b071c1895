extends Node
## Plays the vectors of `schemas/vectors` with the GDScript player, a case in each frame, and prints what it planned, said or
## rendered; changes between a service and the player; then listens to a HapticSpeaker.

const Switch := preload("res://switch_feel.gd")
const Hear := preload("res://hear_feel.gd")
const Damage := preload("res://damage_feel.gd")
const FeelFile := preload("res://addons/hapticvlm/feel_file.gd")
const SOUND_HZ := 12000.0
const BLOCK := 120
const CHANGED := 30
const PICTURE_S := 1.0 / 72.0
const FLOOR_TURNS := 12500  # 1 ms of a quiet machine, which a plan may take
const NUMBERS := {"NaN": NAN, "Infinity": INF, "-Infinity": -INF}

var _feel: Dictionary
var _opened_us: int
var _cases := {}  # what -> the cases of it
var _players: Dictionary[String, Callable] = {
	"plans": _planned, "touches": _hostile, "times": _timed, "calls": _asked, "files": _refused, "sounds": _rendered
}
var _switch: Switch
var _switches: Dictionary[String, Callable]
var _took_us := {}  # interaction and form -> the time of each plan in which something is felt
var _floor_us := []  # the time of plain arithmetic, in turns with the plans


func _ready() -> void:
	var text := FileAccess.get_file_as_string(HapticService.FEEL)
	var began := Time.get_ticks_usec()
	_feel = FeelPlayer.open(text)
	_opened_us = Time.get_ticks_usec() - began
	_cases = _parsed("res://cases.json")
	_switch = Switch.new(_feel)
	_switches = _switch.cases()
	for name: String in _cases.scripts:
		_switches[name] = _switch.play.bind(_cases.scripts[name])


func _process(_delta: float) -> void:
	for what in _players:
		if not _cases[what].is_empty():
			for turn in mini(10 if what == "touches" else 1, _cases[what].size()):
				_say(what, _players[what].call(_cases[what].pop_front()))
			return
	if not _switches.is_empty():
		var name: String = _switches.keys()[0]
		_say("switch", {name: _switches[name].call()})
		_switches.erase(name)
		return
	set_process(false)
	for path: String in ["res://identity_cases.json", HapticService.FEEL]:
		var file: Dictionary = _parsed(path)
		_say("damaged", Damage.new(file, path == HapticService.FEEL).spoil(file))
	var hear := Hear.new()
	add_child(hear)
	_say("speaker", await hear.listen())
	for change: String in ["stop", "mute", "release"]:
		_say("change", {"name": change, "wave": _changed(change)})
	_say("done", {"plans_us": _took_us, "floor_us": _floor_us, "opened_us": _opened_us})


func _planned(case: Dictionary) -> Dictionary:
	var surfaces: Dictionary = case.get("surfaces", {})
	var surface_of := func(touch: Dictionary) -> Dictionary:
		return surfaces.get(touch.object_id, {"material": touch.object_id})
	var players := {"amplitude": FeelPlayer.new(_feel, surface_of), "parametric": FeelPlayer.new(_feel, surface_of)}
	var events := []
	for event: Dictionary in case.events:
		var plans := {}
		for form: String in players:
			if event.has("touch"):
				players[form].touch(event.touch, event.at_s)
			elif event.has("stop"):
				players[form].stop()
			else:
				var began := Time.get_ticks_usec()
				plans[form] = players[form].plan(event.plan, form, event.at_s)
				if plans[form].amplitude:
					var steps: PackedStringArray = case.name.split(" ")
					var kind: String = "%s %s" % [steps[1] if steps[-1] == "0.4" else "several", form]
					_took_us.get_or_add(kind, []).append(Time.get_ticks_usec() - began)
					_floor_us.append(_arithmetic_us())
		events.append(plans)
	return {"events": events}


## Returns the plan 20 ms after a touch, and what the player named, for the touch and for the one that it is felt like.
func _hostile(case: Dictionary) -> Array:
	var answers := []
	for each: Array in [["touch", "surface", "gain"], ["like", "like_surface", "like_gain"]]:
		var surface: Dictionary = _unmarked(case.get(each[1], {"material": "wood"}))
		var player := FeelPlayer.new(_feel, func(_touch: Dictionary) -> Dictionary: return surface)
		player.gain = _unmarked(case.get(each[2], 1.0))
		var hand := "right"
		if case.get(each[0]) != null:
			player.touch(_unmarked(case[each[0]]), 5.0)
			hand = str(case[each[0]].hand)
		answers.append({"plan": player.plan(hand, "parametric", 5.02), "said": player.said.values()})
	return answers


func _timed(case: Dictionary) -> Dictionary:
	var player := FeelPlayer.new(_feel, func(_touch: Dictionary) -> Dictionary: return {"material": "wood"})
	var plans := []
	for now: Variant in case.times.map(_unmarked):
		player.touch({"phase": case.get("phase", "slide"), "hand": "right", "speed_mps": 0.4, "force_n": 1.5}, now)
		plans.append(player.plan("right", "parametric", now))
	return {"plans": plans, "said": player.said.values()}


## Returns the plan of a hand and form while the right hand slides, once the hand was asked and muted.
func _asked(case: Dictionary) -> Dictionary:
	var player := FeelPlayer.new(_feel, func(_touch: Dictionary) -> Dictionary: return {"material": "wood"})
	player.touch({"phase": "slide", "hand": "right", "speed_mps": 0.4, "force_n": 1.5}, 5.0)
	var hand := str(case.hand)
	var is_held := player.is_held(hand)
	var plan := player.plan(hand, str(case.form), 5.02)
	player.mute(hand, true)
	return {"is_held": is_held, "plan": plan, "said": player.said.values()}


## Returns how long this engine takes for arithmetic that plans are measured against, us.
func _arithmetic_us() -> int:
	var began := Time.get_ticks_usec()
	var state := Vector2.ONE
	for turn in FLOOR_TURNS:
		state = Vector2(0.9 * state.x + 0.1 * state.y, 0.9 * state.y)
	return Time.get_ticks_usec() - began


## Returns why a file is refused.
func _refused(case: Dictionary) -> String:
	if case.has("file"):
		return FeelFile.unpack(case.file)
	var file: Dictionary = _parsed(HapticService.FEEL)
	var part: Variant = file
	for step: Variant in case.path.slice(0, -1):
		part = part[step]
	if case.has("value"):
		part[case.path[-1]] = _unmarked(case.value)
	else:
		part.erase(case.path[-1])
	return FeelFile.unpack(file)


## Returns a hostile value: {"$number": "NaN"} stands for a number that JSON has not.
func _unmarked(value: Variant) -> Variant:
	if value is Array:
		return value.map(_unmarked)
	if not value is Dictionary:
		return value
	if value.has("$number"):
		return NUMBERS[value["$number"]]
	var unmarked := {}
	for name: String in value:
		unmarked[name] = _unmarked(value[name])
	return unmarked


## Returns the samples of a case, in base64 of 32-bit numbers, and how long a block of them took.
func _rendered(case: Dictionary) -> Dictionary:
	var surfaces: Dictionary = case.get("surfaces", {})
	var surface_of := func(touch: Dictionary) -> Dictionary:
		return surfaces.get(touch.object_id, _surface_of(touch))
	var player := FeelPlayer.new(_feel, surface_of, SOUND_HZ)
	var wave := PackedFloat64Array()
	var began := Time.get_ticks_usec()
	for block: int in case.blocks:
		var now := block * BLOCK / SOUND_HZ
		for one: Dictionary in case.touches:
			if one.block == block:
				player.touch(one.touch, now)
		wave.append_array(player.render(BLOCK, now))
	var block_us: float = (Time.get_ticks_usec() - began) / case.blocks
	return {"us": block_us, "wave": Marshalls.raw_to_base64(PackedFloat32Array(Array(wave)).to_byte_array())}


func _surface_of(touch: Dictionary) -> Dictionary:
	return {"material": touch.get("object_id")}


func _parsed(path: String) -> Variant:
	return JSON.parse_string(FileAccess.get_file_as_string(path))


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


func _say(what: String, detail: Variant) -> void:
	print("PROBE ", JSON.stringify({"what": what, "detail": detail}))
