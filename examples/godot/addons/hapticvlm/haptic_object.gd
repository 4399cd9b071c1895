@tool
class_name HapticObject
extends Node
## Makes its parent, a physics body or area, an object that hands can feel.
##
## Empty properties are not sent: the service then decides the material by name, shader or picture.

const ObjectSurfaces := preload("object_surfaces.gd")

## All objects, by their body.
static var by_body := {}
static var _by_id := {}

## The name from which the service derives the material; empty: the parent's name, with its own parents.
@export var label := ""
## A material of the service (wood, glass, steel ...); empty: the service decides.
@export var material := ""
@export_group("Temperature")
@export var states_temperature := false
@export_range(-100.0, 400.0, 0.1, "suffix:degC") var temperature_c := 22.0
@export_enum("Not stated", "In the sun", "In the shade") var sunlit := 0
@export_group("Vibrates by itself")
@export_enum("As its name says", "Yes", "No") var hums := 0
@export_range(15.0, 360.0, 0.1, "suffix:Hz") var hum_hz := 50.0
## Strength of the vibration in a hand on it.
@export_range(0.0, 1.0, 0.01) var hum_level := 0.3
## The bodies that carry it; its hum is also felt through them.
@export var stands_on: Array[NodePath] = []
@export_group("More")
## Thickness of a thin object in metres; 0: not stated.
@export_range(0.0, 10.0, 0.001, "suffix:m") var thickness_m := 0.0
## Whether pictures of it, and its textures, may be sent when its material is unknown.
@export var shows_pictures := true
## Its id for the service; empty: its path in the scene.
@export var object_id := ""

var _surfaces: ObjectSurfaces
var _original := ""  # id of the object that this one is a copy of, or its own


func _enter_tree() -> void:
	if Engine.is_editor_hint():
		return
	if object_id.is_empty():
		object_id = _shortened(str(get_parent().get_path()).trim_prefix("/root/"))
	var same: HapticObject = _by_id.get(object_id)
	if same != null:  # this was made by `duplicate`
		_original = same._original
		object_id = _shortened("%s~%d" % [_original, get_instance_id()])
	elif _original.is_empty():
		_original = object_id
	_by_id[object_id] = self
	by_body[get_parent()] = self
	say()


## Runs after the ids of all carriers are known.
func _ready() -> void:
	if not Engine.is_editor_hint() and not stands_on.is_empty():
		say()


func _exit_tree() -> void:
	if Engine.is_editor_hint():
		return
	by_body.erase(get_parent())
	_by_id.erase(object_id)
	if HapticService.current != null:
		HapticService.current.forget(object_id)


func _get_configuration_warnings() -> PackedStringArray:
	if get_parent() is CollisionObject3D:
		return []
	return ["Add this below a body with a collision shape: a StaticBody3D, a RigidBody3D ..."]


## Sends this object to the service again after a change of its properties.
func say() -> void:
	if HapticService.current != null:
		HapticService.current.add(described(get_tree().current_scene))


## Returns its visible meshes.
func meshes() -> Array[MeshInstance3D]:
	var found: Array[MeshInstance3D] = []
	for node: Node in get_parent().find_children("*", "MeshInstance3D", true, false):
		found.append(node)
	return found


## Returns the surface that a hand at this position touches, as an index into those sent; 0 is the largest.
func surface_at(position: Vector3) -> int:
	return 0 if _surfaces == null else _surfaces.at(position)


## Returns its description for a `scene` message; `scene` is the root of the scene that it is in.
func described(scene: Node) -> Dictionary:
	var path := HapticBake.path_of(get_parent(), scene) if _original in ["", object_id] else _original
	var object := {"object_id": id_in(scene), "name": path if label.is_empty() else label.left(256)}
	if not material.is_empty():
		object["material"] = material
	if states_temperature:
		object["temperature_c"] = temperature_c
	if thickness_m > 0.0:
		object["thickness_m"] = thickness_m
	if sunlit > 0:
		object["sunlit"] = sunlit == 1
	if hums > 0:
		object["vibrates"] = {"frequency_hz": hum_hz, "level": hum_level, "on": hums == 1}
	var carriers := _carriers(scene)
	if not carriers.is_empty():
		object["stands_on"] = carriers
	_surfaces = ObjectSurfaces.new(meshes())
	if not _surfaces.described.is_empty():
		var largest := _surfaces.described[0]
		if largest.has("shader"):
			object["shader"] = largest["shader"]
		object["surfaces"] = _surfaces.described
	if not shows_pictures:
		for surface in _surfaces.described:
			surface.erase("texture")
	return object


## Returns its id for the service; in the editor the one that it has when the scene runs as the main scene.
func id_in(scene: Node) -> String:
	if not object_id.is_empty():
		return object_id
	var path := str(scene.name)
	if get_parent() != scene:
		path = path.path_join(str(scene.get_path_to(get_parent())))
	return _shortened(path)


## Returns the ids of its carriers; the protocol allows 16.
func _carriers(scene: Node) -> Array[String]:
	var carriers: Array[String] = []
	for path in stands_on:
		var body := get_node_or_null(path)
		for carrier: HapticObject in body.find_children("*", "HapticObject", false, false) if body != null else []:
			if scene != null or not carrier.object_id.is_empty():
				carriers.append(carrier.id_in(scene))
	return carriers.slice(0, 16)


## Shortens a path to 128 characters. Paths are the same at every start, so cached decisions remain valid.
func _shortened(path: String) -> String:
	return path if path.to_utf8_buffer().size() <= 128 else path.sha256_text()
