class_name FeelPlayer
extends RefCounted
## Plays a feel file of `hapticvlm bake` without a service; docs/player.md explains each rule.
##
## Knows no clock: times are arguments, in s. It plans for a motor. With `hz` above 0 it renders samples for an audio output
## instead.

const FeelFile := preload("feel_file.gd")
const FORMS: Array[String] = ["amplitude", "parametric"]

## Factor of every vibration, 0..1.
var gain: Variant = 1.0
## Receives a touch (Dictionary) and returns {material, impact_gain?, thickness_m?, hum?}.
var surface_of: Callable
## Fields of which a problem was told.
var said := {}
var feel: Dictionary
var step_s: float
var sound_hz: float
## Of the step that is taken: its length in time constants of a smoothed number, and how far that falls.
var smoothing: float
var decay: float

var _hands := {}
var _grains := {}
var _drawn := 1
var _turned_down := 0.0


func _init(file: Dictionary, surfaces: Callable, hz := 0.0) -> void:
	feel = file
	surface_of = surfaces
	sound_hz = hz
	step_s = feel.rules.step_s
	for name: String in feel.words.hand:
		_hands[name] = Hand.new(sound_hz > 0.0)


## Opens the text of a `feel.true.json`; an empty dictionary if it is none, and the log names the field that is wrong.
static func open(text: String) -> Dictionary:
	var file: Variant = JSON.parse_string(text)
	var problem := FeelFile.unpack(file)
	if problem.is_empty():
		return file
	push_error("HapticVLM: feel.true.json: ", problem)
	return {}


## Receives a touch as `HapticService` sends it; returns whether it begins an impact, which asks for a plan at once.
func touch(fields: Dictionary, now: Variant) -> bool:
	if not _is_time(now) or not _knows(fields):
		return false
	var hand: Hand = _hands[fields.hand]
	var interaction: Variant = fields.get("interaction")
	if fields.phase == "release":
		hand.is_armed = hand.is_held
		hand.rest()
		return false
	if hand.is_armed and fields.phase != "slide":
		hand.is_held = false
		hand.is_armed = false
	if hand.is_held:
		return false
	if now > hand.lease_until:
		hand.rest()
	if sound_hz == 0.0:
		_run(hand, now)
	_note_milliseconds(hand, fields.phase, now)
	var onset: bool = not hand.touches and fields.phase == "contact"
	hand.lease_until = now + feel.rules.lease_s
	hand.touches = fields.phase != "approach"
	if hand.is_muted:
		return onset
	if not hand.touches and interaction != "swing":
		hand.let_go()
		return false
	var kind := "strike" if interaction == null else str(interaction)
	if not kind in FeelFile.TEXTURES and (fields.phase == "slide" or not (onset or interaction)):
		kind = "slide"
	_feel(hand, fields, kind, onset)
	return onset


## Ends everything; a hand is felt again after its release and a new approach or contact.
func stop() -> void:
	for hand: Hand in _hands.values():
		hand.is_held = true
		hand.is_armed = false
		hand.rest()


## Returns whether a stop keeps this hand silent.
func is_held(name: String) -> bool:
	return _is_word("hand", name, _hands.keys()) and _hands[name].is_held


## Fades a hand and keeps it silent, or lets its touches be heard from their next renewal.
func mute(name: String, is_muted: bool) -> void:
	if not _is_word("hand", name, _hands.keys()):
		return
	if is_muted and not _hands[name].is_muted:
		_hands[name].let_go()
	_hands[name].is_muted = is_muted


