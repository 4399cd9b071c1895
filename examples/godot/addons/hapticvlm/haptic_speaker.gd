class_name HapticSpeaker
extends AudioStreamPlayer
## Plays the touches of both hands as sound, from the bake: on a palm speaker on an audio output, or on headphones.
##
## They are played as they are felt, so that most is below 300 Hz. `volume_db` and `bus` select how loud and where;
## `stream` is the node's own. It is silent while the service is felt, which plays on its own speaker. Each frame renders
## ahead of the mixer by the longest of the last frames and one block, which also end after a stop.

const Felt := preload("felt.gd")
const RATE_HZ := 8000.0  # a script renders few samples, and a touch has nothing above 1.1 kHz
const BLOCK_PER_LATENCY := 4.0 / 3.0  # the mixer takes the power of two nearest to the latency of the settings at once
const LONGEST_S := 0.12  # ahead of the audio thread
const SHORTENS := 0.98  # what is rendered ahead, after a long frame, in each frame

var _felt: Felt
var _feel := {}
var _player: FeelPlayer  # null: no bake
var _capacity := 0  # samples of the stream's buffer
var _frame_s := 0.0  # the longest of the last frames
var _block_s := 0.0


func _enter_tree() -> void:
	process_priority = 1001  # run after HapticService, which changes between service and bake


func _ready() -> void:
	var generator := AudioStreamGenerator.new()
	generator.mix_rate = RATE_HZ
	generator.buffer_length = LONGEST_S
	stream = generator
	var latency_ms: float = ProjectSettings.get_setting_with_override("audio/driver/output_latency")
	_block_s = 0.001 * BLOCK_PER_LATENCY * latency_ms
	playback_type = AudioServer.PLAYBACK_TYPE_STREAM  # a web export plays finished samples otherwise


func _exit_tree() -> void:
	_follow(null)


func _process(delta: float) -> void:
	var service := HapticService.current
	_follow(null if service == null else service.felt)
	_frame_s = maxf(delta, SHORTENS * _frame_s)
	if _player == null:
		return
	for name in HapticService.HANDS:
		_mute(name)
	if not _player.is_silent():
		_render()


## Returns the reason why this output is silent, in one sentence; empty if it is not.
func silence() -> String:
	var service := HapticService.current
	if service == null:
		return "the autoload HapticVLM is missing: enable the plugin"
	if service.by == "service":
		return "the service is felt, and plays on its own speaker"
	return service.silence()


func _follow(felt: Felt) -> void:
	if felt == _felt and (felt == null or is_same(felt.feel, _feel)):
		return
	if _felt != null:
		_felt.touched.disconnect(_touch)
		_felt.stopped.disconnect(_stop)
	_felt = felt
	_feel = {}
	_player = null
	if felt == null:
		return
	felt.touched.connect(_touch)
	felt.stopped.connect(_stop)
	_feel = felt.feel
	if not felt.has_bake():
		return
	_player = FeelPlayer.new(_feel, felt.surface_of, RATE_HZ)


func _touch(fields: Dictionary, now: float) -> void:
	if _player == null:
		return
	_mute(fields["hand"])
	_player.touch(fields, now)


## Mutes a hand that the service is felt by, or that a stop before this player's begin holds.
func _mute(name: String) -> void:
	_player.mute(name, not _felt.is_baked(name) or _felt.is_held(name))


func _stop() -> void:
	if _player != null:
		_player.stop()


func _render() -> void:
	if not playing:
		play()
		_capacity = get_stream_playback().get_frames_available()
	var playback: AudioStreamGeneratorPlayback = get_stream_playback()
	var room := playback.get_frames_available()
	var ahead := ceili(RATE_HZ * minf(_frame_s + _block_s, LONGEST_S))
	var count := mini(ahead - (_capacity - room), room)
	if count <= 0:
		return
	var frames := PackedVector2Array()
	for sample in _player.render(count, HapticService.now_s()):
		frames.append(Vector2(sample, sample))
	playback.push_buffer(frames)
