extends Node3D
## A room of one mesh with a surface for each material, and a hand that touches each of them in turn.
##
## It says each decision on a surface that the hand is on, then the time of a search in a large mesh.

const AWAY_M := 1.0
const LONGEST_S := 20.0
const SEARCHES := 200
const REPEATS := 10
const NAMES: Array[String] = [
	"Oak_Planks", "Brushed_Steel", "mat14", "Window_Glass", "Marble_White", "Red_Brick", "Black_Rubber",
	"Leather_Brown", "Cardboard_Box", "Plastic_ABS", "Wool_Carpet", "Copper", "Paper_Sheet", "Ceramic_Tile",
	"Granite", "Pine", "Linen", "Porcelain", "Suede", "Walnut",
]

var say: Callable

var _hand := HapticHand.new()
var _felt := {}  # surface -> material


func _ready() -> void:
	position = Vector3(100.0, 0.0, 0.0)
	HapticService.current.decided.connect(_hear)
	var body := StaticBody3D.new()
	body.name = "mesh2057757694"
	var instance := MeshInstance3D.new()
	instance.mesh = _panels()
	instance.mesh.surface_set_material(0, _painted("Walnut"))  # overridden by what is drawn
	instance.set_surface_override_material(0, _painted(NAMES[0]))
	var shape := CollisionShape3D.new()
	shape.shape = instance.mesh.create_trimesh_shape()
	body.add_child(instance)
	body.add_child(shape)
	body.add_child(HapticObject.new())
	add_child(body)
	var ball := CollisionShape3D.new()
	ball.shape = SphereShape3D.new()
	(ball.shape as SphereShape3D).radius = 0.02
	_hand.hand = "left"
	_hand.add_child(ball)
	_hand.position = _on(0) + AWAY_M * Vector3.BACK
	add_child(_hand)
	await _touch_each()
	await _search()


func _touch_each() -> void:
	for i in NAMES.size():
		_hand.position = _on(i) + AWAY_M * Vector3.BACK
		await _frames(10)
		_felt.clear()
		_hand.position = _on(i) + 0.01 * Vector3.BACK
		var until := HapticService.now_s() + LONGEST_S
		while _felt.is_empty() and HapticService.now_s() < until:
			await get_tree().process_frame
		await _frames(10)
		say.call("surface", {"name": NAMES[i], "felt": _felt.duplicate()})
		_hand.position = _on(i) + AWAY_M * Vector3.BACK  # not sideways: it slid over to the next panel
		await _frames(10)
	_hand.position = Vector3(0.0, 50.0, 0.0)
	await _frames(10)
	say.call("surfaces felt", {})


## Searches a sphere of 10,000 triangles from points up to 2 cm above and below it.
func _search() -> void:
	var sphere := SphereMesh.new()
	sphere.radial_segments = 72
	sphere.rings = 68
	var triangles: RefCounted = load("res://addons/hapticvlm/surface_triangles.gd").of(sphere, Vector3.ONE)
	while not triangles.is_ready:
		await get_tree().process_frame
	var times := PackedFloat64Array()
	var misses := 0
	for i in SEARCHES:
		var height := randf_range(-0.02, 0.02)
		var way := Vector3(randfn(0.0, 1.0), randfn(0.0, 1.0), randfn(0.0, 1.0)).normalized()
		var from := Time.get_ticks_usec()
		for n in REPEATS:  # because the clock of a page is coarse
			triangles.nearest((0.5 + height) * way)
		times.append(1e-3 * (Time.get_ticks_usec() - from) / REPEATS)
		if absf(sqrt(triangles.nearest_m2) - absf(height)) > 2e-3:
			misses += 1
		if i % 10 == 0:
			await get_tree().process_frame
	times.sort()
	var count: int = triangles.count_of(sphere.surface_get_arrays(0))
	var figures := {"quickest_tenth_ms": times[SEARCHES / 10], "median_ms": times[SEARCHES / 2]}
	say.call("searched", figures.merged({"triangles": count, "misses": misses}))


func _frames(count: int) -> void:
	for i in count:
		await get_tree().physics_frame


func _hear(decision: Dictionary) -> void:
	if str(decision.get("object_id", "")).contains("mesh2057757694"):
		_felt[int(decision.get("surface", 0))] = decision["material"]


## Panels side by side along x, each 2 cm wider than the one before.
func _panels() -> ArrayMesh:
	var mesh := ArrayMesh.new()
	for i in NAMES.size():
		var width := 0.4 + 0.02 * i
		var corners := PackedVector3Array()
		for corner: Vector2 in [Vector2(0, 0), Vector2(1, 1), Vector2(1, 0), Vector2(0, 0), Vector2(0, 1), Vector2(1, 1)]:
			corners.append(Vector3(i + width * corner.x, corner.y, 0.0))
		var arrays := []
		arrays.resize(Mesh.ARRAY_MAX)
		arrays[Mesh.ARRAY_VERTEX] = corners
		mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
		mesh.surface_set_material(i, _painted(NAMES[i]))
	return mesh


func _painted(name_given: String) -> StandardMaterial3D:
	var material := StandardMaterial3D.new()
	material.resource_name = name_given
	if name_given == "mat14":
		material.albedo_texture = ImageTexture.create_from_image(Image.create_empty(4, 4, false, Image.FORMAT_RGB8))
		material.albedo_texture.resource_name = "T_Felt_D"
	return material


func _on(panel: int) -> Vector3:
	return Vector3(panel + 0.2, 0.5, 0.0)
