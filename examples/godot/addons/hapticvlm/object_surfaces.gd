@tool
extends RefCounted
## The surfaces of one object, the largest first, and the one that a hand touches.
##
## The surfaces of all its meshes are those of the object; surfaces with the same material are one. A touch is on
## the surface of the triangle nearest to the hand.

const SurfaceTriangles := preload("surface_triangles.gd")
const TextureMaps := preload("texture_maps.gd")
const MAX_SURFACES := 64  # limit of the protocol
const MAX_NAME := 256

## Names of the parameter of a ShaderMaterial that has the base colour.
const BASE_MAPS: Array[String] = ["texture_albedo", "albedo_texture", "base_color_texture"]

static var _warned := {}  # ids of meshes

## The description of each surface: {name?, shader?, texture?}, the largest first.
var described: Array[Dictionary] = []

var _parts: Array[Part] = []
var _size_of := {}  # material (or the name of a surface without one) -> size
var _index_of := {}  # the same -> its index in `described`


## One mesh, with its triangles and the material of each of its surfaces.
class Part:
	var instance: MeshInstance3D
	var triangles: SurfaceTriangles
	var keys: Array = []


func _init(meshes: Array[MeshInstance3D]) -> void:
	var names := {}
	for instance in meshes:
		if instance.mesh == null or not instance.visible or instance.visibility_range_begin > 0.0:
			continue  # hidden, or a lower level of detail
		var part := Part.new()
		part.instance = instance
		for i in instance.mesh.get_surface_count():
			var name := _name_of(instance, i)
			var material := instance.get_active_material(i)
			part.keys.append(name if material == null else material)
			names[part.keys[i]] = name
			_size_of[part.keys[i]] = 0.0
		_parts.append(part)
	if names.size() > 1:
		_measure()
	var keys := _size_of.keys()
	keys.sort_custom(func(a: Variant, b: Variant) -> bool: return _size_of[a] > _size_of[b])
	for key: Variant in keys.slice(0, MAX_SURFACES):
		_index_of[key] = described.size()
		described.append(_described(key, names[key]))


## Returns the surface that a hand at this position touches, as an index; 0 if it is not known.
func at(position: Vector3) -> int:
	var least_m2 := INF
	var index := 0
	for part in _parts:
		if part.triangles == null or not is_instance_valid(part.instance):
			continue
		var place := part.instance.global_transform
		var local := place.basis.orthonormalized().inverse() * (position - place.origin)
		var surface := part.triangles.nearest(local, least_m2)
		if surface >= 0:
			least_m2 = part.triangles.nearest_m2
			index = _index_of.get(part.keys[surface], 0)
	return index


## Adds up the areas of the surfaces; the numbers of triangles if one mesh cannot be searched.
func _measure() -> void:
	var all: Array = _parts.map(_searchable)
	for i in _parts.size():
		var part := _parts[i]
		for surface in part.keys.size():
			var size := 0.0
			if all.has(null):
				size = SurfaceTriangles.count_of(part.instance.mesh.surface_get_arrays(surface))
			else:
				part.triangles = all[i]
				size = part.triangles.areas[surface]
			_size_of[part.keys[surface]] += size


## Returns the triangles of a mesh; null, with a warning, if it cannot be searched.
func _searchable(part: Part) -> SurfaceTriangles:
	if part.instance.skin != null:
		return _unsearchable(part, "it is skinned")
	var triangles: SurfaceTriangles = SurfaceTriangles.of(part.instance.mesh, _place_of(part.instance).basis.get_scale())
	if triangles.areas.is_empty():
		return _unsearchable(part, "it has more than %d triangles: split it" % SurfaceTriangles.MAX_TRIANGLES)
	return triangles


## Returns the place of a node in the world, also before it is in the tree.
static func _place_of(node: Node3D) -> Transform3D:
	if node.is_inside_tree():
		return node.global_transform
	var parent := node.get_parent() as Node3D
	return node.transform if parent == null else _place_of(parent) * node.transform


func _unsearchable(part: Part, reason: String) -> SurfaceTriangles:
	if not _warned.has(part.instance.mesh.get_instance_id()):
		_warned[part.instance.mesh.get_instance_id()] = true
		push_warning(
			"HapticVLM: a touch feels the largest surface of the mesh of %s only, because %s" % [part.instance.name, reason]
		)
	return null


static func _described(key: Variant, name: String) -> Dictionary:
	var surface := {}
	if not name.is_empty():
		surface["name"] = name
	var material: Material = key if key is Material else null  # a mesh without one has a name: `as` does not cast it
	var drawn := material as BaseMaterial3D
	if drawn != null:
		var color := drawn.albedo_color.clamp()
		surface["shader"] = {
			"metallic": clampf(drawn.metallic, 0.0, 1.0),
			"roughness": clampf(drawn.roughness, 0.0, 1.0),
			"base_color": [color.r, color.g, color.b],
		}
		if drawn.transparency == BaseMaterial3D.TRANSPARENCY_ALPHA:
			surface["shader"]["opacity"] = color.a
	var texture := TextureMaps.name_of(_base_map(material))
	if not texture.is_empty():
		surface["texture"] = texture
	return surface


## Returns the name of a material behind that of its base colour map, which is read if the material's says nothing.
static func _name_of(instance: MeshInstance3D, surface: int) -> String:
	var material := instance.get_active_material(surface)
	var name := _title(material)
	if name.is_empty() and instance.mesh is ArrayMesh:
		name = (instance.mesh as ArrayMesh).surface_get_name(surface)
	var map := _title(_base_map(material))
	var both := "/".join([map, name].filter(func(part: String) -> bool: return not part.is_empty()))
	return both if both.length() <= MAX_NAME else name.left(MAX_NAME)


static func _base_map(material: Material) -> Texture2D:
	if material is BaseMaterial3D:
		return (material as BaseMaterial3D).albedo_texture
	if material is ShaderMaterial:
		for parameter in BASE_MAPS:
			var map := (material as ShaderMaterial).get_shader_parameter(parameter) as Texture2D
			if map != null:
				return map
	return null


## Returns the name of a resource, else that of its file; empty if it has neither.
static func _title(resource: Resource) -> String:
	if resource == null:
		return ""
	if not resource.resource_name.is_empty() or "::" in resource.resource_path:
		return resource.resource_name
	return resource.resource_path.get_file().get_basename()
