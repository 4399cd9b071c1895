class_name HapticPulses
extends Node
## Plays the vibration of a hand, the service's or the bake's, on the user's device: an XR controller, a gamepad or a phone.
##
## Each `vibration` event is a plan of at most 100 ms that replaces the one before. Every frame
## plays the strongest value since the last frame, so that a short strike is not missed. After the
## end of a plan there is silence, so the device stops when the link is lost.

enum Output { XR_CONTROLLER, GAMEPAD, PHONE }

const PULSE_S := 0.03  # two frames at 72 Hz, so that the next call replaces it before it ends
const WEAKEST := 0.02

@export_enum("left", "right") var hand := "right"
## An XR_CONTROLLER is this node's parent, an XRController3D.
@export var output := Output.XR_CONTROLLER
## Factor applied to the vibration; values above 1 help weak motors.
@export_range(0.0, 4.0, 0.05) var gain := 1.0
## The haptic action of your OpenXR action map.
@export var action := "haptic"
## Index of the gamepad, from 0.
@export var gamepad := 0

## The amplitude being played, 0..1.
var amplitude := 0.0
## Number of commands sent to the motor.
var pulses := 0

var _plan := Plan.new()


## The plan of a hand; times are arguments, in s.
class Plan:
	var _values := PackedFloat64Array()
	var _period_s := 1.0
	var _began_at := 0.0
	var _played_to := 0.0  # from its begin, s

	func clear() -> void:
		_values.clear()

	func receive(vibration: Dictionary, now: float) -> void:
		_values = PackedFloat64Array(vibration.get("amplitude", []))
		_period_s = maxf(1e-3, vibration["period_ms"] / 1000.0)
		_began_at = now
		_played_to = 0.0

	## Returns the strongest value between the last call and this one.
	func strongest(now: float) -> float:
		var first := floori(_played_to / _period_s)
		var last := mini(floori((now - _began_at) / _period_s), _values.size() - 1)
		_played_to = now - _began_at
		var value := 0.0
		for i in range(first, last + 1):
			value = maxf(value, _values[i])
		return value


func _ready() -> void:
	var service := HapticService.current
	if service == null:
		return
	service.vibrated.connect(_receive)
	service.closed.connect(_plan.clear)
	service.feels = service.feels.merged({hand: "amplitude"})


func _process(_delta: float) -> void:
	amplitude = minf(1.0, gain * _plan.strongest(HapticService.now_s()))
	if amplitude > WEAKEST:
		_play()


## Returns the reason why this output is silent, in one sentence; empty if it is not.
func silence() -> String:
	var service := HapticService.current
	if service == null:
		return "the autoload HapticVLM is missing: enable the plugin"
	if gain == 0.0:
		return "the gain is 0"
	if output == Output.XR_CONTROLLER and not get_parent() is XRController3D:
		return "add this node below an XRController3D"
	if output == Output.GAMEPAD and gamepad not in Input.get_connected_joypads():
		return "gamepad %d is not connected" % gamepad
	return service.silence()


func _receive(vibration: Dictionary) -> void:
	if vibration["hand"] == hand:
		_plan.receive(vibration, HapticService.now_s())


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
