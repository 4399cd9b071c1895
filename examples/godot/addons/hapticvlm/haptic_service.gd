class_name HapticService
extends Node
## The connection to `hapticvlm serve`; the autoload `HapticVLM`.
##
## It connects automatically, sends the scene again after a lost link, and takes the outputs when
## they are free. While no service answers, a bake is felt: see `mode`. It runs on the main thread and never blocks.

## Emitted when the connection is open: `welcome` contains limits, devices and models.
signal opened(welcome: Dictionary)
signal closed
## The material of an object and how it will feel.
signal decided(decision: Dictionary)
## The vibration of a hand in the next tenth of a second.
signal vibrated(vibration: Dictionary)
## The state of the outputs, ten times a second.
signal measured(telemetry: Dictionary)
## The service refused a message or reported a fault: `code`, `text`, `path`.
signal refused(error: Dictionary)
## A part of the scene was not sent or not taken: `object_id`, `path`, `text`. The rest is felt.
signal left_out(part: Dictionary)
## This scene gained or lost the outputs.
signal ownership_changed(is_owner: bool)

const Link := preload("link.gd")
const SceneRegistry := preload("scene_registry.gd")
const FrameSlot := preload("frame_slot.gd")
const TextureMaps := preload("texture_maps.gd")
const Felt := preload("felt.gd")
const FEEL := "res://addons/hapticvlm/feel.true.json"  # the built-in materials
const SURFACES_SINCE_MINOR := 2  # an older service refuses unknown fields
const TAKE_EVERY_S := 2.0  # interval between requests for outputs that another scene owns
const HANDS: Array[String] = ["left", "right"]
const NO_TOUCH := "no hand has touched an object yet"
const LARGEST := 1e9  # number that JSON carries in place of an infinity; the service takes its own limit

## The instance in the tree, for the nodes of the addon.
static var current: HapticService

## What is felt: `auto` (the service while it answers, else the bake), `service` or `baked`. A scene that begins with
## `baked` connects to no service.
@export_enum("auto", "service", "baked") var mode: String = ProjectSettings.get_setting("hapticvlm/mode", "auto"):
	set = _set_mode
## Which of the two is felt now: service or baked.
var by: String:
	get:
		return felt.by()
## Required when the service is on another machine. It is not stored in the project's files:
## set it in the environment variable HAPTICVLM_TOKEN or with `connect_to`.
var token := OS.get_environment("HAPTICVLM_TOKEN")
## Hands that get `vibrated`, as {"left": "amplitude", "right": "parametric"}.
var feels := {}:
	set(value):
		feels = value
		felt.forms = value
		_ask_to_feel()
## Air temperature in the scene, degC; NAN: not stated.
var ambient_c := NAN:
	set(value):
		ambient_c = value
		_registry.ambient_c = value
var is_owner := false
## The switch between service and bake, for nodes that play touches themselves.
var felt := Felt.new()
## The newest decision for each object id, on whichever of its surfaces.
var decisions := {}
## Numbers of dropped messages: touches without a link or a bake, frames replaced by a newer one.
var lost: Dictionary:
	get:
		return {"touches": _lost_touches, "frames": _frames.lost}

var _link := Link.new()
var _frames := FrameSlot.new(_link)
var _textures := TextureMaps.new()
var _url := ""
var _registry := SceneRegistry.new()
var _lost_touches := 0
var _took_at := -INF
var _is_stopped := false
var _has_touched := false
var _knows_surfaces := false
var _sent_objects := {}  # unanswered scene message -> its objects
var _scene_refusal := ""  # the reason why a scene message was refused as a whole
var _warned := {}


func _enter_tree() -> void:
	current = self
	process_mode = Node.PROCESS_MODE_ALWAYS  # stay connected while the game is paused
	process_priority = 1000  # run after the scene's nodes, so that their changes are sent in this frame
	_registry.on_left_out = _leave_out
	_textures.send = _send_texture
	_link.on_message = _receive
	_link.on_lost = _lose
	felt.on_vibration = vibrated.emit
	felt.stated_of = _registry.stated_of
	_set_mode(mode)


func _exit_tree() -> void:
	_link.close("the program has ended")
	_textures.close()
	_url = ""
	if current == self:
		current = null


func _process(_delta: float) -> void:
	_link.poll()
	if _link.is_open and _registry.has_changes:
		_send_scene()
	if _link.is_open:
		_textures.step(Link.now_s())
	felt.step(Link.now_s())


