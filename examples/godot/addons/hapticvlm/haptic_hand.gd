class_name HapticHand
extends Area3D
## The part of a hand that feels: a small area at a fingertip or a controller's front.
##
## Bodies that hold a HapticObject and touch this area are felt. Move the node however you like:
## speed is measured from where it is, in the frame of what it touches, so that a hand resting on a
## moving train is still.

## A touch begins (`object` is a HapticObject), and the hand has let go of everything.
signal touched(object: HapticObject)
signal released

const RENEWAL_S := 0.05  # the service holds a touch for 0.25 s without news
const SLIDE_MPS := 0.02  # slower is holding
const STRIKE_MPS := 0.42  # a contact slower than this is a tap
const APPROACH_S := 0.5  # how far ahead an approach is seen
const APPROACH_MPS := 0.05  # slower is not heading anywhere
const SMOOTHING_S := 0.03

@export_enum("left", "right") var hand := "right"
## How hard it presses, newton: set it from a trigger or from how deep the hand is.
@export_range(0.0, 50.0, 0.1, "suffix:N") var force_n := 1.5
## The gesture of this hand when your scene knows it: press, carve ...; empty: by its speed.
@export var interaction := ""

var speed_mps := 0.0
## What is felt now, or null.
var object: HapticObject

var _inside: Array[HapticObject] = []  # the newest last
var _was := Transform3D.IDENTITY  # the hand, in the frame of what it touches
var _frame_of: Node3D
var _velocity := Vector3.ZERO  # in the world, for approaches
var _at := Vector3.ZERO
var _sent_at := 0.0


func _ready() -> void:
	add_to_group("haptic_hands")
	body_entered.connect(_enter)
	body_exited.connect(_leave)
	area_entered.connect(_enter)
	area_exited.connect(_leave)
	_at = global_position


func _exit_tree() -> void:
	_inside.clear()
	_let_go()


func _physics_process(delta: float) -> void:
	_measure(delta)
	if object != null and not is_instance_valid(object):
		object = null
	if HapticService.current == null or HapticService.now_s() - _sent_at < RENEWAL_S:
		return
	if object != null:
		_say("slide" if speed_mps > SLIDE_MPS else "contact", {})
	elif _velocity.length() > APPROACH_MPS:
		_approach()


func _enter(body: Node3D) -> void:
	var met: HapticObject = HapticObject.by_body.get(body)
	if met == null or met in _inside:
		return
	_inside.append(met)
	var is_first := object == null
	_hold(met)
	if is_first:
		_strike()
	else:
		_say("slide", {})
	touched.emit(met)


func _leave(body: Node3D) -> void:
	_inside = _inside.filter(
		func(met: HapticObject) -> bool: return is_instance_valid(met) and met.get_parent() != body
	)
	if not _inside.is_empty():
		_hold(_inside.back())
	else:
		_let_go()


## The impact has the speed with which the hand came, not the one it has when it is stopped.
func _strike() -> void:
	var impact := maxf(speed_mps, _velocity.length())
	var gesture := interaction
	if gesture.is_empty():
		gesture = "strike" if impact > STRIKE_MPS else "tap"
	_say("contact", {"interaction": gesture, "speed_mps": impact})


func _hold(met: HapticObject) -> void:
	object = met
	_frame_of = met.get_parent() as Node3D
	_was = _here()


func _let_go() -> void:
	if object == null:
		return
	object = null
	_frame_of = null
	_say("release", {})
	released.emit()


func _approach() -> void:
	var query := PhysicsRayQueryParameters3D.create(
		global_position, global_position + _velocity * APPROACH_S, collision_mask
	)
	query.collide_with_areas = true
	query.exclude = [get_rid()]
	var hit := get_world_3d().direct_space_state.intersect_ray(query)
	if hit.is_empty() or not HapticObject.by_body.has(hit["collider"]):
		return
	var distance := global_position.distance_to(hit["position"])
	var ahead: HapticObject = HapticObject.by_body[hit["collider"]]
	var closing := -_velocity.dot(hit["normal"])
	var fields := {"object_id": ahead.object_id, "distance_m": distance, "closing_mps": closing}
	_say("approach", fields)


func _say(phase: String, fields: Dictionary) -> void:
	if HapticService.current == null:
		return
	_sent_at = HapticService.now_s()
	var message := {"phase": phase, "hand": hand, "speed_mps": speed_mps, "force_n": force_n}
	if object != null:
		message["object_id"] = object.object_id
	if not interaction.is_empty() and phase != "approach" and phase != "release":
		message["interaction"] = interaction
	message.merge(fields, true)
	HapticService.current.touch(message)


func _measure(delta: float) -> void:
	var share := 1.0 - exp(-delta / SMOOTHING_S)
	_velocity = _velocity.lerp((global_position - _at) / delta, share)
	_at = global_position
	var here := _here()
	speed_mps = lerpf(speed_mps, here.origin.distance_to(_was.origin) / delta, share)
	_was = here


## Where the hand is in the frame of what it touches; turned and moved, not scaled.
func _here() -> Transform3D:
	if _frame_of == null or not is_instance_valid(_frame_of):
		return global_transform
	return _frame_of.global_transform.orthonormalized().affine_inverse() * global_transform
