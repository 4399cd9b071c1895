extends RefCounted
## What the scene says of its objects, and what of that the service does not know yet.
##
## A new session of the service knows nothing and is told all. After that only what is new or gone
## is told: debris and bullets cost an id each, and not the whole scene.

const MOST_OBJECTS := 4096  # of one message

## Of the air in the scene, degC; NAN: not stated.
var ambient_c := NAN:
	set(value):
		ambient_c = value
		has_news = true
var has_news := false

var _objects := {}  # object id -> what the scene says of it
var _new := {}  # ids that the service has to be told of
var _gone := {}  # ids that it has to forget
var _is_unknown := true  # the service knows nothing of this scene


func add(object: Dictionary) -> void:
	var id: String = object["object_id"]
	if _objects.get(id) == object:
		return
	_objects[id] = object
	_new[id] = true
	_gone.erase(id)
	has_news = true


func forget(object_id: String) -> void:
	if not _objects.erase(object_id):
		return
	_new.erase(object_id)
	_gone[object_id] = true
	has_news = true


## The service knows nothing any more: a new session.
func begin_anew() -> void:
	_is_unknown = true
	has_news = true


## The fields of the `scene` messages that bring the service up to date; they count as sent.
func take_news() -> Array[Dictionary]:
	var objects: Array = _objects.values() if _is_unknown else _new_objects()
	var gone: Array = [] if _is_unknown else _gone.keys()
	var messages: Array[Dictionary] = [{"replace": _is_unknown, "objects": objects.slice(0, MOST_OBJECTS)}]
	if not is_nan(ambient_c):
		messages[0]["ambient_c"] = ambient_c
	for i in range(MOST_OBJECTS, objects.size(), MOST_OBJECTS):
		messages.append({"replace": false, "objects": objects.slice(i, i + MOST_OBJECTS)})
	for i in range(0, gone.size(), MOST_OBJECTS):
		if i > 0:
			messages.append({"replace": false, "objects": []})
		messages[-1]["forget"] = gone.slice(i, i + MOST_OBJECTS)
	_new.clear()
	_gone.clear()
	_is_unknown = false
	has_news = false
	return messages


func _new_objects() -> Array:
	return _new.keys().map(func(id: String) -> Dictionary: return _objects[id])