## Returns the next 100 ms of a hand as {period_ms, amplitude, frequency_hz, transients}, the fields of a `vibration` event;
## empty arrays are silence. The form is amplitude or parametric.
func plan(name: String, form: String, now: Variant) -> Dictionary:
	var pad: Dictionary = feel.rules.pad
	var is_form := _is_word("form", form, FORMS)
	var period_s: float = pad.period_s[form if is_form else FORMS[0]]
	var planned := {"period_ms": 1000.0 * period_s, "amplitude": [], "frequency_hz": [], "transients": []}
	if not is_form or not _is_time(now) or not _is_word("hand", name, _hands.keys()):
		return planned
	var hand: Hand = _hands[name]
	if hand.lease_until <= now:
		hand.rest()
		return planned
	var begun := hand.impacts().filter(func(shot: FeelVoices.Voice) -> bool: return shot.is_new)
	for shot in begun:
		shot.is_new = false
	_run(hand, now)
	var factor: float = _within("gain", gain, 1.0)
	var beginning := 0 if begun.is_empty() else int(pad.min_impact_s / period_s + FeelVoices.SOON)
	var powers := _ahead(hand, period_s, maxi(1, floori(minf(pad.horizon_s, hand.lease_until - now) / period_s + FeelVoices.SOON)))
	var amplitude := powers.map(
		func(power: Vector3) -> float: return _on_pad(sqrt(power.y if form == "amplitude" else power.x), form)
	)
	for period in mini(beginning, amplitude.size()):
		amplitude[period] = maxf(amplitude[period], pad.min_impact)
	if factor * amplitude.max() < pad.min_amplitude:
		return planned
	planned.amplitude = amplitude.map(func(part: float) -> float: return snappedf(factor * part, 0.0001))
	if form == "parametric":
		planned.frequency_hz = powers.map(
			func(power: Vector3) -> float: return snappedf(clampf(sqrt(power.z / maxf(power.x, 1e-12)), 20.0, 1000.0), 0.1)
		)
		planned.transients = begun.map(_transient.bind(factor))
	return planned


## Returns whether `render` would give zeros until the next touch.
func is_silent() -> bool:
	return _hands.values().all(func(hand: Hand) -> bool: return hand.is_silent())


## Returns the next samples of both hands, -1..1, from the time `now` on.
func render(count: int, now: Variant) -> PackedFloat64Array:
	var wave := PackedFloat64Array()
	if sound_hz == 0.0 or not _is_time(now):
		wave.resize(count)
		return wave
	var factor: float = _within("gain", gain, 1.0)
	var size := maxi(1, int(step_s * sound_hz))
	for begin in range(0, count, size):
		var part := PackedFloat64Array()
		part.resize(mini(size, count - begin))
		for hand: Hand in _hands.values():
			if hand.is_silent():
				continue
			if hand.lease_until < now + begin / sound_hz:
				hand.rest()
			_advance(hand, part.size() / sound_hz, part)
		wave.append_array(_limited(part, factor))
	return wave


## Returns the next number of a sequence that looks random, 0..1; every player has it.
func draw() -> float:
	_drawn = (75 * _drawn + 74) % 65537
	return (_drawn + 0.5) / 65537.0


## Returns the value of a table of rows at a speed and a force.
func look(table: Array, speed: float, force: float) -> float:
	var at := FeelVoices.place(feel.speeds_mps, speed)
	var on := FeelVoices.place(feel.forces_n, force)
	var below := mini(int(at), table.size() - 2)
	return lerpf(FeelVoices.value(table[below], on), FeelVoices.value(table[below + 1], on), at - below)


## Returns a grain that begins `late_s` after the begin of this step.
func grain(name: String, strength: float, late_s: float) -> FeelVoices.Voice:
	if not _grains.has(name):
		var clip: Dictionary = feel.clips[name]
		_grains[name] = FeelVoices.blended(clip, clip, 0.0, sound_hz > 0.0)
	var values := {"clip": _grains[name], "palm": strength, "pad": strength, "fade": 1.0, "aim": 1.0, "at": -late_s}
	return FeelVoices.Voice.new(FeelVoices.shot, values)


