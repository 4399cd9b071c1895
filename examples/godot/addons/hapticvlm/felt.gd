extends RefCounted
## One switch for what is felt: the service while it answers and serves this scene, else a bake.
##
## Every touch goes to both. The bake's player therefore knows each hand at any moment and can take over in the middle of
## a stroke: when the connection ends, or when a touch is unanswered for BRIDGE_S, which is before the service's last
## plan (100 ms) has ended. It hands a hand back when the service sends that hand its next plan. Knows no socket and no
## clock: times are arguments, in s.

## A touch as the bake's player receives it, whoever is felt. One that is struck again is released first.
signal touched(fields: Dictionary, now: float)
## A stop, by this scene or by the service.
signal stopped

const BRIDGE_S := 0.06
const PLAN_EVERY_S := 0.035  # with a plan of 100 ms, two are there for each moment
const HAND_BACK_S := 1.0  # after which a service that stays silent means silence
const LATEST_S := 0.14  # age of a missed impact that is still played
const MODES: Array[String] = ["auto", "service", "baked"]

## Called with each plan of the bake: the fields of a `vibration` event.
var on_vibration: Callable
## Returns what the scene states of an object id; empty: nothing.
var stated_of: Callable
## Forms of the hands that are felt, as {"left": "amplitude"}.
var forms := {}
## Whether this scene owns the outputs of the service.
var is_owner := false
## auto, service or baked; `select` changes it.
var mode := "auto"
## The opened `feel.true.json`; empty: there is none.
var feel := {}
## The opened `materials.json`; null: there is none.
var bake: HapticBake

var _player: FeelPlayer  # null: no feel.true.json
var _baked := {}  # [object id, surface] -> what the bake has of it
var _decided := {}  # [object id, surface] -> the material that the service renders
var _hands := {"left": Hand.new(), "right": Hand.new()}
var _is_open := false
var _connected_at := -INF
var _received_at := -INF
var _asked_at := -INF  # time of the first touch that the service has not answered
var _missing := ""  # why the touched object is not felt


class Hand:
	var is_served := false
	var touches := false
	var vibrates := false
	var planned_at := -INF
	var missed := {}  # the plan of an impact that the service has not played
	var missed_touch := {}
	var missed_at := -INF


## Takes `feel.true.json` (empty: there is none) and `materials.json` (null: there is none), opened.
func open(tables: Dictionary, materials: HapticBake) -> void:
	feel = tables
	bake = materials
	_baked.clear()
	_player = null if feel.is_empty() else FeelPlayer.new(feel, surface_of)


## Returns whether there is a bake to play.
func has_bake() -> bool:
	return _player != null


## Changes over to another mode, also in the middle of a touch.
func select(value: String, now: float) -> void:
	mode = value
	for hand: Hand in _hands.values():
		hand.is_served = mode == "service"
	if mode == "auto":
		_connected_at = now
	step(now)


## Returns which of the two is felt now: service or baked.
func by() -> String:
	var hands: Array = _hands.values()
	var vibrating := hands.filter(func(hand: Hand) -> bool: return hand.vibrates)
	return "baked" if (hands if vibrating.is_empty() else vibrating).any(func(hand: Hand) -> bool: return not hand.is_served) else "service"


## Returns whether this hand feels the bake.
func is_baked(name: String) -> bool:
	return not _hands[name].is_served


## Returns whether a stop keeps this hand silent in the bake.
func is_held(name: String) -> bool:
	return _player != null and _player.is_held(name)


## Returns the reason why the bake is silent, in one sentence; empty if it is not.
func silence() -> String:
	if _player == null:
		return "no feel.true.json: see the log, or add *.json to the export's filter of files that are not resources"
	if _hands.keys().any(func(name: String) -> bool: return _hands[name].touches and is_held(name)):
		return "stopped: release and touch again"
	return _missing


## Notes that the connection opened or ended.
func connection_changed(is_open: bool, now: float) -> void:
	_is_open = is_open
	_connected_at = now
	_asked_at = -INF
	if is_open:
		return
	for hand: Hand in _hands.values():
		hand.is_served = mode == "service"
		hand.planned_at = -INF
	step(now)


## Notes that the service said something.
func hear(now: float) -> void:
	_received_at = now


## Notes the material that the service renders on a surface.
func decide(decision: Dictionary) -> void:
	if not decision.has("object_id"):
		return
	var surface := [decision["object_id"], int(decision.get("surface", 0))]
	var material: Variant = decision.get("felt")
	if material == null and decision["material"] != "unknown":
		material = decision["material"]
	if material == null:
		_decided.erase(surface)
	else:
		_decided[surface] = material


## Receives a touch; returns whether it is to be sent to the service, too.
func touch(fields: Dictionary, now: float) -> bool:
	var is_sent := _is_open and mode != "baked"
	if is_sent and is_owner and _received_at >= _asked_at:
		_asked_at = now
	if _player == null:
		return is_sent
	var hand: Hand = _hands.get(fields.get("hand"))
	var begins_impact := _player.touch(fields, now)
	if hand == null:
		return is_sent
	var is_release := str(fields.get("phase")) == "release"
	hand.touches = not is_release
	touched.emit(fields, now)
	if is_release:
		hand.missed = {}
	if begins_impact:
		hand.missed = _plan(fields["hand"], now)
		hand.missed_touch = fields
		hand.missed_at = now
	if not hand.is_served:
		if begins_impact:
			_post_missed(fields["hand"], now)
		elif is_release:
			_post_plan(fields["hand"], now)
	return is_sent


