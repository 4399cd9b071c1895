extends RefCounted
## Opens a feel file of `hapticvlm bake` (docs/player.md): checks it by its schema, and unpacks its clips.

const SCHEMA := "res://addons/hapticvlm/feel_clips.schema.json"
const IMPACTS: Array[String] = ["tap", "strike", "press"]
const TEXTURES: Array[String] = ["slide", "carve", "swing"]
const KINDS := {"object": TYPE_DICTIONARY, "array": TYPE_ARRAY, "string": TYPE_STRING}

static var _schema := {}


## Unpacks a parsed file in place, as a player needs it. Returns the first field that is wrong, and why; empty: none is.
static func unpack(file: Variant) -> String:
	if _schema.is_empty():
		var schema: Variant = JSON.parse_string(FileAccess.get_file_as_string(SCHEMA))
		if schema == null:
			return "%s is missing: add *.json to the export's filter of files that are not resources" % SCHEMA
		_schema = schema
	var wrong := _misfit(file, _schema)
	if wrong.is_empty():
		wrong = _unfit(file)
	if wrong.is_empty():
		wrong = _unpack_clips(file)
	if not wrong.is_empty():
		return "%s%s; bake it again" % ["the file" if wrong.begins_with(":") else "", wrong.trim_prefix(".")]
	return ""


## Unpacks clips and loops; samples stay bytes until they are played. Returns the first text that is not base64.
static func _unpack_clips(file: Dictionary) -> String:
	for kind: String in ["clips", "loops"]:
		for name: String in file[kind]:
			var clip: Dictionary = file[kind][name]
			for track: Variant in clip.keys():
				var of: Dictionary = clip[track] if clip[track] is Dictionary else clip
				var key: String = track if of == clip else "bytes"
				if of[key] is String:
					of[key] = Marshalls.base64_to_raw(of[key])
					if of[key].is_empty():
						return "%s.%s.%s: is not base64" % [kind, name, track if of == clip else track + ".bytes"]
			clip.seconds = clip.wave.size() / clip.rate_hz
	return ""


## Checks what a schema cannot say.
static func _unfit(file: Dictionary) -> String:
	for axis: Array in [["speeds_mps", file.speeds_mps], ["forces_n", file.forces_n], ["rules.pad.hum_hz", file.rules.pad.hum_hz]]:
		for at in range(1, axis[1].size()):
			if axis[1][at] <= axis[1][at - 1]:
				return "%s: does not rise" % axis[0]
	if file.voice != "true":
		return "voice: is `%s`; the addon plays feel.true.json" % file.voice
	for name: String in file.materials:
		var facts: Dictionary = file.materials[name]
		if facts.swing.thickness_m == null:
			return "materials.%s.swing.thickness_m: is null" % name
		var named := [["clips", facts.grain], ["clips", facts.again]]
		for kind in IMPACTS:
			named += facts[kind].clips.map(func(clip: String) -> Array: return ["clips", clip])
		for kind in TEXTURES:
			for layer: Dictionary in facts[kind].layers:
				named += [["loops", layer.loop], ["levels", layer.level]]
			if facts[kind].breaks != null:
				named.append(["levels", facts[kind].breaks.level])
		for each: Array in named:
			if not file[each[0]].has(each[1]):
				return "materials.%s: %s has no `%s`" % [name, each[0], each[1]]
		for kind in IMPACTS:
			var rates: Array = facts[kind].clips.map(func(clip: String) -> float: return file.clips[clip].rate_hz)
			if rates.min() != rates.max():
				return "materials.%s.%s.clips: have several rates" % [name, kind]
	return ""


## Checks a value, and all that it contains, by the part of the schema that describes it. Returns the rest of the field's name
## and why it is wrong, as `.wood.hz: is missing`.
static func _misfit(value: Variant, described: Dictionary) -> String:
	var schema := described
	if schema.has("anyOf"):
		if value == null:
			return ""
		schema = schema.anyOf[0]
	if schema.has("$ref"):
		schema = _schema["$defs"][schema["$ref"].get_file()]
	var kind: String = schema.type
	if not KINDS.has(kind):
		if not (value is float or value is int) or (kind == "integer" and value != floorf(value)):
			return ": is not of type %s" % kind
		var low: float = schema.get("minimum", -1e9)
		var high: float = schema.get("maximum", 1e9)
		return "" if value >= low and value <= high else ": %s is not %s to %s" % [value, low, high]
	if typeof(value) != KINDS[kind]:
		return ": is not of type %s" % kind
	if kind == "string":
		var is_word: bool = not schema.has("pattern") or RegEx.create_from_string(schema.pattern).search(value) != null
		return "" if is_word and value.length() >= schema.get("minLength", 0) else ": `%s` is not as the schema has it" % value
	var others: Variant = schema.get("items", schema.get("additionalProperties"))
	var parts: Dictionary = schema.get("properties", {})
	var keys: Array = parts.keys() if parts else schema.get("required", []) + value.keys() if kind == "object" else range(value.size())
	if kind == "array":
		if value.size() < schema.get("minItems", 0) or value.size() > schema.get("maxItems", INF):
			return ": has %d entries" % value.size()
		if others is bool:  # a list of two
			others = schema.prefixItems[0]
		elif others.has("minimum") and _are_numbers(value, others):
			return ""
	for key: Variant in keys:
		var is_missing: bool = kind == "object" and not value.has(key)
		var wrong := ": is missing" if is_missing else _misfit(value[key], parts.get(key, others))
		if not wrong.is_empty():
			return ".%s%s" % [key, wrong]
	return ""


## Returns whether a list has numbers within the limits only, without a look at each.
static func _are_numbers(list: Array, schema: Dictionary) -> bool:
	var least: Variant = list.min()
	var most: Variant = list.max()
	return least is float and most is float and least >= schema.minimum and most <= schema.maximum