## Tells a hand what it feels now.
func _feel(hand: Hand, fields: Dictionary, kind: String, onset: bool) -> void:
	var given: Variant = surface_of.call(fields)
	var surface: Dictionary = given if given is Dictionary else {}
	var speed: float = _within("speed_mps", fields.get("speed_mps"), 0.0)
	var force: float = _within("force_n", fields.get("force_n"), 1.5)
	var strength: float = _within("impact_gain", surface.get("impact_gain"), 1.0)
	var thickness_m: Variant = _within("thickness_m", surface.get("thickness_m"), null)
	for voice in hand.voices:
		if voice.key:
			voice.aim = 0.0
	if hand.touches and surface.get("hum") != null:
		_hum(hand, surface.hum)
	var name: Variant = surface.get("material")
	if not name is String or not feel.materials.has(name):
		if name != null and not (name is String and name == "unknown"):
			_note("material", "`%s` is not in the feel file; bake it" % name)
		return
	var facts: Dictionary = feel.materials[name]
	if onset and kind != "swing":
		_strike(hand, facts, kind if kind in FeelFile.IMPACTS else "tap", speed, force, strength if kind in FeelFile.IMPACTS else 1.0)
	if kind == "press" and facts.n_per_grain != null:
		var begin := func() -> Array: return [FeelVoices.Voice.new(FeelVoices.press, {"facts": facts, "at": 0.3 + 0.4 * draw(), "fade": strength})]
		_follow(hand, "press %s" % name, strength, Vector3(speed, force, speed), begin)
	if not kind in FeelFile.TEXTURES:
		return
	var thin: float = facts.thickness_m / thickness_m if kind == "swing" and thickness_m else 1.0
	var pitch := speed * thin
	_follow(hand, "%s %s %s" % [kind, thin, name], 1.0, Vector3(speed, force, pitch), _texture.bind(hand, facts[kind], facts.grain, pitch))


func _hum(hand: Hand, given: Variant) -> void:
	var hum: Dictionary = given if given is Dictionary else {}
	var level: float = _within("hum.level", hum.get("level"), 0.0)
	var hz: float = _within("hum.frequency_hz", hum.get("frequency_hz"), 0.0)
	var drives: Array = hum.get("drives") if hum.get("drives") is Array else []
	var are_drives := drives.all(func(drive: Variant) -> bool: return (drive is float or drive is int) and absf(drive) <= 100.0)
	if level == 0.0 or hz == 0.0 or drives.is_empty() or drives.size() > 16 or not are_drives:
		_note("hum", "needs frequency_hz, level and drives, as materials.json has them")
		return
	var begin := func() -> Array: return [FeelVoices.Voice.new(FeelVoices.hum, {})]
	_follow(hand, "hum", level, {"hz": hz, "drives": drives}, begin)


func _strike(hand: Hand, facts: Dictionary, kind: String, speed: float, force: float, strength: float) -> void:
	var ringing := hand.impacts()
	if ringing.size() >= feel.rules.max_impacts:
		return
	var loud := ringing.filter(func(shot: FeelVoices.Voice) -> bool: return shot.aim > 0.0)
	if loud.size() >= feel.rules.max_ringing:
		loud[0].aim = 0.0
	var table: Dictionary = feel.impacts[kind]
	var clips: Array = facts[kind].clips
	var place := look(table.place, speed, force)
	var first := mini(int(place), clips.size() - 1)
	var next := mini(first + 1, clips.size() - 1)
	var share := 0.0 if next == first else place - first
	var clip := FeelVoices.blended(feel.clips[clips[first]], feel.clips[clips[next]], share, sound_hz > 0.0)
	var varied := 2.0 * draw() - 1.0
	var level: float = 1.0 - feel.rules.level_varies * varied
	var values := {"clip": clip, "is_impact": true, "fade": strength, "aim": strength, "hz": facts.hz}
	values.at = look(table.skip_s, speed, force)
	values.rate = 1.0 + feel.rules.pitch_varies * varied
	for on: String in ["palm", "pad"]:
		values[on] = minf(level * facts[kind][on] * look(table[on], speed, force), clip.most)
	hand.voices.append(FeelVoices.Voice.new(FeelVoices.shot, values))


