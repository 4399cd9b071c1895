extends RefCounted
## Checks the files of `hapticvlm bake` by their schemas, and unpacks the clips of a feel file (docs/player.md).

const FEEL := "res://addons/hapticvlm/feel_clips.schema.json"
const MATERIALS := "res://addons/hapticvlm/materials.schema.json"
const IMPACTS: Array[String] = ["tap", "strike", "press"]
const TEXTURES: Array[String] = ["slide", "carve", "swing"]
const AGAIN := "; bake it again"
const KINDS := {"object": TYPE_DICTIONARY, "array": TYPE_ARRAY, "string": TYPE_STRING}

static var _forms := {}  # path of a schema -> its Form


## Unpacks a parsed feel file in place, as a player needs it; samples stay bytes until they are played. Returns the first field
## that is wrong, and why; empty: none is.
static func unpack(file: Variant) -> String:
	var wrong := check(file, FEEL)
	if not wrong.is_empty():
		return wrong
	for clip: Dictionary in file.clips.values() + file.loops.values():
		clip.seconds = clip.wave.size() / clip.rate_hz
	wrong = _unfit(file)
	return wrong if wrong.is_empty() else wrong + AGAIN


## Returns the first field in which a parsed file is not as its schema has it, and why; empty: none is.
static func check(file: Variant, path: String) -> String:
	if not _forms.has(path):
		var schema: Variant = JSON.parse_string(FileAccess.get_file_as_string(path))
		if schema == null:
			return "%s is missing: add *.json to the export's filter of files that are not resources" % path
		_forms[path] = Form.new(schema, schema["$defs"])
	var wrong := _misfit(file, _forms[path], file)
	return "" if wrong.is_empty() else ("the file" + wrong if wrong.begins_with(":") else wrong.trim_prefix(".")) + AGAIN


## Checks what a schema cannot say.
static func _unfit(file: Dictionary) -> String:
	if not file.words.hand.has("left") or not file.words.hand.has("right"):
		return "words.hand: lacks left or right"
	if file.voice != "true":
		return "voice: is `%s`; the addon plays feel.true.json" % file.voice
	for name: String in file.materials:
		for kind in IMPACTS:
			var rates: Array = file.materials[name][kind].clips.map(func(clip: String) -> float: return file.clips[clip].rate_hz)
			if rates.min() != rates.max():
				return "materials.%s.%s.clips: have several rates" % [name, kind]
	return ""


## Checks a value, and all that it contains, by its form. Returns the rest of the field's name and why it is wrong, as
## `.wood.hz: is missing`.
static func _misfit(value: Variant, form: Form, file: Variant) -> String:
	var problem := form.problem(value, file)
	if not problem.is_empty():
		return ": " + problem
	if value is Array and form.has_numbers_only(value):
		return "" if not form.rises or range(1, value.size()).all(func(at: int) -> bool: return value[at - 1] < value[at]) else ": does not rise"
	if not (value is Dictionary or value is Array):
		return ""
	var parts: Dictionary[String, Form] = form.parts
	for key: Variant in range(value.size()) if value is Array else parts.keys() if parts else form.required + value.keys():
		if value is Dictionary and not value.has(key):
			if key in form.required:
				return ".%s: is missing" % key
			value[key] = parts[key].default
			continue
		var each: Variant = value[key]
		var of: Form = parts[key] if parts else form.others
		var is_fit: bool = each is float and each >= of.low and each <= of.high or each is String and each.length() >= of.shortest
		if is_fit or (each == null and of.is_optional):
			continue  # most are, and need no call
		var wrong := _misfit(each, of, file)
		if not wrong.is_empty():
			return ".%s%s" % [key, wrong]
		if of.is_base64:
			value[key] = Marshalls.base64_to_raw(each)
			if value[key].is_empty():
				return ".%s: is not base64" % key
	return ""


## A part of a schema, with what it refers to.
class Form:
	var is_optional := false
	var is_base64 := false
	var rises := false
	var default: Variant  # of what is not required
	var shortest := INF  # of texts of which nothing else is wanted
	var low := INF  # of numbers that need not be whole
	var high := -INF
	var required: Array
	var parts: Dictionary[String, Form]
	var others: Form  # of the entries of a list, or of a map
	var _schema: Dictionary
	var _kind: String
	var _type: int
	var _pattern: RegEx

	func _init(described: Dictionary, defs: Dictionary) -> void:
		is_optional = described.has("anyOf")
		default = described.get("default")
		_schema = described.anyOf[0] if is_optional else described
		if _schema.has("$ref"):
			_schema = defs[_schema["$ref"].get_file()]
		is_base64 = _schema.has("contentEncoding")
		rises = _schema.has("rises")
		_kind = _schema.type
		_type = KINDS.get(_kind, TYPE_FLOAT)
		required = _schema.get("required", [])
		for name: String in _schema.get("properties", {}):
			parts[name] = Form.new(_schema.properties[name], defs)
		var entries: Variant = _schema.prefixItems[0] if _schema.has("prefixItems") else _schema.get("items", _schema.get("additionalProperties"))
		if entries is Dictionary:
			others = Form.new(entries, defs)
		if _kind == "number":
			low = _schema.get("minimum", -1e9)
			high = _schema.get("maximum", 1e9)
		if _schema.has("pattern"):
			_pattern = RegEx.create_from_string(_schema.pattern)
		if _kind == "string" and not (_pattern or _schema.has("in") or is_base64):
			shortest = _schema.get("minLength", 0)

	## Returns whether a list, or each list of a table, has numbers within the limits only, without a look at each.
	func has_numbers_only(list: Array) -> bool:
		var cell := others
		var flat := list
		if cell.others != null and cell._kind == "array":
			cell = cell.others
			flat = []
			for row: Variant in list:
				if not (row is Array and row.size() == others._schema.get("maxItems", -1)):
					return false
				flat.append_array(row)
		if cell._kind != "number":
			return false
		var ends: Array = [flat.min(), flat.max()]
		return ends[0] is float and ends[1] is float and ends[0] >= cell.low and ends[1] <= cell.high

	## Returns what is wrong with a value itself; empty: nothing.
	func problem(value: Variant, file: Variant) -> String:
		if _type == TYPE_FLOAT and (value is float or value is int) and (_kind == "number" or value == floorf(value)):
			var limits := [_schema.get("minimum", -1e9), _schema.get("maximum", 1e9)]
			return "" if value >= limits[0] and value <= limits[1] else "%s is not %s to %s" % ([value] + limits)
		if typeof(value) != _type:
			return "is not of type " + _kind
		if value is Array and (value.size() < _schema.get("minItems", 0) or value.size() > _schema.get("maxItems", INF)):
			return "has %d entries" % value.size()
		if value is String and (value.length() < _schema.get("minLength", 0) or _pattern and not _pattern.search(value)):
			return "`%s` is not as the schema has it" % value
		if _schema.has("in") and not file[_schema["in"]].has(value):
			return "%s has no `%s`" % [_schema["in"], value]
		return ""
