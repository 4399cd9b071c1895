@tool
extends RefCounted
## The triangles of one mesh, each with its surface, and the search for the one nearest to a point.
##
## The triangles are sorted along a Morton curve, so that neighbours in the list are neighbours in space.
## Each node of a binary tree has the box around a run of them, each leaf that of one triangle. A search
## visits the nearer box first and omits boxes that are farther than the nearest triangle so far. The
## tree is built over several frames.
## Objects that draw the same mesh at the same scale share one instance.

const MAX_TRIANGLES := 65_536  # of one mesh; our choice
const CELLS := 1024  # per axis of the Morton curve; 3 x 10 bits
const STEPS_PER_FRAME := 1000  # about a millisecond
const NOWHERE := Vector3(INF, INF, INF)

static var _kept := {}  # [id of a mesh, scale] -> weak reference to its triangles
static var _spread := _spread_bits()

## Area of each surface, m2; empty if the mesh has too many triangles.
var areas := PackedFloat64Array()
## Whether the tree is built.
var is_ready := false
## Squared distance of the last search, m2.
var nearest_m2 := INF

var _corners := PackedVector3Array()  # 3 of each triangle, m
var _surfaces := PackedInt32Array()  # of each triangle
var _low := PackedVector3Array()  # box of each node; the children of node i are 2i+1 and 2i+2
var _high := PackedVector3Array()
var _first_leaf := 0


## Returns the triangles of a mesh at this scale, with areas and a search if it has at most MAX_TRIANGLES.
static func of(mesh: Mesh, scale: Vector3) -> RefCounted:
	var key := [mesh.get_instance_id(), scale.snapped(0.001 * Vector3.ONE)]
	var kept: WeakRef = _kept.get(key)
	var triangles: RefCounted = kept.get_ref() if kept != null else null
	if triangles == null:
		triangles = new(mesh, scale)
		_forget_freed()
		_kept[key] = weakref(triangles)
	return triangles


## Returns the number of triangles of a surface; 0 for no arrays.
static func count_of(arrays: Array) -> int:
	if arrays.is_empty():
		return 0
	var indices: Variant = arrays[Mesh.ARRAY_INDEX]
	var points: PackedVector3Array = arrays[Mesh.ARRAY_VERTEX]
	return (points.size() if indices == null else (indices as PackedInt32Array).size()) / 3


func _init(mesh: Mesh, scale: Vector3) -> void:
	var arrays: Array[Array] = []
	var count := 0
	for i in mesh.get_surface_count():
		arrays.append(mesh.surface_get_arrays(i) if _has_triangles(mesh, i) else [])
		count += count_of(arrays[i])
	if count > MAX_TRIANGLES:
		return
	for i in arrays.size():
		areas.append(0.0 if arrays[i].is_empty() else _add(arrays[i], i, scale))
	if not _surfaces.is_empty():
		_build()


## Returns the surface nearest to a point, if it is nearer than the square root of `least_m2`; else -1.
## The point is in the frame of the mesh, in metres.
func nearest(point: Vector3, least_m2 := INF) -> int:
	nearest_m2 = least_m2
	if not is_ready:
		return -1
	var found := -1
	var waiting: Array[int] = [0]
	while not waiting.is_empty():
		var node: int = waiting.pop_back()
		if point.distance_squared_to(point.clamp(_low[node], _high[node])) >= nearest_m2:
			continue
		while node < _first_leaf:
			var near := 2 * node + 1
			var far := near + 1
			var near_m2 := point.distance_squared_to(point.clamp(_low[near], _high[near]))
			var far_m2 := point.distance_squared_to(point.clamp(_low[far], _high[far]))
			if far_m2 < near_m2:
				node = far
				far = near
				far_m2 = near_m2
			else:
				node = near
			if far_m2 < nearest_m2:
				waiting.append(far)
		var i := node - _first_leaf
		if i >= _surfaces.size():
			continue
		var corner := _nearest_point(point, _corners[3 * i], _corners[3 * i + 1], _corners[3 * i + 2])
		var distance_m2 := point.distance_squared_to(corner)
		if distance_m2 < nearest_m2:
			nearest_m2 = distance_m2
			found = i
	return -1 if found < 0 else _surfaces[found]


static func _has_triangles(mesh: Mesh, surface: int) -> bool:
	var drawn := mesh as ArrayMesh
	return drawn == null or drawn.surface_get_primitive_type(surface) == Mesh.PRIMITIVE_TRIANGLES