## Connects to the service at this address.
func connect_to(url: String, with_token := "") -> void:
	_url = url
	token = with_token
	_link.close("another service was selected")
	_link.open(url, with_token)


func is_open() -> bool:
	return _link.is_open


## Describes one object: {object_id, name?, material?, ...}. It is sent again after a reconnect.
func add(object: Dictionary) -> void:
	_registry.add(object)
	felt.restate(str(object.get("object_id", "")))


## Removes an object.
func forget(object_id: String) -> void:
	_registry.forget(object_id)
	felt.restate(object_id)
	decisions.erase(object_id)


## Sends a touch: phase, hand, object_id, speed_mps, force_n, and other fields of the protocol.
func touch(message: Dictionary) -> void:
	_has_touched = true
	var sent := {"captured_at": Link.now_s()}
	for name: String in message:
		var value: Variant = message[name]
		if value is float and is_nan(value):
			continue
		if value != null:
			sent[name] = clampf(value, -LARGEST, LARGEST) if value is float else value
	if message.get("phase") == "release":
		_is_stopped = false
	if not felt.touch(message, Link.now_s()):
		_lost_touches += int(not _plays_bake())
		return
	if not is_owner:
		take_outputs()
	if _registry.has_changes:
		_send_scene()  # objects are sent before they are touched
	if not _knows_surfaces:
		sent.erase("surface")
	_link.send("touch", sent)


## Sends a picture: format, width, height, origin, image, object_id, mask? or region?
func show_frame(message: Dictionary) -> void:
	_frames.put(message.merged({"captured_at": Link.now_s()}))


## Stops outputs at once: all, speaker or peltier.
func stop(scope := "all") -> void:
	if is_open():
		_link.send("stop", {"scope": scope})
	if scope != "peltier":
		felt.stop()


## Requests the outputs. The service grants them if they are free or their owner is idle.
func take_outputs() -> void:
	if is_open() and not is_owner and Link.now_s() - _took_at > TAKE_EVERY_S:
		_took_at = Link.now_s()
		_link.send("set", {"ownership": "take"}, "take")


## Returns the reason why nothing is felt, in one sentence; empty if there is none.
func silence() -> String:
	if _plays_bake():
		var reason := felt.silence()
		return reason if _has_touched or not reason.is_empty() else NO_TOUCH
	if not is_open():
		var why := "" if _link.said.is_empty() else " (%s)" % _link.said
		return "no service at %s%s: start `hapticvlm serve`" % [_url, why]
	if not is_owner:
		return "another scene owns the outputs: close it, or leave it idle for 30 s"
	if _is_stopped:
		return "stopped: release and touch again"
	if not _scene_refusal.is_empty():
		return "the service refused the scene: %s" % _scene_refusal
	return "" if _has_touched else NO_TOUCH


## Returns the reason why the bake is felt and not the service, in one sentence; empty while the service is.
func baked_because() -> String:
	if not _plays_bake():
		return ""
	if mode == "baked":
		return "this scene plays its bake"
	return "another scene owns the outputs" if is_open() and not is_owner else "no service answers"


static func now_s() -> float:
	return Link.now_s()


func _set_mode(value: String) -> void:
	if not value in Felt.MODES:
		push_error("HapticVLM: mode: `%s` is not one of %s" % [value, ", ".join(Felt.MODES)])
		return
	mode = value
	if current != self:
		return  # not in the tree yet
	if mode != "service" and not felt.has_bake():
		_open_bake()
	if mode != "baked" and _url.is_empty():
		connect_to(Link.address(), token)
	felt.select(mode, Link.now_s())


## Opens the project's bake; the built-in materials where it has none.
func _open_bake() -> void:
	var folder: String = ProjectSettings.get_setting("hapticvlm/bake", "res://baked")
	var feel := folder.path_join("feel.true.json")
	var materials: HapticBake = null
	if FileAccess.file_exists(folder.path_join("materials.json")):
		materials = HapticBake.new(JSON.parse_string(FileAccess.get_file_as_string(folder.path_join("materials.json"))))
	feel = feel if FileAccess.file_exists(feel) else FEEL
	if FileAccess.file_exists(feel):
		felt.open(FeelPlayer.open(FileAccess.get_file_as_string(feel)), materials)


func _plays_bake() -> bool:
	return mode == "baked" or (felt.has_bake() and felt.by() == "baked")


