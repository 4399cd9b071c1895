class_name HapticService
extends Node
## What this program says to `hapticvlm serve` and hears from it. The autoload `HapticVLM`.
##
## It connects by itself, keeps what the scene has said over a lost link, and takes the outputs when
## they are free. All of it runs on the main thread and never waits.

## The service has answered: `welcome` holds its limits, devices and models.
signal opened(welcome: Dictionary)
signal closed
## What an object is made of and how it will feel.
signal decided(decision: Dictionary)
## What a hand feels in the next tenth of a second.
signal vibrated(vibration: Dictionary)
## State of the outputs, ten times a second.
signal measured(telemetry: Dictionary)
## The service refused a message or reports a fault: `code`, `text`, `path`.
signal refused(error: Dictionary)
## This scene drives the outputs from now on, or no longer.
signal ownership_changed(is_owner: bool)

const Link := preload("link.gd")
const SceneBook := preload("scene_book.gd")
const FrameSlot := preload("frame_slot.gd")
const TAKE_EVERY_S := 2.0  # how often a touch asks for outputs that another scene owns
const HANDS: Array[String] = ["left", "right"]
const FASTEST_MPS := 20.0  # the protocol's limits: a tracked hand that jumps is faster
const STRONGEST_N := 200.0

## The one that is in the tree; nodes of the addon find it here.
static var current: HapticService

## Needed when the service is on another machine. It is kept out of the project's files:
## environment HAPTICVLM_TOKEN, or `connect_to`.
var token := OS.get_environment("HAPTICVLM_TOKEN")
## Hands that get `vibrated`, as {"left": "amplitude", "right": "parametric"}.
var feels := {}:
	set(value):
		feels = value
		_ask_to_feel()
## Of the air in the scene, degC; NAN: not stated.
var ambient_c := NAN:
	set(value):
		ambient_c = value
		_book.ambient_c = value
var is_owner := false
## The newest decision on each object id.
var decisions := {}
## What was not sent: touches while there was no link, frames that a newer one replaced.
var lost: Dictionary:
	get:
		return {"touches": _lost_touches, "frames": _frames.lost}

var _link := Link.new()
var _frames := FrameSlot.new(_link)
var _url := ""
var _book := SceneBook.new()
var _lost_touches := 0
var _took_at := -INF
var _is_stopped := false
var _has_touched := false


func _enter_tree() -> void:
	current = self
	process_mode = Node.PROCESS_MODE_ALWAYS  # a paused game is still connected
	process_priority = 1000  # after the scene's own nodes, so that their news goes out this frame
	_link.on_message = _receive
	_link.on_lost = _lose
	connect_to(Link.address(), token)


func _exit_tree() -> void:
	_link.close("the program has ended")
	if current == self:
		current = null


func _process(_delta: float) -> void:
	_link.poll()
	if _link.is_open and _book.has_news:
		_tell_scene()


## Talk to the service at this address from now on.
func connect_to(url: String, with_token := "") -> void:
	_url = url
	token = with_token
	_link.close("another service was chosen")
	_link.open(url, with_token)


func is_open() -> bool:
	return _link.is_open


## Say what one object is: {object_id, name?, material?, ...}. Kept over reconnects.
func add(object: Dictionary) -> void:
	_book.add(object)


## Forget an object that is no more.
func forget(object_id: String) -> void:
	_book.forget(object_id)
	decisions.erase(object_id)


## Say what a hand does: phase, hand, object_id, speed_mps, force_n, and what else the protocol has.
func touch(message: Dictionary) -> void:
	_has_touched = true
	if not is_open():
		_lost_touches += 1
		return
	if not is_owner:
		take_outputs()
	if message["phase"] == "release":
		_is_stopped = false
	if _book.has_news:
		_tell_scene()  # an object is made known before it is touched
	var sent := message.duplicate()
	sent["captured_at"] = Link.now_s()
	sent["speed_mps"] = clampf(message.get("speed_mps", 0.0), 0.0, FASTEST_MPS)
	sent["force_n"] = clampf(message.get("force_n", 0.0), 0.0, STRONGEST_N)
	_link.tell("touch", sent)


## Show a picture: format, width, height, origin, image, object_id, mask? or region?
func show_frame(message: Dictionary) -> void:
	_frames.put(message.merged({"captured_at": Link.now_s()}))


## Rest outputs at once: all, speaker or peltier.
func stop(scope := "all") -> void:
	if is_open():
		_link.tell("stop", {"scope": scope})


## Ask for the outputs. The service gives them when they are free or their owner rests.
func take_outputs() -> void:
	if is_open() and not is_owner and Link.now_s() - _took_at > TAKE_EVERY_S:
		_took_at = Link.now_s()
		_link.tell("set", {"ownership": "take"}, "take")


## Why nothing is felt, in one sentence; empty when all is well.
func silence() -> String:
	if not is_open():
		var why := "" if _link.said.is_empty() else " (%s)" % _link.said
		return "no service at %s%s: start `hapticvlm serve`" % [_url, why]
	if not is_owner:
		return "another scene owns the outputs: close it, or let it rest for 30 s"
	if _is_stopped:
		return "stopped: let go and touch again"
	return "" if _has_touched else "no hand has touched an object yet"


static func now_s() -> float:
	return Link.now_s()


func _receive(message: Dictionary, asked: String) -> void:
	_frames.hear(int(message.get("id", 0)))
	match message.get("type"):
		"welcome":
			_welcome(message)
		"ok":
			if asked == "take":
				_own(true)
		"decision":
			decisions[message.get("object_id", "")] = message
			decided.emit(message)
		"vibration":
			_is_stopped = message.get("stopped", false)
			vibrated.emit(message)
		"telemetry":
			measured.emit(message)
		"ownership":
			_hear_of_ownership(message)
		"error":
			_refuse(message, asked)


func _welcome(message: Dictionary) -> void:
	decisions.clear()
	_book.begin_anew()
	_tell_scene()
	_own(message["owner"])
	opened.emit(message)


func _hear_of_ownership(message: Dictionary) -> void:
	_own(message["owner"])
	if message["free"]:
		_took_at = -INF
		take_outputs()


func _refuse(message: Dictionary, asked: String) -> void:
	if asked == "take" or asked == "feel":
		return  # the outputs are in use; an older service has no vibration for controllers
	if message["code"] == "not_owner":
		_own(false)
	if message["code"] == "unsafe":
		_is_stopped = true
	refused.emit(message)


func _lose() -> void:
	_frames.clear()
	_own(false)
	closed.emit()


func _own(value: bool) -> void:
	if value == is_owner:
		return
	is_owner = value
	if is_owner:
		_begin()
	ownership_changed.emit(value)


## A stop outlives the session in which it was sent: hands let go, so that their next touch is felt.
func _begin() -> void:
	_is_stopped = false
	for hand in HANDS:
		var still := {"hand": hand, "speed_mps": 0.0, "force_n": 0.0, "captured_at": Link.now_s()}
		_link.tell("touch", still.merged({"phase": "release"}))
	_ask_to_feel()


func _ask_to_feel() -> void:
	if is_open() and is_owner and not feels.is_empty():
		_link.tell("set", {"feel": feels}, "feel")


func _tell_scene() -> void:
	for news in _book.take_news():
		_link.tell("scene", news)
