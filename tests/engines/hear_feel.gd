extends Node
## Strokes while a HapticSpeaker plays, and hears what the engine's mixer puts out.
##
## Node, stream, mixer and clock are real. The service is one that answers nothing: the switch alone says which is felt.

const TOUCH_S := 0.03
const PHASE_S := 0.5
const FADED_S := 0.25  # what is rendered ahead, the mixer's blocks, and the fade

var _service: HapticService
var _speaker: HapticSpeaker
var _capture := AudioEffectCapture.new()
var _touched_at := -INF


## Returns the account of each phase.
func listen() -> Dictionary:
	AudioServer.add_bus_effect(0, _capture)
	_speaker = HapticSpeaker.new()
	add_child(_speaker)
	var told := {"no autoload": await _phase("slide")}
	ProjectSettings.set_setting("hapticvlm/mode", "baked")  # which connects to nothing
	_service = HapticService.new()
	add_child(_service)
	_service.felt.open({}, null)
	told["no bake"] = await _phase("slide")
	_service.felt.open(FeelPlayer.open(FileAccess.get_file_as_string(HapticService.FEEL)), null)
	_service.add({"object_id": "mat", "material": "rubber"})
	_touch("release")
	_touch("contact")
	told["stroke"] = await _phase("slide")
	_select("service")
	told["service"] = await _phase("slide")
	_select("baked")
	told["baked again"] = await _phase("slide")
	_service.stop()
	told["stop"] = await _phase("slide")
	remove_child(_speaker)
	add_child(_speaker)
	told["enabled after a stop"] = await _phase("slide")
	_touch("release")
	_touch("contact")
	told["touched again"] = await _phase("slide")
	_touch("release")
	told["released"] = await _phase("")
	return told


func _select(mode: String) -> void:
	_service.felt.select(mode, HapticService.now_s())


func _touch(phase: String) -> void:
	_touched_at = HapticService.now_s()
	if _service != null:
		_service.touch({"phase": phase, "hand": "right", "object_id": "mat", "speed_mps": 0.4, "force_n": 2.0})


## Repeats a touch, and describes what the mixer puts out once the change before has passed.
func _phase(touch: String) -> Dictionary:
	await _pass(touch, FADED_S)
	return _described(await _pass(touch, PHASE_S))


## Returns the left samples of the next seconds of the mixer.
func _pass(touch: String, seconds: float) -> PackedFloat32Array:
	var wave := PackedFloat32Array()
	_capture.clear_buffer()
	while wave.size() < seconds * AudioServer.get_mix_rate():
		await get_tree().process_frame
		if not touch.is_empty() and HapticService.now_s() - _touched_at >= TOUCH_S:
			_touch(touch)
		for frame in _capture.get_buffer(_capture.get_frames_available()):
			wave.append(frame.x)
	return wave


func _described(wave: PackedFloat32Array) -> Dictionary:
	var peak := 0.0
	var longest := 0
	var zeros := 0
	for at in wave.size():
		peak = maxf(peak, absf(wave[at]))
		zeros = zeros + 1 if wave[at] == 0.0 else 0
		longest = maxi(longest, zeros)
	var gap_ms := 1000.0 * longest / AudioServer.get_mix_rate()
	return {"peak": peak, "gap_ms": gap_ms, "silence": _speaker.silence()}