## Returns the voices of a texture: a loop for each layer, and breaks. Too many others that fade end at once.
func _texture(hand: Hand, facts: Dictionary, grain_name: String, speed: float) -> Array:
	var others := {}
	for voice in hand.voices:
		if voice.advance == FeelVoices.layer:
			others[voice.key] = true
	var voices := []
	if others.size() > feel.rules.max_textures:
		hand.voices = hand.voices.filter(func(voice: FeelVoices.Voice) -> bool: return voice.advance != FeelVoices.layer)
	for layer: Dictionary in facts.layers:
		var clip := FeelVoices.unpacked(feel.loops[layer.loop])
		var values := {"clip": clip, "facts": layer, "at": draw() * clip.seconds, "flow": Vector2(speed, 0.0)}
		voices.append(FeelVoices.Voice.new(FeelVoices.layer, values))
	if facts.breaks != null:
		voices.append(FeelVoices.Voice.new(FeelVoices.breaks, {"facts": facts.breaks, "grain": grain_name, "at": draw()}))
	return voices


## Lets a hand sound for `dt`, s; returns the power for a pad, and adds samples to `part`.
func _advance(hand: Hand, dt: float, part := PackedFloat64Array()) -> Vector3:
	if smoothing != dt / feel.rules.smooth_s:
		smoothing = dt / feel.rules.smooth_s
		decay = exp(-smoothing)
	var power := Vector3.ZERO
	var step: float = dt / feel.rules.fade_s
	var has_ended := false
	for voice in hand.voices:  # grains that begin are added at the end, and sound at once
		var before := voice.fade
		voice.fade = move_toward(before, voice.aim, step)
		power += voice.advance.call(self, hand, voice, before, dt, part)
		has_ended = has_ended or (voice.fade == 0.0 and voice.aim == 0.0)
	if has_ended:
		hand.voices = hand.voices.filter(func(voice: FeelVoices.Voice) -> bool: return voice.fade != 0.0 or voice.aim != 0.0)
	return power


## Gives the voices of a key what they follow, and begins them if there are none.
func _follow(hand: Hand, key: String, aim: float, to: Variant, begin: Callable) -> void:
	var same := hand.voices.filter(func(voice: FeelVoices.Voice) -> bool: return voice.key == key)
	if same.is_empty():
		same.assign(begin.call())
		hand.voices.append_array(same)
	for voice in same:
		voice.key = key
		voice.aim = aim
		voice.follow(self, to)


## Returns the mean power of each of the next periods of a hand, which stays as it is.
func _ahead(hand: Hand, period_s: float, periods: int) -> Array:
	var voices := hand.voices.duplicate()
	var memories := voices.map(func(voice: FeelVoices.Voice) -> Array: return voice.memory())
	var drawn := _drawn
	var size := roundi(period_s / step_s)
	var powers := []
	for period in periods:
		var power := Vector3.ZERO
		for step in size:
			power += _advance(hand, step_s)
		powers.append(power / size)
	_drawn = drawn
	hand.voices = voices
	for at in voices.size():
		voices[at].recall(memories[at])
	return powers


## Lets a hand that is planned sound until `now`.
func _run(hand: Hand, now: float) -> void:
	var left := clampf(now - hand.time, 0.0, 0.5) if is_finite(hand.time) else 0.0
	hand.time = now
	while left > FeelVoices.SOON and not hand.is_silent():
		_advance(hand, minf(left, step_s))
		left -= step_s


func _on_pad(level: float, form: String) -> float:
	var pad: Dictionary = feel.rules.pad
	return 0.0 if level < pad.min_level else minf(pad.scale[form] * pow(minf(level, 1.0), pad.exponent), 1.0)