## Receives a plan of the service, which gets its hand back; returns whether it is felt. A stop holds in both: the bake
## does not go on where an operator stopped the service, and a service that began after a stop, and does not know of it,
## is not felt.
func serve(vibration: Dictionary) -> bool:
	var name: String = vibration["hand"]
	if vibration.get("stopped", false) and _player != null:
		_stop_player()
	var vibrates: bool = not vibration.get("amplitude", []).is_empty()
	if mode == "baked" or (vibrates and is_held(name)):
		return false
	_hands[name].is_served = true
	_hands[name].missed = {}
	_hands[name].vibrates = vibrates
	return true


## Ends the vibration of the bake at once; it holds each hand until its release and a new touch.
func stop() -> void:
	if _player == null:
		return
	_stop_player()
	for name: String in _hands:
		if not _hands[name].is_served and forms.has(name):
			_post(name, {"period_ms": 12.5, "amplitude": [], "frequency_hz": [], "transients": []}, true)


## Decides by which a hand is felt, and plans for those of the bake. Called once per frame, after what came in.
func step(now: float) -> void:
	for name: String in _hands:
		var hand: Hand = _hands[name]
		_change_over(hand, now)
		if _player == null or hand.is_served:
			continue
		if not hand.missed.is_empty():
			_strike_again(name, now)
		elif now - hand.planned_at >= PLAN_EVERY_S:
			_post_plan(name, now)


## Returns what is felt of a touched object without the service: a surface of `materials.json`.
func surface_of(fields: Dictionary) -> Dictionary:
	var id := "" if fields.get("object_id") == null else str(fields["object_id"])
	var key := [id, HapticBake.whole(fields.get("surface"), 0)]
	var stated: Dictionary = stated_of.call(id)
	if not _baked.has(key):
		_baked[key] = _find(id, key[1], stated)
	var surface: Dictionary = _baked[key]
	if _decided.has(key):
		surface = surface.merged({"material": _decided[key]}, true)
	elif surface.get("material") == null and str(stated.get("material", "unknown")) != "unknown":
		surface = surface.merged({"material": stated["material"]}, true)
	_missing = "" if surface.get("material") != null or id.is_empty() else _miss(id, _baked[key])
	return surface


## Forgets where an object is in the bake, because it states something else.
func restate(object_id: String) -> void:
	for key: Array in _baked.keys():
		if key[0] == object_id:
			_baked.erase(key)


func _find(id: String, surface: int, stated: Dictionary) -> Dictionary:
	if bake == null:
		return {}
	var query := {"object_id": id, "paths": [stated.get("name", id)], "surface": surface, "engine": "godot"}
	var surfaces: Variant = stated.get("surfaces")
	if surfaces is Array and surface >= 0 and surface < surfaces.size() and surfaces[surface] is Dictionary:
		query["material"] = surfaces[surface].get("name")
	return bake.surface_of(bake.find(query))


func _miss(id: String, found: Dictionary) -> String:
	if not found.is_empty():
		return "the material of `%s` is unknown: correct it in materials.json, or bake with --unknown" % id
	if bake != null and not bake.problem.is_empty():
		return "materials.json: " + bake.problem
	var near := "there is no materials.json" if bake == null else "nearest is `%s`" % bake.nearest(id)
	return "`%s` is not in the bake; %s: bake the scene again, or state its material" % [id, near]


func _change_over(hand: Hand, now: float) -> void:
	if mode != "auto" or not _is_open:
		return
	if not is_owner or (_received_at < _asked_at and now - _asked_at >= BRIDGE_S):
		hand.is_served = false  # it serves another scene, or is silent
	elif now - _connected_at >= HAND_BACK_S and not hand.vibrates:
		hand.is_served = true


func _stop_player() -> void:
	_player.stop()
	for hand: Hand in _hands.values():
		hand.missed = {}
	stopped.emit()


## Strikes what the service did not play: for the motors, and as sound.
func _strike_again(name: String, now: float) -> void:
	var hand: Hand = _hands[name]
	if now - hand.missed_at < LATEST_S:
		touched.emit({"phase": "release", "hand": name}, now)
		touched.emit(hand.missed_touch, now)
	_post_missed(name, now)


## Posts the plan of an impact that the service did not play; it begins now.
func _post_missed(name: String, now: float) -> void:
	var hand: Hand = _hands[name]
	var plan := hand.missed
	hand.missed = {}
	if now - hand.missed_at < LATEST_S and forms.has(name):
		hand.planned_at = now
		_post(name, plan)


func _post_plan(name: String, now: float) -> void:
	if not forms.has(name):
		return
	_hands[name].planned_at = now
	var plan := _plan(name, now)
	if not plan["amplitude"].is_empty() or _hands[name].vibrates:
		_post(name, plan)


func _plan(name: String, now: float) -> Dictionary:
	return _player.plan(name, str(forms.get(name, "amplitude")), now)


func _post(name: String, plan: Dictionary, is_stopped := false) -> void:
	_hands[name].vibrates = not plan["amplitude"].is_empty()
	on_vibration.call(plan.merged({"hand": name, "stopped": is_stopped}))
