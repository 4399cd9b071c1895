extends RefCounted
## The objects of the scene, and the changes that were not sent to the service yet.
##
## A new session of the service receives all objects. After that only added, changed and removed objects
## are sent, so that debris and bullets cost an id each and not the whole scene.

const MAX_OBJECTS := 4096  # per message

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


func add(object: Dictionary) -> void:
	var id: String = object["object_id"]
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


## Queues all objects for a new session.
func restart() -> void:
	_is_unknown = true
	has_changes = true


## Returns the fields of the `scene` messages with all changes, and marks them as sent.
func take_changes() -> Array[Dictionary]:
	var objects: Array = _objects.values() if _is_unknown else _changed_objects()
	var gone: Array = [] if _is_unknown else _removed.keys()
	var messages: Array[Dictionary] = [{"replace": _is_unknown, "objects": objects.slice(0, MAX_OBJECTS)}]
	if not is_nan(ambient_c):
		messages[0]["ambient_c"] = ambient_c
	for i in range(MAX_OBJECTS, objects.size(), MAX_OBJECTS):
		messages.append({"replace": false, "objects": objects.slice(i, i + MAX_OBJECTS)})
	for i in range(0, gone.size(), MAX_OBJECTS):
		if i > 0:
			messages.append({"replace": false, "objects": []})
		messages[-1]["forget"] = gone.slice(i, i + MAX_OBJECTS)
	_changed.clear()
	_removed.clear()
	_is_unknown = false
	has_changes = false
	return messages


func _changed_objects() -> Array:
	return _changed.keys().map(func(id: String) -> Dictionary: return _objects[id])
