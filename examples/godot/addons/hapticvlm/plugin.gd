@tool
extends EditorPlugin
## Adds the connection as the autoload `HapticVLM`, its settings, and *Project, Tools, Bake HapticVLM scene*.

const SceneBake := preload("scene_bake.gd")
const AUTOLOAD := "HapticVLM"
const TOOL := "Bake HapticVLM scene"


func _enter_tree() -> void:
	add_tool_menu_item(TOOL, _bake)


func _exit_tree() -> void:
	remove_tool_menu_item(TOOL)


func _enable_plugin() -> void:
	add_autoload_singleton(AUTOLOAD, "res://addons/hapticvlm/haptic_service.gd")
	_offer("hapticvlm/url", "", "Address of the service. Empty: this machine.")
	_offer("hapticvlm/mode", "auto", "auto: the service while it answers, else the bake; service; baked.")
	_offer("hapticvlm/bake", "res://baked", "Folder of your own bake. Without one the built-in materials are felt.")
	_offer("hapticvlm/command", "hapticvlm", "The program that bakes a scene in the editor, or its path.")


func _disable_plugin() -> void:
	remove_autoload_singleton(AUTOLOAD)


func _bake() -> void:
	var root := EditorInterface.get_edited_scene_root()
	if root == null:
		push_warning("HapticVLM: open the scene to be baked first")
		return
	var command: String = ProjectSettings.get_setting("hapticvlm/command", "hapticvlm")
	print("HapticVLM: ", SceneBake.bake(root, command, ProjectSettings.get_setting("hapticvlm/bake", "res://baked")))
	EditorInterface.get_resource_filesystem().scan()


func _offer(setting: String, value: Variant, hint: String) -> void:
	if not ProjectSettings.has_setting(setting):
		ProjectSettings.set_setting(setting, value)
	ProjectSettings.set_initial_value(setting, value)
	ProjectSettings.add_property_info({"name": setting, "type": typeof(value), "hint_string": hint})
