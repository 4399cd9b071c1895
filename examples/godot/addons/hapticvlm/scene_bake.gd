@tool
extends RefCounted
## Bakes the feel of a scene in the editor: writes its `scene` message to a file and runs `hapticvlm bake` on it.
##
## Corrections by hand in `materials.json` survive the next bake, since the command keeps them.

const SCENE := "scene.json"


## Returns the `scene` message of all objects below the root of a scene, with the ids that they have when it runs.
static func message_of(root: Node) -> Dictionary:
	var objects: Array[Dictionary] = []
	for object: HapticObject in root.find_children("*", "HapticObject", true, false):
		var described := object.described(root).duplicate(true)
		for surface: Dictionary in described.get("surfaces", []):
			surface.erase("texture")  # the file has no pictures
		objects.append(described)
	return {"type": "scene", "id": 1, "replace": true, "objects": objects}


## Writes the bake of a scene into a folder of the project; returns a sentence that says what happened. The editor waits
## for the command, some seconds.
static func bake(root: Node, command: String, folder: String) -> String:
	var message := message_of(root)
	if message["objects"].is_empty():
		return "%s has no HapticObject: add one below each body that can be touched" % root.name
	DirAccess.make_dir_recursive_absolute(folder)
	var path := folder.path_join(SCENE)
	var file := FileAccess.open(path, FileAccess.WRITE)
	if file == null:
		return "%s cannot be written: %s" % [path, error_string(FileAccess.get_open_error())]
	file.store_string(JSON.stringify(message, "\t", true, true))
	file.close()
	var output := []
	var arguments := ["bake", ProjectSettings.globalize_path(path), "-o", ProjectSettings.globalize_path(folder)]
	var code := OS.execute(command, arguments, output, true)
	var said := str(output[0]).strip_edges() if not output.is_empty() else ""
	if code < 0 or said.is_empty() and code != 0:
		return "`%s` cannot be run: install hapticvlm, or set the project setting hapticvlm/command to its path" % command
	return said
