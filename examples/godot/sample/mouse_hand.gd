extends HapticHand
## A fingertip moved by the mouse: it hovers over the object under the pointer and touches it while a
## button is held.

const HOVER_M := 0.06
const DEPTH_M := 0.004  # depth of the fingertip's ball in the touched object
const FASTEST := 1.2  # m/s, of the fingertip
const RADIUS_M := 0.02

var _goal := Vector3.ZERO


func _ready() -> void:
	super()
	_goal = global_position


func _physics_process(delta: float) -> void:
	_goal = _under_mouse()
	global_position = global_position.move_toward(_goal, FASTEST * delta)
	super(delta)


func _under_mouse() -> Vector3:
	var camera := get_viewport().get_camera_3d()
	var mouse := get_viewport().get_mouse_position()
	var from := camera.project_ray_origin(mouse)
	var query := PhysicsRayQueryParameters3D.create(
		from, from + 5.0 * camera.project_ray_normal(mouse), collision_mask
	)
	var hit := get_world_3d().direct_space_state.intersect_ray(query)
	if hit.is_empty():
		return _goal
	var is_pressed := Input.is_mouse_button_pressed(MOUSE_BUTTON_LEFT)
	var height := RADIUS_M - DEPTH_M if is_pressed else RADIUS_M + HOVER_M
	return hit["position"] + height * (hit["normal"] as Vector3)
