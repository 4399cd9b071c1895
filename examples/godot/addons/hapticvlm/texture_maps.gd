@tool
extends RefCounted
## The base-colour maps of surfaces, from which the service tells the materials that neither name nor shader tells.
##
## `name_of` gives the 32 digits that a surface states as its `texture`. The service asks for some of these maps; `step`
## sends them one after the other, each once, a few a second and none in the first frames of a scene. Maps are read back
## and encoded only then, beside the main thread where the build has threads.

const SIDE := 256  # px, the longest side that is sent
const EVERY_S := 0.3
const FIRST_FRAMES := 30  # in which the engine compiles shaders and loads the scene
const QUALITY := 0.92
const GROUND := Color(0.5, 0.5, 0.5)  # behind what is transparent

static var _maps := {}  # name -> weak reference to the texture

## Called with the name of a map and the fields of its `frame`; returns whether a surface still states it.
var send: Callable
## Number of maps that the engine could not read back or decode.
var unreadable := 0

var _wanted: Array[String] = []
var _frames := 0
var _sent_at := -INF
var _name := ""  # of the map that is being encoded; empty: none
var _task := -1
var _encoded := {}


## Returns the name of a map; empty for none, and for one whose picture changes.
##
## It is a hash of the resource and not of its pixels, since materials share textures by reference: to read all maps of a
## scene back from the graphics card would cost some milliseconds each. What the service keeps, it keeps by the bytes.
static func name_of(map: Texture2D) -> String:
	if map == null or map is ViewportTexture or map is CameraTexture:
		return ""
	var place := map.resource_path if not map.resource_path.is_empty() else str(map.get_instance_id())
	var name := place.md5_text()
	_maps[name] = weakref(map)
	return name


## Receives the names that the service asks for.
func want(names: Array) -> void:
	for name: String in names:
		if _maps.has(name) and not name in _wanted:
			_wanted.append(name)


## Forgets what was asked for: a new session asks again.
func clear() -> void:
	_wanted.clear()
	_name = ""
	_frames = 0


## Ends the encoding that is under way, before this object is freed.
func close() -> void:
	if _task >= 0:
		WorkerThreadPool.wait_for_task_completion(_task)
	_task = -1


## Sends one map, if it is time. Called once per frame.
func step(now: float) -> void:
	_frames += 1
	if _task >= 0:
		if WorkerThreadPool.is_task_completed(_task):
			close()
			_send()
	elif not _wanted.is_empty() and _frames > FIRST_FRAMES and now - _sent_at >= EVERY_S:
		_sent_at = now
		_read(_wanted.pop_front())


func _read(name: String) -> void:
	var map: Texture2D = _maps[name].get_ref()
	var image := map.get_image() if map != null else null
	if image == null or image.is_empty():
		unreadable += int(map != null)
		return
	_name = name
	_task = WorkerThreadPool.add_task(func() -> void: _encoded = _frame_of(image))


func _send() -> void:
	if _name.is_empty():
		return  # another session began
	if _encoded.is_empty():
		unreadable += 1
	else:
		send.call(_name, _encoded)
	_name = ""


## Returns the fields of a `frame` with this picture; none if it cannot be decoded.
static func _frame_of(image: Image) -> Dictionary:
	image = _smaller(image)
	if image.is_compressed() and image.decompress() != OK:
		return {}
	image.convert(Image.FORMAT_RGBA8)
	var share := minf(1.0, float(SIDE) / maxi(image.get_width(), image.get_height()))
	if share < 1.0:
		var width := maxi(1, roundi(share * image.get_width()))
		image.resize(width, maxi(1, roundi(share * image.get_height())), Image.INTERPOLATE_LANCZOS)
	var whole := Rect2i(Vector2i.ZERO, image.get_size())
	var drawn := Image.create_empty(whole.size.x, whole.size.y, false, Image.FORMAT_RGBA8)
	drawn.fill(GROUND)
	drawn.blend_rect(image, whole, Vector2i.ZERO)
	drawn.convert(Image.FORMAT_RGB8)
	return {
		"purpose": "texture",
		"format": "jpeg",
		"width": whole.size.x,
		"height": whole.size.y,
		"origin": "top",
		"image": drawn.save_jpg_to_buffer(QUALITY),
	}


## Returns the smallest mipmap that is not smaller than SIDE, so that a large compressed map is not decompressed whole.
static func _smaller(image: Image) -> Image:
	var level := 0
	var longest := maxi(image.get_width(), image.get_height())
	while level < image.get_mipmap_count() and longest >> (level + 1) >= SIDE:
		level += 1
	if level == 0:
		if image.has_mipmaps():
			image.clear_mipmaps()
		return image
	var data := image.get_data()
	var begin := image.get_mipmap_offset(level)
	var end := data.size()
	if level < image.get_mipmap_count():
		end = image.get_mipmap_offset(level + 1)
	var width := maxi(1, image.get_width() >> level)
	var height := maxi(1, image.get_height() >> level)
	return Image.create_from_data(width, height, false, image.get_format(), data.slice(begin, end))
