extends RefCounted
## Plays the scripts of tests/support/switch_cases.py, and cases of its own, on a clock of our own, in ms.
##
## The switch, the player and the plan of the motor are the addon's; the service is a player that answers as a service
## does.

const Felt := preload("res://addons/hapticvlm/felt.gd")
const PICTURE_MS := 11
const TOUCH_MS := 16
const PLAN_MS := 40
const ANSWER_MS := 2
const RECONNECT_MS := 260
const STRIKE := 0.2  # the vibration of a struck glass is above it

var _feel: Dictionary
var _now := 1000
var _service: FeelPlayer
var _state := "alive"  # frozen: the connection is open and says nothing; dead
var _is_open := false
var _is_ours := true
var _reconnect_at := 0
var _served := {}  # hand -> true
var _planned_at := 0
var _answers: Array[Dictionary] = []
var _felt: Felt
var _motor: HapticPulses.Plan
var _told: Array[Vector2] = []  # time and amplitude


func _init(feel: Dictionary) -> void:
	_feel = feel


## Returns the accounts by their names, to be called one a frame.
func cases() -> Dictionary[String, Callable]:
	return {
		"heard with a service": _heard.bind("alive", false),
		"heard after a freeze": _heard.bind("frozen", false),
		"heard of a stop": _heard.bind("frozen", true),
		"unknown": _unknown,
		"damaged": _damaged,
		"materials": _materials,
		"identity": _identity,
	}


## `how`: alone, without a service, or beside another scene, which owns the outputs.
func _begin(mode: String, how := "") -> void:
	_state = "dead" if how == "alone" else "alive"
	_is_ours = how != "beside"
	_is_open = false
	_reconnect_at = _now
	_served.clear()
	_answers.clear()
	_told.clear()
	_motor = HapticPulses.Plan.new()
	_felt = Felt.new()
	_felt.forms = {"right": "amplitude"}
	_felt.stated_of = func(id: String) -> Dictionary: return {} if id == "thing" else {"material": id}
	_felt.on_vibration = func(vibration: Dictionary) -> void: _motor.receive(vibration, 0.001 * _now)
	_felt.open(_feel, null)
	_felt.select(mode, 0.001 * _now)


func _pass(ms: int, at_touch := Callable()) -> void:
	for end in ms:
		_now += 1
		_serve()
		if _now % TOUCH_MS == 0 and at_touch.is_valid():
			at_touch.call()
		if _now % PICTURE_MS == 0:
			_draw()


## A frame of the engine: what came in, then the switch, then the motor.
func _draw() -> void:
	var now := 0.001 * _now
	if _is_open and _state == "dead":
		_is_open = false
		_reconnect_at = _now + RECONNECT_MS
		_answers.clear()
		_felt.is_owner = false
		_motor.clear()
		_felt.connection_changed(false, now)
	if not _is_open and _state == "alive" and _now >= _reconnect_at:
		_is_open = true
		_service = FeelPlayer.new(_feel, func(touch: Dictionary) -> Dictionary: return {"material": touch["object_id"]})
		_felt.hear(now)
		_felt.connection_changed(true, now)
		_felt.is_owner = _is_ours
	while not _answers.is_empty() and _answers[0]["at"] <= _now:
		var answer: Dictionary = _answers.pop_front()
		_felt.hear(now)
		if answer.has("hand") and _felt.serve(answer):
			_motor.receive(answer, now)
	_felt.step(now)
	_told.append(Vector2(_now, _motor.strongest(now)))


func _serve() -> void:
	if not _is_open or _state != "alive" or _now - _planned_at < PLAN_MS:
		return
	for hand: String in _served:
		_answer_plan(hand)
	_answers.append({"at": _now + ANSWER_MS})  # telemetry
	_planned_at = _now


func _answer_plan(hand: String) -> void:
	var plan := _service.plan(hand, "amplitude", 0.001 * _now)
	if not plan["amplitude"].is_empty():
		_answers.append(plan.merged({"at": _now + ANSWER_MS, "hand": hand, "stopped": false}))


func _touch(phase: String, id: String) -> void:
	var fields := {"phase": phase, "hand": "right", "object_id": id, "speed_mps": 0.5, "force_n": 2.0}
	if not _felt.touch(fields, 0.001 * _now) or not _is_open or not _is_ours or _state != "alive":
		return
	_served["right"] = true
	if _service.touch(fields, 0.001 * _now):
		_answer_plan("right")
	_answers.append({"at": _now + ANSWER_MS})