func _receive(message: Dictionary, asked: String) -> void:
	_frames.hear(int(message.get("id", 0)))
	felt.hear(Link.now_s())
	match message.get("type"):
		"welcome":
			_welcome(message)
		"ok":
			if asked == "take":
				_own(true)
			_hear_what_was_left_out(message)
		"decision":
			decisions[message.get("object_id", "")] = message
			felt.decide(message)
			decided.emit(message)
		"vibration":
			_is_stopped = message.get("stopped", false)
			if felt.serve(message):
				vibrated.emit(message)
		"textures":
			_textures.want(message["hashes"])
		"telemetry":
			measured.emit(message)
		"ownership":
			_hear_of_ownership(message)
		"error":
			_refuse(message, asked)


func _welcome(message: Dictionary) -> void:
	decisions.clear()
	_knows_surfaces = message["protocol"]["minor"] >= SURFACES_SINCE_MINOR
	_sent_objects.clear()
	_textures.clear()
	_scene_refusal = ""
	_registry.materials = message["materials"]
	_registry.restart()
	felt.connection_changed(true, Link.now_s())
	_send_scene()
	_own(message["owner"])
	opened.emit(message)


func _hear_of_ownership(message: Dictionary) -> void:
	_own(message["owner"])
	if message["free"]:
		_took_at = -INF
		take_outputs()


func _refuse(message: Dictionary, asked: String) -> void:
	if asked == "take" or asked == "feel":
		return  # the outputs are in use, or an older service has no vibration for controllers
	if message["code"] == "not_owner":
		_own(false)
	if message["code"] == "unsafe":
		_is_stopped = true
	if asked == "scene":
		_scene_refusal = message["text"]
	if not message["code"] in ["unsafe", "not_owner"]:
		_warn("the service refused a message: %s" % message["text"])
	refused.emit(message)


func _hear_what_was_left_out(message: Dictionary) -> void:
	var id := int(message["id"])
	var objects: Array = _sent_objects.get(id, [])
	_sent_objects.erase(id)
	for part: Dictionary in message.get("left_out", []):
		var steps: PackedStringArray = part["path"].trim_prefix("objects[").split("]")
		var number := int(steps[0]) if part["path"].begins_with("objects[") else objects.size()
		var object: Dictionary = objects[number] if number < objects.size() else {}
		_leave_out(object.get("object_id", ""), part["path"], part["text"])


func _leave_out(object_id: String, path: String, text: String) -> void:
	_warn("%s, %s: %s" % [object_id if not object_id.is_empty() else "a message", path, text])
	left_out.emit({"object_id": object_id, "path": path, "text": text})


## Shows a sentence among the debugger's warnings, once.
func _warn(text: String) -> void:
	if not _warned.has(text) and _warned.size() < 100:
		_warned[text] = true
		push_warning("HapticVLM: ", text)


func _lose() -> void:
	_frames.clear()
	_own(false)
	closed.emit()
	felt.connection_changed(false, Link.now_s())  # after `closed`, which ends the plans of the service


func _own(value: bool) -> void:
	if value == is_owner:
		return
	is_owner = value
	felt.is_owner = value
	if is_owner:
		_begin()
	ownership_changed.emit(value)


## Sends a release for each hand, because a stop outlives its session and lasts until the hand releases.
func _begin() -> void:
	_is_stopped = false
	for hand in HANDS:
		var still := {"hand": hand, "speed_mps": 0.0, "force_n": 0.0, "captured_at": Link.now_s()}
		_link.send("touch", still.merged({"phase": "release"}))
	_ask_to_feel()


func _ask_to_feel() -> void:
	if is_open() and is_owner and not feels.is_empty():
		_link.send("set", {"feel": feels}, "feel")


func _send_scene() -> void:
	for news in _registry.take_changes():
		if not _knows_surfaces:
			news["objects"] = news["objects"].map(_without_surfaces)
		_sent_objects[_link.send("scene", news)] = news["objects"]


func _send_texture(texture: String, frame: Dictionary) -> void:
	var surface := _registry.surface_with(texture)
	if is_open() and not surface.is_empty():
		_link.send_packed("frame", frame.merged(surface).merged({"captured_at": Link.now_s()}))


static func _without_surfaces(object: Dictionary) -> Dictionary:
	var without := object.duplicate()
	without.erase("surfaces")
	if without.has("shader"):
		without["shader"] = without["shader"].duplicate()
		without["shader"].erase("opacity")
	return without
