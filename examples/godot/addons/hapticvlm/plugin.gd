@tool
extends EditorPlugin
## Adds the connection as the autoload `HapticVLM` and its settings to the project.

const AUTOLOAD := "HapticVLM"


func _enable_plugin() -> void:
	add_autoload_singleton(AUTOLOAD, "res://addons/hapticvlm/haptic_service.gd")
	_offer("hapticvlm/url", "", "Address of the service. Empty: this machine.")
	_offer("hapticvlm/mode", "auto", "auto: the service while it answers, else the bake; service; baked.")
	_offer("hapticvlm/bake", "res://baked", "Folder of your own bake. Without one the built-in materials are felt.")


func _disable_plugin() -> void:
	remove_autoload_singleton(AUTOLOAD)


func _offer(setting: String, value: Variant, hint: String) -> void:
	if not ProjectSettings.has_setting(setting):
		ProjectSettings.set_setting(setting, value)
	ProjectSettings.set_initial_value(setting, value)
	ProjectSettings.add_property_info({"name": setting, "type": typeof(value), "hint_string": hint})
