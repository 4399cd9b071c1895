class_name HapticPulses
extends Node
## Plays what a hand feels on what the user holds: an XR controller, a gamepad or a phone.
##
## Each `vibration` event is a plan of at most 100 ms that replaces the one before. Every frame
## plays the strongest value since the frame before it: a short strike is not missed. After the
## end of a plan there is silence: a lost link ends by itself.

enum Output { XR_CONTROLLER, GAMEPAD, PHONE }

const PULSE_S := 0.03  # two frames at 72 Hz: the next call takes over before it ends
const WEAKEST := 0.02

@export_enum("left", "right") var hand := "right"
## An XR_CONTROLLER is this node's parent, an XRController3D.
@export var output := Output.XR_CONTROLLER
## 1 plays what the service sends; more makes weak motors felt.
@export_range(0.0, 4.0, 0.05) var gain := 1.0
## The haptic action of your OpenXR action map.
@export var action := "haptic"
## Which gamepad, counted from 0.
@export var gamepad := 0

## What is played now, 0..1.
var amplitude := 0.0
## How often the motor was told to run.
var pulses := 0

var _values := PackedFloat64Array()
var _period_s := 1.0
var _began_at := 0.0
var _played_to := 0.0  # of the plan, s


func _ready() -> void:
	var service := HapticService.current
	if service == null:
		return
	service.vibrated.connect(_receive)
	service.closed.connect(_values.clear)
	service.feels = service.feels.merged({hand: "amplitude"})


func _process(_delta: float) -> void:
	amplitude = minf(1.0, gain * _strongest(HapticService.now_s() - _began_at))
	if amplitude > WEAKEST:
		_play()


## Why this output is silent, in one sentence; empty when it is not.
func silence() -> String:
	var service := HapticService.current
	if service == null:
		return "the autoload HapticVLM is missing: enable the plugin"
	if gain == 0.0:
		return "the gain is 0"
	if output == Output.XR_CONTROLLER and not get_parent() is XRController3D:
		return "put this node below an XRController3D"
	if output == Output.GAMEPAD and gamepad not in Input.get_connected_joypads():
		return "no gamepad %d is connected" % gamepad
	return service.silence()


func _receive(vibration: Dictionary) -> void:
	if vibration["hand"] != hand:
		return
	_values = PackedFloat64Array(vibration.get("amplitude", []))
	_period_s = maxf(1e-3, vibration["period_ms"] / 1000.0)
	_began_at = HapticService.now_s()
	_played_to = 0.0


## The strongest value of the plan between the frame before and this one.
func _strongest(at_s: float) -> float:
	var first := floori(_played_to / _period_s)
	var last := mini(floori(at_s / _period_s), _values.size() - 1)
	_played_to = at_s
	var found := 0.0
	for i in range(first, last + 1):
		found = maxf(found, _values[i])
	return found


func _play() -> void:
	pulses += 1
	match output:
		Output.XR_CONTROLLER:
			var controller := get_parent() as XRController3D
			if controller != null:
				controller.trigger_haptic_pulse(action, 0.0, amplitude, PULSE_S, 0.0)
		Output.GAMEPAD:
			Input.start_joy_vibration(gamepad, amplitude, 0.0, PULSE_S)
		Output.PHONE:
			Input.vibrate_handheld(int(1000.0 * PULSE_S), amplitude)
