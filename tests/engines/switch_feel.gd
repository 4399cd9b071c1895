extends RefCounted
## A hand touches while the service behind it dies, freezes and comes back, on a clock of our own, in ms.
##
## The switch, the player and the plan of the motor are the addon's; the service is a player that answers as a service
## does. `next` returns what the motor was told in one case: gaps, strikes, and what came after a stop.

const Felt := preload("res://addons/hapticvlm/felt.gd")
const PICTURE_MS := 11
const TOUCH_MS := 16
const PLAN_MS := 40
const ANSWER_MS := 2
const RECONNECT_MS := 260

var _feel: Dictionary
var _changes: int
var _now := 1000
var _service: FeelPlayer
var _state := "alive"  # frozen: the connection is open and says nothing; dead
var _is_open := false
var _reconnect_at := 0
var _served := {}  # hand -> true
var _planned_at := 0
var _answers: Array[Dictionary] = []
var _felt: Felt
var _motor: HapticPulses.Plan
var _told: Array[Vector2] = []  # time and amplitude


func _init(feel: Dictionary, changes: int) -> void:
	_feel = feel
	_changes = changes


## Returns the accounts by their names, to be called one a frame.
func cases() -> Dictionary[String, Callable]:
	return {
		"deaths": _stroke.bind("dead"),
		"freezes": _stroke.bind("frozen"),
		"modes": _stroke.bind("modes"),
		"strike after a freeze": _strike.bind("frozen", 5),
		"strike after a death": _strike.bind("dead", 5),
		"strike long after": _strike.bind("dead", 2000),
		"stop with a service": _stop.bind(true),
		"stop without one": _stop.bind(false),
		"auto, service": _mode.bind("auto", true),
		"auto, none": _mode.bind("auto", false),
		"baked, service": _mode.bind("baked", true),
		"service, none": _mode.bind("service", false),
		"heard with a service": _heard.bind("alive", false),
		"heard after a freeze": _heard.bind("frozen", false),
		"heard of a stop": _heard.bind("frozen", true),
		"unknown": _unknown,
		"damaged": _damaged,
		"materials": _materials,
		"identity": _identity,
	}


func _begin(mode: String, has_service := true) -> void:
	_state = "alive" if has_service else "dead"
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
		_felt.is_owner = true
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
	if not _felt.touch(fields, 0.001 * _now) or not _is_open or _state != "alive":
		return
	_served["right"] = true
	if _service.touch(fields, 0.001 * _now):
		_answer_plan("right")
	_answers.append({"at": _now + ANSWER_MS})


func _halt() -> void:
	_felt.stop()
	if not _is_open or _state != "alive":
		return
	_service.stop()
	var stopped := {"period_ms": 12.5, "amplitude": [], "stopped": true, "hand": "right"}
	_answers.append(stopped.merged({"at": _now + ANSWER_MS}))


## Strokes through deaths or freezes of the service, or through changes of the mode.
func _stroke(way: String) -> Dictionary:
	var slide := _touch.bind("slide", "rubber")
	_begin("auto")
	_pass(200)
	_touch("contact", "rubber")
	_pass(300, slide)
	var since := _now
	var by := {}
	for i in _changes:
		if way == "modes":
			_felt.select("baked", 0.001 * _now)
		else:
			_state = way
		_pass(300 + 7 * (i % 9), slide)
		by[_felt.by()] = true
		_state = "alive"
		_felt.select("auto" if way != "modes" or i % 2 == 0 else "service", 0.001 * _now)
		_pass(700, slide)
		by[_felt.by()] = true
	return {"gap_ms": _longest_gap(since), "by": by.keys()}


## Strikes glass after the service has frozen or died.
func _strike(state: String, after_ms: int) -> float:
	_begin("auto")
	_pass(1500)
	_state = state
	_pass(after_ms)
	var since := _now
	_touch("contact", "glass")
	_pass(140, _touch.bind("contact", "glass"))
	return _strongest(since)


## Stops in the middle of a stroke that goes on, with a service that dies then, or without one that comes then.
func _stop(has_service: bool) -> Dictionary:
	_begin("auto", has_service)
	_pass(1500)
	_touch("contact", "stone")
	_pass(300, _touch.bind("slide", "stone"))
	_halt()
	_pass(30)
	var since := _now
	_state = "dead" if has_service else "alive"
	_pass(900, _touch.bind("slide", "stone"))
	var held := _strongest(since)
	var silence := _felt.silence()
	_touch("release", "stone")
	_pass(50)
	var again := _now
	_touch("contact", "stone")
	_pass(100)
	return {"held": held, "silence": silence, "again": _strongest(again)}


func _mode(mode: String, has_service: bool) -> Dictionary:
	_begin(mode, has_service)
	_pass(1500)
	var since := _now
	_touch("contact", "stone")
	_pass(300, _touch.bind("slide", "stone"))
	return {"felt": _strongest(since) > 0.0, "by": _felt.by()}


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
	_begin("baked", false)
	for wrong: Dictionary in [{}, {"hand": "none"}, {"phase": null}, {"object_id": null, "surface": null}]:
		_felt.touch({"phase": "contact", "hand": "right"}.merged(wrong, true), 0.001 * _now)
	_touch("contact", "thing")
	return _felt.silence()


## Says why nothing is felt with a `materials.json` that ends too soon.
func _damaged() -> String:
	_begin("baked", false)
	_felt.open(_feel, HapticBake.new(null))
	_touch("contact", "thing")
	return _felt.silence()


## Says the materials of the surfaces of a bake, the second of which the service decided otherwise before.
func _materials() -> Array:
	_begin("baked", false)
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
