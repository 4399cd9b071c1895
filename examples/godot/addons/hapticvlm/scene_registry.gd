extends RefCounted
## The objects of the scene, and the changes that were not sent to the service yet.
##
## A new session of the service receives all objects. After that only added, changed and removed objects
## are sent, so that debris and bullets cost an id each and not the whole scene.

const MAX_OBJECTS := 1024  # per message; the protocol allows 4096
const MAX_BYTES := 1 << 19  # of text per message; the service accepts 1 MiB
const MAX_FORGOTTEN := 4096
const MAX_NAME := 256
const MAX_ID := 128
const MAX_ENTRIES := {"stands_on": 16, "surfaces": 64}

## Called with the object id, the path and a sentence for each part that was cut or left out.
var on_left_out: Callable
## Materials of the service; empty: not known yet.
var materials: Array = []

## Air temperature in the scene, degC; NAN: not stated.
var ambient_c := NAN:
	set(value):
		ambient_c = value
		has_changes = true
var has_changes := false

var _objects := {}  # object id -> its description
var _changed := {}  # ids of objects to send
var _removed := {}  # ids to remove
var _is_unknown := true  # the service does not know this scene


func add(described: Dictionary) -> void:
	var id := str(described.get("object_id", ""))
	if id.is_empty() or id.length() > MAX_ID:
		on_left_out.call(id.left(20), "object_id", "an id has 1 to %d characters: the object was left out" % MAX_ID)
		return
	var object := _fitted(id, described)
	if _objects.get(id) == object:
		return
	_objects[id] = object
	_changed[id] = true
	_removed.erase(id)
	has_changes = true


func forget(object_id: String) -> void:
	if not _objects.erase(object_id):
		return
	_changed.erase(object_id)
	_removed[object_id] = true
	has_changes = true


## Returns what an object states; empty: nothing.
func stated_of(object_id: String) -> Dictionary:
	return _objects.get(object_id, {})


## Returns {object_id, surface} of a surface that states this texture; empty if none does.
func surface_with(texture: String) -> Dictionary:
	for object_id: String in _objects:
		var surfaces: Array = _objects[object_id].get("surfaces", [])
		for i in surfaces.size():
			if surfaces[i].get("texture") == texture:
				return {"object_id": object_id, "surface": i}
	return {}


## Queues all objects for a new session.
func restart() -> void:
	_is_unknown = true
	has_changes = true


## Returns the fields of the `scene` messages with all changes, and marks them as sent.
func take_changes() -> Array[Dictionary]:
	var objects: Array = _objects.values() if _is_unknown else _changed_objects()
	var gone: Array = [] if _is_unknown else _removed.keys()
	var messages: Array[Dictionary] = []
	for piece: Array in _pieces(objects.map(_with_known_material)):
		messages.append({"replace": _is_unknown and messages.is_empty(), "objects": piece})
	if not is_nan(ambient_c):
		messages[0]["ambient_c"] = ambient_c
	for i in range(0, gone.size(), MAX_FORGOTTEN):
		if i > 0:
			messages.append({"replace": false, "objects": []})
		messages[-1]["forget"] = gone.slice(i, i + MAX_FORGOTTEN)
	_changed.clear()
	_removed.clear()
	_is_unknown = false
	has_changes = false
	return messages


func _changed_objects() -> Array:
	return _changed.keys().map(func(id: String) -> Dictionary: return _objects[id])


## Returns an object within the limits of the protocol. Control characters of texts would make the whole message invalid.
func _fitted(id: String, described: Dictionary) -> Dictionary:
	var object := described.duplicate()
	for key: String in object:
		if object[key] is String:
			object[key] = (object[key] as String).strip_escapes()
	var label := str(object.get("name", ""))
	if label.length() > MAX_NAME:
		object["name"] = label.right(MAX_NAME)  # its end is the object's own name, the rest its parents'
		var text := "it has %d characters and the limit is %d: cut; shorten it"
		on_left_out.call(id, "name", text % [label.length(), MAX_NAME])
	for key: String in MAX_ENTRIES:
		var entries: Variant = object.get(key)
		if entries is Array and entries.size() > MAX_ENTRIES[key]:
			object[key] = entries.slice(0, MAX_ENTRIES[key])
			var text := "it has %d entries and the limit is %d: cut; shorten it"
			on_left_out.call(id, key, text % [entries.size(), MAX_ENTRIES[key]])
	return object


## Leaves out a material that the service does not know; an older service refuses the whole scene for it.
func _with_known_material(object: Dictionary) -> Dictionary:
	var stated: Variant = object.get("material")
	if stated == null or materials.is_empty() or stated == "unknown" or stated in materials:
		return object
	var text := "no material `%s`: left out; state one of %s" % [stated, ", ".join(materials)]
	on_left_out.call(object["object_id"], "material", text)
	var known := object.duplicate()
	known.erase("material")
	return known


## Splits objects into pieces that a message may have: at least one, which may be empty.
func _pieces(objects: Array) -> Array[Array]:
	var all: Array[Array] = [[]]
	var bytes := 0
	for object: Dictionary in objects:
		var size := JSON.stringify(object).to_utf8_buffer().size()
		if all[-1].size() >= MAX_OBJECTS or (bytes > 0 and bytes + size > MAX_BYTES):
			all.append([])
			bytes = 0
		all[-1].append(object)
		bytes += size
	return all