func _transient(shot: FeelVoices.Voice, factor: float) -> Dictionary:
	var peak := _on_pad(shot.pad * shot.fade / shot.clip.most, "parametric")
	var amplitude := snappedf(factor * maxf(peak, feel.rules.pad.min_impact), 0.0001)
	return {"at_ms": 0.0, "amplitude": amplitude, "frequency_hz": shot.hz}


## Turns down what would leave the range, at once, and recovers slowly.
func _limited(part: PackedFloat64Array, factor: float) -> PackedFloat64Array:
	var ceiling: float = feel.rules.ceiling
	var loudest := ceiling
	for sample in part:
		loudest = maxf(loudest, factor * absf(sample))
	_turned_down = maxf(1.0 - ceiling / loudest, _turned_down * exp(-part.size() / sound_hz / feel.rules.recover_s))
	for at in part.size():
		part[at] *= factor * (1.0 - _turned_down)
	return part


## Returns a quantity within its limits; `missing` for what is absent or no number.
func _within(name: String, given: Variant, missing: Variant) -> Variant:
	if given == null:
		return missing
	if not (given is float or given is int) or is_nan(given):
		_note(name, "`%s` is not a number; %s is used; pass a number" % [given, missing])
		return missing
	var low: float = feel.ranges[name][0]
	var high: float = feel.ranges[name][1]
	if given < low or given > high:
		_note(name, "%s is outside %s to %s; the nearest is used" % [given, low, high])
	return clampf(given, low, high)


func _knows(fields: Dictionary) -> bool:
	var interaction: Variant = fields.get("interaction")
	return (
		_is_word("phase", fields.get("phase"), feel.words.phase)
		and _is_word("hand", fields.get("hand"), _hands.keys())
		and (interaction == null or _is_word("interaction", interaction, feel.words.interaction))
	)


func _is_word(field: String, word: Variant, words: Array) -> bool:
	if word in words:
		return true
	_note(field, "`%s` is not one of %s: the call is refused" % [word, ", ".join(words)])
	return false


func _note_milliseconds(hand: Hand, phase: String, now: float) -> void:
	var gap := now - hand.touched_at
	hand.touched_at = now
	hand.gaps = hand.gaps + 1 if phase == "slide" and gap >= 5.0 and gap <= 1000.0 else 0
	if hand.gaps == 3:
		_note("now", "%s s between the touches of a slide; pass s, not ms" % gap)


func _is_time(now: Variant) -> bool:
	if (now is float or now is int) and is_finite(now):
		return true
	_note("now", "`%s` is not a time in s: the call is refused" % now)
	return false


func _note(field: String, text: String) -> void:
	if not said.has(field):
		said[field] = "%s: %s" % [field, text]
		push_warning("HapticVLM: " + said[field])


## One hand: its lease, its hold, and what sounds.
class Hand:
	var is_held := false
	var is_armed := false
	var is_muted := false
	var touches := false
	var lease_until := -INF
	var time := NAN  # until which a plan has let it sound
	var touched_at := 0.0
	var gaps := 0
	var voices: Array[FeelVoices.Voice] = []
	var _fades: bool  # as samples do; a plan ends at once

	func _init(fades: bool) -> void:
		_fades = fades

	func is_silent() -> bool:
		return voices.is_empty()

	## Returns the impacts that ring.
	func impacts() -> Array[FeelVoices.Voice]:
		return voices.filter(func(voice: FeelVoices.Voice) -> bool: return voice.is_impact)

	## Ends what sounds: at once for a plan, with a fade for samples. An impact of which nothing was played is dropped.
	func let_go() -> void:
		time = NAN
		if not _fades:
			voices.clear()
		voices = voices.filter(func(voice: FeelVoices.Voice) -> bool: return voice.has_begun or not voice.is_impact)
		for voice in voices:
			voice.aim = 0.0

	## Ends the lease, and what sounds.
	func rest() -> void:
		lease_until = -INF
		touches = false
		let_go()
