class_name HapticHand
extends Area3D
## The touching part of a hand: a small area at a fingertip or the front of a controller.
##
## Bodies with a HapticObject that touch this area are felt. The node may be moved in any way:
## speed is computed from its positions, relative to the touched object, so that a hand resting on a
## moving train has no speed.

## Emitted when a touch begins (`object` is a HapticObject), and when the hand has released everything.
signal touched(object: HapticObject)
signal released

const RENEWAL_S := 0.05  # the service ends a touch after 0.25 s without a message
const SLIDE_MPS := 0.02  # slower is a held contact
const STRIKE_MPS := 0.42  # a contact slower than this is a tap
const APPROACH_S := 0.5  # look-ahead time of an approach
const APPROACH_MPS := 0.05  # slower is not an approach
const SMOOTHING_S := 0.03
const FASTEST_MPS := 20.0  # limit of the protocol, which a jump of a tracked hand exceeds

@export_enum("left", "right") var hand := "right"
## Force in newtons: set it from a trigger or from the depth of penetration.
@export_range(0.0, 50.0, 0.1, "suffix:N") var force_n := 1.5
## The gesture of this hand if your scene knows it: press, carve ...; empty: chosen by speed.
@export var interaction := ""

var speed_mps := 0.0
## The touched object, or null.
var object: HapticObject

var _inside: Array[HapticObject] = []  # the newest last
var _was := Transform3D.IDENTITY  # the hand, relative to the touched object
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
		_send("slide" if speed_mps > SLIDE_MPS else "contact", {})
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
		_send("slide", {})
	touched.emit(met)


func _leave(body: Node3D) -> void:
	_inside = _inside.filter(
		func(met: HapticObject) -> bool: return is_instance_valid(met) and met.get_parent() != body
	)
	if not _inside.is_empty():
		_hold(_inside.back())
	else:
		_let_go()


## Uses the speed of the hand before the impact, not its speed after it.
func _strike() -> void:
	var impact := maxf(speed_mps, _velocity.length())
	var gesture := interaction
	if gesture.is_empty():
		gesture = "strike" if impact > STRIKE_MPS else "tap"
	_send("contact", {"interaction": gesture, "speed_mps": impact})


func _hold(met: HapticObject) -> void:
	object = met
	_frame_of = met.get_parent() as Node3D
	_was = _here()


func _let_go() -> void:
	if object == null:
		return
	object = null
	_frame_of = null
	_send("release", {})
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
	fields["surface"] = ahead.surface_at(hit["position"])
	_send("approach", fields)


func _send(phase: String, fields: Dictionary) -> void:
	if HapticService.current == null:
		return
	_sent_at = HapticService.now_s()
	var message := {"phase": phase, "hand": hand, "speed_mps": speed_mps, "force_n": force_n}
	if object != null:
		message["object_id"] = object.object_id
		message["surface"] = object.surface_at(global_position)
	if not interaction.is_empty() and phase != "approach" and phase != "release":
		message["interaction"] = interaction
	message.merge(fields, true)
	HapticService.current.touch(message)


func _measure(delta: float) -> void:
	var share := 1.0 - exp(-delta / SMOOTHING_S)
	_velocity = _velocity.lerp((global_position - _at) / delta, share).limit_length(FASTEST_MPS)
	_at = global_position
	var here := _here()
	speed_mps = minf(lerpf(speed_mps, here.origin.distance_to(_was.origin) / delta, share), FASTEST_MPS)
	_was = here


## Returns the hand relative to the touched object, with rotation and translation but no scale.
func _here() -> Transform3D:
	if _frame_of == null or not is_instance_valid(_frame_of):
		return global_transform
	return _frame_of.global_transform.orthonormalized().affine_inverse() * global_transform
