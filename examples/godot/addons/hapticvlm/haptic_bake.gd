class_name HapticBake
extends RefCounted
## Finds a node in a bake (`materials.json`), and tells how its surfaces feel.
##
## A thing is found by its id, else by the path of its names, else by its material's name. The bake has the paths as
## glTF and the engines spell them; an index decides only between surfaces of which nothing else is known.

const FeelFile := preload("feel_file.gd")
const AS_THE_SCENE := "scene"  # the spelling of engines that keep names

## Why the file is refused; empty: it is not.
var problem: String

var _objects := {}  # id -> its surfaces
var _named := {}  # an object's own name -> [names of its path, id, engine, engines that spell it otherwise]
var _of_material := {}  # a material's name -> {object_id, surface}


## Returns what the bake of the service in this scene says of a surface of a node: {material, ...}; empty: nothing.
static func of(node: Node, surface := 0) -> Dictionary:
	var bake: HapticBake = HapticService.current.felt.bake if HapticService.current != null else null
	return {} if bake == null else bake.surface_of(bake.find(query_of(node, surface)))


## Returns the query for a surface of a node.
static func query_of(node: Node, surface := 0) -> Dictionary:
	var query := {"paths": [path_of(node)], "surface": surface, "engine": "godot"}
	var body := node
	while body != null and not HapticObject.by_body.has(body):
		body = body.get_parent()
	if body != null:
		query["object_id"] = HapticObject.by_body[body].object_id
	var drawn := node as MeshInstance3D
	if drawn != null and drawn.mesh != null and surface < drawn.mesh.get_surface_count():
		var material := drawn.get_active_material(surface)
		query["material"] = "" if material == null else material.resource_name
		query["primitive"] = surface
	return query


## Returns the name of a node behind those of its parents. An instance that a script made has the name of its scene's root.
static func path_of(node: Node, top: Node = null, most := 256) -> String:
	var path := name_of(node).left(most)
	node = node.get_parent()
	while node != null and node != top and not node is Window and name_of(node).length() + 1 + path.length() <= most:
		path = name_of(node) + "/" + path
		node = node.get_parent()
	return path


## Returns the name of a node; that of its scene's root if it is only numbered: Cup2, @StaticBody3D@7.
static func name_of(node: Node) -> String:
	var own := str(node.name)
	if node.scene_file_path.is_empty():
		return own
	var scene := load(node.scene_file_path) as PackedScene
	var root := "" if scene == null else str(scene.get_state().get_node_name(0))
	var is_numbered := own.begins_with("@") or own.rstrip("0123456789") == root
	return root if is_numbered and not root.is_empty() else own


## Takes the parsed contents of `materials.json`. One that is refused has no objects.
func _init(file: Variant) -> void:
	problem = FeelFile.check(file, FeelFile.MATERIALS)
	if not problem.is_empty():
		push_error("HapticVLM: materials.json: ", problem)
		return
	for id: String in file["objects"]:
		var surfaces: Array = file["objects"][id]["surfaces"]
		_objects[id] = surfaces
		var paths: Dictionary = file["objects"][id].get("paths", {})
		for engine: String in paths:
			for path: String in paths[engine]:
				var names := path.split("/")
				_named.get_or_add(names[-1], []).append([names, id, engine, paths])
		for i in surfaces.size():
			for name in _names(surfaces[i].get("name")):
				_of_material.get_or_add(name, {"object_id": id, "surface": i})


## Returns {object_id, surface, by} of what is known of a thing: object_id?, paths?, material?, primitive?, surface?,
## engine?; empty: nothing of it is known.
func find(query: Dictionary) -> Dictionary:
	var id := _by_id(str(query.get("object_id", "")))
	var by := "path" if id.is_empty() else "id"
	if id.is_empty():
		id = _by_path(query)
	if not id.is_empty():
		return {"object_id": id, "surface": _surface(_objects[id], query), "by": by}
	for name in _names(query.get("material")):
		if _of_material.has(name):
			return _of_material[name].merged({"by": "material"})
	return {}


## Returns how a found surface feels: its material and what else the file says of it.
func surface_of(found: Dictionary) -> Dictionary:
	var surfaces: Array = _objects.get(found.get("object_id"), [])
	var at := whole(found.get("surface"), -1)
	return surfaces[at] if at >= 0 and at < surfaces.size() else {}


## Returns the id that is most like a name.
func nearest(name: String) -> String:
	var best := ""
	var most := -1.0
	for id: String in _objects:
		var share := _alike(_pairs(name), _pairs(id))
		if share > most:
			most = share
			best = id
	return best


## Returns the object with this id, or the one that an id `original~copy` is a copy of.
func _by_id(id: String) -> String:
	if _objects.has(id):
		return id
	var original := id.left(maxi(0, id.rfind("~")))
	return original if _objects.has(original) else ""


## Returns the object whose names agree farthest, from its own up to its parents'.
func _by_path(query: Dictionary) -> String:
	var engine: Variant = query.get("engine")
	var wanted := _names(query.get("material"))
	var paths: Variant = query.get("paths")
	for path: Variant in paths if paths is Array or paths is PackedStringArray else []:
		var names := str(path).split("/")
		var best := ""
		var most := -1
		var best_has := false
		for each: Array in _named.get(names[-1], []):
			var is_own: bool = each[2] == str(engine) or (each[2] == AS_THE_SCENE and not each[3].has(engine))
			var rank := 2 * _shared(names, each[0]) + int(is_own)
			var has: bool = _objects[each[1]].any(
				func(surface: Dictionary) -> bool: return _names(surface.name).any(func(name: String) -> bool: return name in wanted)
			)
			if rank > most or (rank == most and has and not best_has):
				most = rank
				best = each[1]
				best_has = has
		if not best.is_empty():
			return best
	return ""


## Returns the surface with this material's name, else this primitive, else this index, else 0.
static func _surface(surfaces: Array, query: Dictionary) -> int:
	var candidates := range(surfaces.size())
	for wanted in _names(query.get("material")):
		var named := candidates.filter(func(i: int) -> bool: return wanted in _names(surfaces[i].get("name")))
		if not named.is_empty():
			candidates = named
			break
	var primitive := whole(query.get("primitive"), -1)
	for i: int in candidates:
		if surfaces[i].get("primitives", []).any(func(each: float) -> bool: return int(each) == primitive):
			return i
	var index := whole(query.get("surface"), 0)
	return index if index in candidates else candidates[0]


## Returns a number without its fraction; `missing` for what is no number.
static func whole(value: Variant, missing: int) -> int:
	return int(value) if value is int or value is float else missing


## Returns a material's name as a whole, and without that of its texture's file before it.
static func _names(name: Variant) -> Array[String]:
	var whole := "" if name == null else str(name)
	var last := whole.substr(whole.rfind("/") + 1)
	var names: Array[String] = []
	for each: String in [whole, last]:
		if not each.is_empty() and not each in names:
			names.append(each)
	return names


static func _shared(names: PackedStringArray, others: PackedStringArray) -> int:
	var count := 0
	while count < mini(names.size(), others.size()) and names[-1 - count] == others[-1 - count]:
		count += 1
	return count


static func _pairs(text: String) -> Dictionary:
	var pairs := {}
	for i in maxi(0, text.length() - 1):
		pairs[text.to_lower().substr(i, 2)] = true
	return pairs


static func _alike(pairs: Dictionary, others: Dictionary) -> float:
	var both := pairs.keys().filter(func(pair: String) -> bool: return others.has(pair)).size()
	return 2.0 * both / maxi(1, pairs.size() + others.size())