## Follows a script of tests/support/switch_cases.py; returns what it says, by name.
func play(steps: Array) -> Dictionary:
	var said := {}
	var since := _now
	for step: String in steps:
		var words := step.split(" ")
		match words[0]:
			"begin":
				_begin(words[1], words[-1])
			"pass" when words.size() > 2:
				_pass(int(words[1]), _touch.bind(words[2], words[3]))
			"pass":
				_pass(int(words[1]))
			"touch":
				_touch(words[1], words[2])
			"service":
				_state = words[1]
			"stop":
				_stop(words[-1])
			"mode":
				_felt.select(words[1], 0.001 * _now)
			"own":
				_is_ours = true
				_felt.is_owner = true
			"mark":
				since = _now
			"say":
				var told: Variant = _seen(words[2], since)
				if told != null:
					said[words[1]] = told
	return said


func _seen(what: String, since: int) -> Variant:
	match what:
		"felt":
			return _strongest(since)
		"gap":
			return _longest_gap(since)
		"soon":
			for told in _told:
				if told.x >= since and told.y >= STRIKE:
					return told.x - since
			return 1e9
		"by":
			return _felt.by()
		"silence":
			return _felt.silence()
	return null


## A stop by this scene, by another client, or of the left hand, of which the service tells.
func _stop(who: String) -> void:
	if who == "left":
		_felt.serve({"hand": "left", "amplitude": [], "stopped": true})
	if who == "stop":
		_felt.stop()
	if who == "left" or not _is_open or _state != "alive":
		return
	_service.stop()
	var stopped := {"period_ms": 12.5, "amplitude": [], "stopped": true, "hand": "right"}
	_answers.append(stopped.merged({"at": _now + ANSWER_MS}))


## Strikes glass once, and says what a speaker is told. `is_stopped`: the service stopped the other hand meanwhile.
func _heard(state: String, is_stopped: bool) -> Array[String]:
	_begin("auto")
	var heard: Array[String] = []
	_felt.touched.connect(func(fields: Dictionary, _at: float) -> void: heard.append(fields["phase"]))
	_felt.stopped.connect(func() -> void: heard.append("stop"))
	_pass(1500)
	_state = state
	_touch("contact", "glass")
	if is_stopped:
		_felt.serve({"hand": "left", "amplitude": [], "stopped": true})
	_pass(140)
	return heard


func _unknown() -> String:
	_begin("baked", "alone")
	for wrong: Dictionary in [{}, {"hand": "none"}, {"phase": null}, {"object_id": null, "surface": null}]:
		_felt.touch({"phase": "contact", "hand": "right"}.merged(wrong, true), 0.001 * _now)
	_touch("contact", "thing")
	return _felt.silence()


## Says why nothing is felt with a `materials.json` that ends too soon.
func _damaged() -> String:
	_begin("baked", "alone")
	_felt.open(_feel, HapticBake.new(null))
	_touch("contact", "thing")
	return _felt.silence()


## Says the materials of the surfaces of a bake, the second of which the service decided otherwise before.
func _materials() -> Array:
	_begin("baked", "alone")
	var surface := {"belief": 1.0, "by": "name", "surface_c": 20.0, "surface_by": "room"}
	var surfaces := ["wood", "glass"].map(func(felt: String) -> Dictionary: return surface.merged({"material": felt}))
	_felt.open(_feel, HapticBake.new({"version": 2, "not_baked": [], "objects": {"thing": {"surfaces": surfaces}}}))
	_felt.decide({"object_id": "thing", "surface": 1, "material": "metal"})
	return range(3).map(
		func(at: int) -> String: return _felt.surface_of({"object_id": "thing", "surface": at})["material"]
	)


## Returns the longest time without vibration, ms.
func _longest_gap(since: int) -> float:
	var gap := 0.0
	var felt_at := float(since)
	for told in _told:
		if told.y > 0.0:
			felt_at = told.x
		elif told.x >= since:
			gap = maxf(gap, told.x - felt_at)
	return gap


func _strongest(since: int) -> float:
	var strongest := 0.0
	for told in _told:
		if told.x >= since:
			strongest = maxf(strongest, told.y)
	return strongest


## Answers the shared cases of finding a thing in a bake.
func _identity() -> Array:
	var file: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://identity_cases.json"))
	var bake := HapticBake.new(file)
	var answers := []
	for each: Dictionary in file["queries"]:
		var found := bake.find(each["ask"])
		var near := bake.nearest(each["ask"].get("object_id", ""))
		answers.append(near if found.is_empty() else [found["object_id"], found["surface"], found["by"]])
	return answers