## Adds the triangles of a surface and returns their area.
func _add(arrays: Array, surface: int, scale: Vector3) -> float:
	var points: PackedVector3Array = arrays[Mesh.ARRAY_VERTEX]
	var indices := PackedInt32Array()
	if arrays[Mesh.ARRAY_INDEX] == null:
		indices = PackedInt32Array(range(points.size()))
	else:
		indices = arrays[Mesh.ARRAY_INDEX]
	var area := 0.0
	for i in range(0, indices.size() - 2, 3):
		var a := points[indices[i]] * scale
		var b := points[indices[i + 1]] * scale
		var c := points[indices[i + 2]] * scale
		_corners.append(a)
		_corners.append(b)
		_corners.append(c)
		_surfaces.append(surface)
		area += 0.5 * (b - a).cross(c - a).length()
	return area


func _build() -> void:
	var kept := self  # a suspended coroutine does not keep its object, but its variables
	var tree := Engine.get_main_loop() as SceneTree
	var order := PackedInt64Array()
	var bounds := AABB(_corners[0], Vector3.ZERO)
	for corner in _corners:
		bounds = bounds.expand(corner)
	var cell := Vector3.ONE * (CELLS - 1) / bounds.size.max(Vector3.ONE * 1e-9) / 3.0
	for i in _surfaces.size():
		if i % STEPS_PER_FRAME == STEPS_PER_FRAME - 1:
			await tree.process_frame
		var middle := (_corners[3 * i] + _corners[3 * i + 1] + _corners[3 * i + 2] - 3.0 * bounds.position) * cell
		var key := _spread[int(middle.x)] | _spread[int(middle.y)] << 1 | _spread[int(middle.z)] << 2
		order.append(key << 32 | i)
	order.sort()
	await _reorder(order)
	await _enclose()
	kept.is_ready = true


func _reorder(order: PackedInt64Array) -> void:
	var tree := Engine.get_main_loop() as SceneTree
	var corners := PackedVector3Array()
	var surfaces := PackedInt32Array()
	for key in order:
		if surfaces.size() % STEPS_PER_FRAME == STEPS_PER_FRAME - 1:
			await tree.process_frame
		var i := key & 0xFFFFFFFF
		corners.append(_corners[3 * i])
		corners.append(_corners[3 * i + 1])
		corners.append(_corners[3 * i + 2])
		surfaces.append(_surfaces[i])
	_corners = corners
	_surfaces = surfaces


## Sets the boxes of the leaves, each around one triangle, then those of the nodes above them.
func _enclose() -> void:
	var tree := Engine.get_main_loop() as SceneTree
	var leaves := nearest_po2(_surfaces.size())
	_first_leaf = leaves - 1
	_low.resize(2 * leaves - 1)
	_high.resize(2 * leaves - 1)
	_low.fill(NOWHERE)
	_high.fill(-NOWHERE)
	for i in _corners.size():
		if i % STEPS_PER_FRAME == STEPS_PER_FRAME - 1:
			await tree.process_frame
		var leaf := _first_leaf + i / 3
		_low[leaf] = _low[leaf].min(_corners[i])
		_high[leaf] = _high[leaf].max(_corners[i])
	for node in range(_first_leaf - 1, -1, -1):
		_low[node] = _low[2 * node + 1].min(_low[2 * node + 2])
		_high[node] = _high[2 * node + 1].max(_high[2 * node + 2])


## Returns the point of a triangle nearest to p, by the region of its plane that p lies over
## (Ericson, Real-Time Collision Detection, 5.1.5).
static func _nearest_point(p: Vector3, a: Vector3, b: Vector3, c: Vector3) -> Vector3:
	var ab := b - a
	var ac := c - a
	var d1 := ab.dot(p - a)
	var d2 := ac.dot(p - a)
	if d1 <= 0.0 and d2 <= 0.0:
		return a
	var d3 := ab.dot(p - b)
	var d4 := ac.dot(p - b)
	if d3 >= 0.0 and d4 <= d3:
		return b
	var over_c := d1 * d4 - d3 * d2
	if over_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
		return a + ab * (d1 / (d1 - d3))
	var d5 := ab.dot(p - c)
	var d6 := ac.dot(p - c)
	if d6 >= 0.0 and d5 <= d6:
		return c
	var over_b := d5 * d2 - d1 * d6
	if over_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
		return a + ac * (d2 / (d2 - d6))
	var over_a := d3 * d6 - d5 * d4
	if over_a <= 0.0 and d4 >= d3 and d5 >= d6:
		return b + (c - b) * ((d4 - d3) / (d4 - d3 + d5 - d6))
	return a + (ab * over_b + ac * over_c) / (over_a + over_b + over_c)


## Returns the ten bits of each cell's number, spread to every third bit.
static func _spread_bits() -> PackedInt32Array:
	var spread := PackedInt32Array()
	for cell in CELLS:
		var bits := 0
		for bit in 10:
			bits |= (cell >> bit & 1) << (3 * bit)
		spread.append(bits)
	return spread


static func _forget_freed() -> void:
	for key: Array in _kept.keys():
		if (_kept[key] as WeakRef).get_ref() == null:
			_kept.erase(key)
