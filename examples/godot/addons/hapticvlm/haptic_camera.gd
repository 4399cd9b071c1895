class_name HapticCamera
extends Node
## Sends pictures of touched objects that the service cannot identify by name.
##
## A picture is taken from the position of the scene's camera, aimed at the object and zoomed until it fills the
## frame; a second one of the object alone provides its mask. Both are drawn once, on demand. Meshes
## of hands are on a separate layer and are omitted.

const SIDE := 448  # px; the service reads it at half this size
const QUALITY := 0.8
const EVERY_S := 0.5
const MAX_PICTURES := 5  # of one object
const MARGIN := 1.15  # relative to the object's size
const HANDS_LAYER := 19
const ALONE_LAYER := 20

## Number of pictures sent.
var taken := 0

var _counts := {}  # object id -> pictures
var _taken_at := -INF
var _picture: SubViewport
var _outline: SubViewport
var _is_busy := false


func _ready() -> void:
	_picture = _viewport(0xFFFFF & ~(1 << (HANDS_LAYER - 1)))
	_outline = _viewport(1 << (ALONE_LAYER - 1))
	_outline.transparent_bg = true
	var nothing := Environment.new()
	nothing.background_mode = Environment.BG_CLEAR_COLOR
	(_outline.get_child(0) as Camera3D).environment = nothing


func _process(_delta: float) -> void:
	if _is_busy or HapticService.current == null or not HapticService.current.is_open():
		return
	if HapticService.now_s() - _taken_at < EVERY_S:
		return
	for hand: HapticHand in get_tree().get_nodes_in_group("haptic_hands"):
		if hand.object != null and _is_wanted(hand.object):
			take(hand.object)
			return


## Takes and sends a picture of an object.
func take(object: HapticObject) -> void:
	var bounds := _bounds(object)
	var eye := get_viewport().get_camera_3d()
	if eye == null or bounds.size == Vector3.ZERO:
		return
	_is_busy = true
	_taken_at = HapticService.now_s()
	_counts[object.object_id] = _counts.get(object.object_id, 0) + 1
	_aim(eye.global_position, bounds)
	var meshes := object.meshes()
	for mesh in meshes:
		mesh.set_layer_mask_value(ALONE_LAYER, true)
	await RenderingServer.frame_post_draw
	for mesh in meshes:
		if is_instance_valid(mesh):
			mesh.set_layer_mask_value(ALONE_LAYER, false)
	if is_instance_valid(object):
		_send(object.object_id)
	_is_busy = false


func _is_wanted(object: HapticObject) -> bool:
	var decision: Dictionary = HapticService.current.decisions.get(object.object_id, {})
	var is_unknown: bool = decision.get("material", "") == "unknown"
	return object.shows_pictures and is_unknown and _counts.get(object.object_id, 0) < MAX_PICTURES


func _viewport(layers: int) -> SubViewport:
	var viewport := SubViewport.new()
	viewport.size = Vector2i(SIDE, SIDE)
	viewport.render_target_update_mode = SubViewport.UPDATE_DISABLED
	var camera := Camera3D.new()
	camera.cull_mask = layers
	camera.near = 0.01
	viewport.add_child(camera)
	add_child(viewport)
	return viewport


func _aim(from: Vector3, bounds: AABB) -> void:
	var middle := bounds.get_center()
	var radius := 0.5 * bounds.size.length() * MARGIN
	var angle := 2.0 * asin(clampf(radius / maxf(from.distance_to(middle), 1e-3), 0.01, 0.9))
	var up := Vector3.UP
	if absf((middle - from).normalized().y) > 0.99:
		up = Vector3.FORWARD
	for viewport: SubViewport in [_picture, _outline]:
		var camera := viewport.get_child(0) as Camera3D
		camera.look_at_from_position(from, middle, up)
		camera.fov = rad_to_deg(angle)
		viewport.render_target_update_mode = SubViewport.UPDATE_ONCE


func _bounds(object: HapticObject) -> AABB:
	var all := AABB()
	for mesh in object.meshes():
		var own := mesh.global_transform * mesh.get_aabb()
		all = own if all.size == Vector3.ZERO else all.merge(own)
	return all


func _send(object_id: String) -> void:
	var picture := _picture.get_texture().get_image()
	picture.convert(Image.FORMAT_RGB8)
	var message := {
		"format": "jpeg",
		"width": SIDE,
		"height": SIDE,
		"origin": "top",
		"image": picture.save_jpg_to_buffer(QUALITY),
		"object_id": object_id,
	}
	var mask := _mask(_outline.get_texture().get_image())
	if not mask.is_empty():
		message["mask"] = mask
	taken += 1
	HapticService.current.show_frame(message)


## Returns the object's pixels as an 8-bit PNG; empty when it is hidden.
func _mask(outline: Image) -> PackedByteArray:
	outline.convert(Image.FORMAT_RGBA8)
	if outline.is_invisible():
		return PackedByteArray()
	var whole := Rect2i(0, 0, SIDE, SIDE)
	var white := Image.create_empty(SIDE, SIDE, false, Image.FORMAT_RGBA8)
	white.fill(Color.WHITE)
	var mask := Image.create_empty(SIDE, SIDE, false, Image.FORMAT_RGBA8)
	mask.blit_rect_mask(white, outline, whole, Vector2i.ZERO)
	mask.convert(Image.FORMAT_L8)
	return mask.save_png_to_buffer()
