extends RefCounted
## Spoils each value of a bake's files, one at a time, and returns what is then neither refused with its field nor harmless.

const FeelFile := preload("res://addons/hapticvlm/feel_file.gd")
const WRONG := [null, NAN, INF, -1.0, 0.0, 1e308, "", "x", [], {}, [null], ["x", 1.0], true]

var _file: Dictionary
var _refusal_of: Callable  # of a file, which it uses if there is none
var _broken := []


func _init(file: Dictionary, is_feel: bool) -> void:
	_file = file
	_refusal_of = _feel if is_feel else _materials
	for kind: String in ["clips", "materials"] if is_feel else []:
		for name: String in file[kind].keys().filter(func(name: String) -> bool: return not name.begins_with("wood")):
			file[kind].erase(name)


## Spoils a part: of each list and each map of clips the first and the last entry.
func spoil(part: Variant, path := "") -> Array:
	var keys: Array = part.keys() if part is Dictionary else range(part.size())
	if keys and (part is Array or path in [".clips", ".loops", ".levels"]):
		keys = [keys[0], keys[-1]]
	for key: Variant in keys:
		var right: Variant = part[key]
		var name := "%s.%s" % [path, key]
		for wrong: Variant in WRONG:
			part[key] = wrong
			_judge(name, wrong)
		if part is Dictionary:
			part.erase(key)
			_judge(name, "erased")
		part[key] = right
		if right is Array or right is Dictionary:
			spoil(right, name)
	return _broken


func _judge(name: String, wrong: Variant) -> void:
	var said: String = _refusal_of.call(_file.duplicate(true))
	var field := "." + said.get_slice(": ", 0)
	var is_named: bool = name.begins_with(field) or field.begins_with(name) or "has no `" in said or "several rates" in said
	if not said.is_empty() and not (is_named and said.ends_with("; bake it again")):
		_broken.append([name, str(wrong), said])


func _materials(file: Dictionary) -> String:
	var refusal := FeelFile.check(file, FeelFile.MATERIALS)
	if refusal.is_empty():
		HapticBake.new(file).find({"paths": ["floor.007"], "material": "Glaze", "primitive": 0})
	return refusal


func _feel(file: Dictionary) -> String:
	var refusal := FeelFile.unpack(file)
	if not refusal.is_empty():
		return refusal
	var wood := func(_touch: Dictionary) -> Dictionary: return {"material": "wood"}
	var players := [FeelPlayer.new(file, wood), FeelPlayer.new(file, wood, 8000.0)]
	var sum := 0.0
	for kind: String in ["press", "carve", "swing"]:
		for player: FeelPlayer in players:
			player.touch({"phase": "contact", "hand": "right", "interaction": kind, "speed_mps": 0.5, "force_n": 2.0}, 1.0)
		var plan: Dictionary = players[0].plan("right", "parametric", 1.01)
		for number: float in plan.amplitude + plan.frequency_hz + Array(players[1].render(80, 1.0)):
			sum += number
		players[0].touch({"phase": "release", "hand": "right"}, 1.02)
	return "" if is_finite(sum) else "is not finite"
