extends Node
## What the tests see of a running scene: one line of JSON for each thing that happens.
##
## An autoload of the test's pack alone; the sample knows nothing of it.

const EVERY_S := 0.2

var _said_at := 0.0
var _pressed := 0
var _cases := 0
var _vibrations := 0
var _strongest := 0.0
var _service: HapticService
var _hand: HapticHand


func _ready() -> void:
	_service = HapticService.current
	_service.opened.connect(func(_w: Dictionary) -> void: _say("opened", _places()))
	_service.decided.connect(func(decision: Dictionary) -> void: _say("decided", decision))
	_service.left_out.connect(func(part: Dictionary) -> void: _say("left_out", part))
	_service.refused.connect(func(error: Dictionary) -> void: _say("refused", error))
	_service.vibrated.connect(_count)
	await get_tree().process_frame
	_hand = get_tree().get_first_node_in_group("haptic_hands")
	_hand.touched.connect(
		func(object: HapticObject) -> void: _say("touched", {"id": object.object_id})
	)
	_hand.released.connect(func() -> void: _say("released", {}))


func _process(_delta: float) -> void:
	if HapticService.now_s() - _said_at < EVERY_S:
		return
	_said_at = HapticService.now_s()
	var pulses: HapticPulses = _hand.get_node("Pulses")
	var camera: HapticCamera = get_tree().current_scene.get_node("HapticCamera")
	_say(
		"state",
		{
			"is_open": _service.is_open(),
			"is_owner": _service.is_owner,
			"silence": _service.silence(),
			"by": _service.by,
			"because": _service.baked_because(),
			"lost": _service.lost,
			"vibrations": _vibrations,
			"strongest": _strongest,
			"pulses": pulses.pulses,
			"pictures": camera.taken,
			"frames_per_s": Engine.get_frames_per_second(),
		}
	)


## The tests' hand on the scene: D brings a copy of the ball for a moment; F takes the ball away, as a game does with what breaks; R brings a rifle, M a room
## of one mesh with 20 materials, T a thing whose textures tell what it is; B changes to the bake and back;
## K says the message that the editor bakes.
func _unhandled_key_input(event: InputEvent) -> void:
	if not event.is_pressed():
		return
	if (event as InputEventKey).keycode == KEY_C:
		_next_case()
	if (event as InputEventKey).keycode == KEY_D:
		var copy := get_tree().current_scene.get_node("RubberBall").duplicate()
		get_tree().current_scene.add_child(copy)
		get_tree().create_timer(0.5).timeout.connect(copy.queue_free)
	if (event as InputEventKey).keycode == KEY_F:
		get_tree().current_scene.get_node("RubberBall").queue_free()
	if (event as InputEventKey).keycode == KEY_R:
		var rifle := _named(Node3D.new(), "Rifle")
		var magazine := _named(StaticBody3D.new(), "Magazine")
		magazine.add_child(HapticObject.new())
		rifle.add_child(magazine)
		get_tree().current_scene.add_child(rifle)
	if (event as InputEventKey).keycode == KEY_B:
		_service.mode = "baked" if _service.mode == "auto" else "auto"
	if (event as InputEventKey).keycode == KEY_K:
		_say("to bake", load("res://addons/hapticvlm/scene_bake.gd").message_of(get_tree().current_scene))
	if (event as InputEventKey).keycode == KEY_T:
		_textured()
	if (event as InputEventKey).keycode == KEY_M:
		var room: Node3D = load("res://room.gd").new()
		room.set("say", _say)
		get_tree().current_scene.add_child(room)


func _named(node: Node, name_given: String) -> Node:
	node.name = name_given
	return node


## Brings a body of three materials with textures, of which the second tells what it is by its name; then says it again.
func _textured() -> void:
	var known := get_tree().current_scene.get_node_or_null("mesh2057757695/HapticObject")
	if known != null:
		known.label = "mesh2057757696"
		known.say()
		return
	var body := _named(StaticBody3D.new(), "mesh2057757695")
	var size := 3.0
	for one: Array in [["mat14", "planks"], ["Oak_Floor", "weave"], ["mat15", "weave"]]:
		var image := Image.new()
		image.load_png_from_buffer(FileAccess.get_file_as_bytes("res://%s.png" % one[1]))
		image.generate_mipmaps()
		var material := StandardMaterial3D.new()
		material.resource_name = one[0]
		material.albedo_texture = ImageTexture.create_from_image(image)
		var box := BoxMesh.new()
		box.size = size * Vector3.ONE
		box.material = material
		var instance := MeshInstance3D.new()
		instance.mesh = box
		body.add_child(instance)
		size -= 1.0
	body.add_child(_named(HapticObject.new(), "HapticObject"))
	(body as Node3D).position = Vector3(0.0, -100.0, 0.0)
	get_tree().current_scene.add_child(body)


func _count(vibration: Dictionary) -> void:
	_vibrations += 1
	for value: float in vibration.get("amplitude", []):
		_strongest = maxf(_strongest, value)


## Where each object is on the screen, as shares of its width and height.
func _places() -> Dictionary:
	var found := {}
	var camera := get_viewport().get_camera_3d()
	var size := get_viewport().get_visible_rect().size
	for body: Node3D in HapticObject.by_body:
		var object: HapticObject = HapticObject.by_body[body]
		var at := camera.unproject_position(body.global_position) / size
		found[object.object_id] = [at.x, at.y]
	return found


func _say(what: String, detail: Dictionary) -> void:
	print("PROBE ", JSON.stringify({"what": what, "detail": detail}))


## Describes the next scene of the scene cases, and touches its objects.
func _next_case() -> void:
	var cases: Array = JSON.parse_string(FileAccess.get_file_as_string("res://scene_cases.json"))
	var case: Dictionary = cases[_cases]
	_cases += 1
	for object: Dictionary in case["objects"]:
		_service.add(object)
	for id: String in case["touch"]:
		for phase: String in ["contact", "release"]:
			_service.touch({"phase": phase, "hand": "left", "object_id": id, "speed_mps": 0.3, "force_n": 1.5})
	for object: Dictionary in case["objects"]:
		_service.forget(str(object.get("object_id", "")))
	_say("case", {"name": case["name"]})
