class_name FeelPlayer
extends RefCounted
## Plays `feel.json` without a service: its vibration is that of the service for the same touches.
##
## Follows the rules of the service's hands: a touch lasts 250 ms unless it is renewed, and a stop
## holds a hand until its release and a new touch. Knows no clock: times are arguments, in s.
##
## It plans for a motor. With `sound_hz` above 0 it renders samples for an audio output instead.

const VERSION := 1

## Factor of every vibration, 0..1.
var gain := 1.0
## Receives a touch (Dictionary) and returns {material, impact_gain?, thickness_m?, hum?}.
var surface_of: Callable

var _feel: Dictionary
var _hands := {}
var _onsets := 0
var _told := {}


func _init(feel: Dictionary, surfaces: Callable, sound_hz := 0.0) -> void:
	_feel = feel
	surface_of = surfaces
	for name: String in ["left", "right"]:
		_hands[name] = SoundHand.new(feel, sound_hz) if sound_hz > 0.0 else Hand.new(feel, feel.rules.plan.rate_hz)


## Opens the text of a `feel.json`; an empty dictionary, and an error in the log, if it is none.
static func open(text: String) -> Dictionary:
	var file: Variant = JSON.parse_string(text)
	if not file is Dictionary or file.get("version") != VERSION:
		push_error("feel.json: not version %d; bake it again, or update the addon" % VERSION)
		return {}
	file.drawn = Marshalls.base64_to_raw(file.draws)  # of 16 bits each
	file.loudness = FeelSynthesis.loudness_filter(file.rules)
	file.rules.cubic_shares = FeelSynthesis.cubic_shares()
	_unpack(file.slips)
	for name: String in file.materials:
		_unpack(file.materials[name].slide.loop)
		_unpack(file.materials[name].swing.loop)
	return file


## Receives a touch as `HapticService` sends it; returns whether it begins an impact, which asks
## for a plan at once.
func touch(given: Dictionary, now: float) -> bool:
	var fields := _fitted(given)
	if fields.is_empty():
		return false
	var hand: Hand = _hands[fields.hand]
	if fields.phase == "release":
		hand.is_armed = hand.is_held
		hand.release()
		return false
	if hand.is_armed and fields.phase != "slide":
		hand.is_held = false
		hand.is_armed = false
	if hand.is_held:
		return false
	hand.lapse(now)
	var vibrated := hand.vibrates
	var onset := hand.follow(fields, now + _feel.rules.lease_s)
	if hand.vibrates:
		_play(hand, fields, onset, now)
	elif vibrated:
		hand.rest()
	return onset


## Ends everything at once; a hand is felt again after its release and a new approach or contact.
func stop() -> void:
	for name: String in _hands:
		hold(name)


## Ends one hand at once, as `stop` does.
func hold(name: String) -> void:
	var hand: Hand = _hands[name]
	hand.is_held = true
	hand.is_armed = false
	hand.release()


## Returns whether a stop keeps this hand silent.
func is_held(name: String) -> bool:
	return _hands[name].is_held


## Returns the next 100 ms of a hand as {period_ms, amplitude, frequency_hz, transients}, the
## fields of a `vibration` event; empty arrays are silence. The form is amplitude or parametric.
func plan(name: String, form: String, now: float) -> Dictionary:
	var hand: Hand = _hands[name]
	hand.lapse(now)
	return hand.plan(form, now, within(1.0, gain, 1.0))


## Returns whether `render` would give zeros until the next touch.
func is_silent() -> bool:
	return _hands.values().all(func(hand: SoundHand) -> bool: return hand.is_silent())


## Fades a hand and keeps it silent, or lets its touches be heard from their next renewal.
func mute(name: String, is_muted: bool) -> void:
	var hand: SoundHand = _hands[name]
	if is_muted and not hand.is_muted:
		hand.rest()
	hand.is_muted = is_muted


## Returns the next samples of both hands, -1..1; `now` is the time of the first.
func render(count: int, now: float) -> PackedFloat64Array:
	var wave: PackedFloat64Array = _hands.left.render(count, now)
	if _hands.right.is_silent():
		return wave
	var right: PackedFloat64Array = _hands.right.render(count, now)
	for at in count:
		wave[at] = clampf(wave[at] + right[at], -1.0, 1.0)
	return wave


## Returns a touch as the service takes it: its quantities within the limits; empty, and an unknown
## word is told once, where it is refused.
func _fitted(fields: Dictionary) -> Dictionary:
	var rules: Dictionary = _feel.rules.touch
	for name: String in ["hand", "phase", "interaction"]:
		var word: Variant = fields.get(name)
		if word in rules[name] or (name == "interaction" and word == null):
			continue
		var text := "a touch is not felt: its %s is `%s`, not one of %s" % [name, word, rules[name]]
		if not text in _told and _told.size() < 100:
			push_warning(text)
			_told[text] = true
		return {}
	var fitted := fields.duplicate()
	fitted.speed_mps = within(rules.fastest_mps, fields.get("speed_mps"), 0.0)
	fitted.force_n = within(rules.strongest_n, fields.get("force_n"), rules.gentle_n)
	return fitted


## Returns a quantity between 0 and `most`; `missing` for what is no number.
static func within(most: float, value: Variant, missing: float) -> float:
	if not (value is float or value is int) or is_nan(value):
		return missing
	return clampf(value, 0.0, most)


func _play(hand: Hand, fields: Dictionary, onset: bool, now: float) -> void:
	_onsets += int(onset)
	var surface: Dictionary = surface_of.call(fields)
	var interaction := hand.interaction_name()
	var is_impact := interaction in FeelVoices.IMPACTS
	hand.apply(
		{
			"material": surface.get("material"),
			"interaction": interaction,
			"onset": onset,
			"speed": fields.speed_mps,
			"force": fields.force_n,
			"seed": _onsets,
			"expires_at": hand.lease_until,
			"gain": within(1.0, surface.get("impact_gain"), 1.0) if is_impact else 1.0,
			"thickness": surface.get("thickness_m") if interaction == "swing" else null,
			"hum": surface.get("hum") if hand.touches else null,
		},
		now
	)


## Unpacks a loop. Its samples stay bytes: a script would need 100 ms to convert those of all materials.
static func _unpack(loop: Dictionary) -> void:
	var packed := Marshalls.base64_to_raw(loop.wave)
	loop.count = packed.size()
	# Its last sample before the first, and its first two behind the last, so that a cubic never wraps.
	loop.padded = packed.slice(-1) + packed + packed.slice(0, 2)


## One hand: its lease, its hold, and the plans of its vibration.
class Hand:
	var is_held := false
	var is_armed := false
	var touches := false
	var vibrates := false
	var lease_until := INF
	var _slides := false
	var _interaction := ""  # empty: the client names none
	var _feel: Dictionary
	var _voices: FeelVoices
	var _rendered_until: Variant = null
	var _renewal: Variant = null
	var _expires_at := -INF

	func _init(feel: Dictionary, rate_hz: float) -> void:
		_feel = feel
		_voices = FeelVoices.new(feel, rate_hz)

	func interaction_name() -> String:
		if _slides and not _interaction in FeelVoices.TEXTURES:
			return "slide"
		return "strike" if _interaction.is_empty() else _interaction

	func follow(fields: Dictionary, until: float) -> bool:
		var onset: bool = not touches and fields.phase == "contact"
		lease_until = until
		var named: Variant = fields.get("interaction")
		_interaction = "" if named == null else str(named)
		touches = fields.phase != "approach"
		vibrates = touches or _interaction == "swing"
		var is_texture: bool = _interaction in FeelVoices.TEXTURES
		var is_unnamed := not onset and _interaction.is_empty()
		var slides: bool = fields.phase == "slide" or is_texture or is_unnamed
		_slides = slides if touches else _interaction == "swing"
		return onset

	func lapse(now: float) -> void:
		if lease_until < now:
			release()

	func release() -> void:
		lease_until = INF
		touches = false
		vibrates = false
		_slides = false
		_interaction = ""
		rest()

	func rest() -> void:
		_voices.silence()
		_renewal = null
		_rendered_until = null

	func apply(command: Dictionary, now: float) -> void:
		_expires_at = command.expires_at
		if not command.onset:
			_renewal = command
			return
		_advance(now)
		_voices.apply(command)

	func plan(form: String, now: float, gain: float) -> Dictionary:
		var rules: Dictionary = _feel.rules.plan
		var impacts := _voices.beginning()
		_advance(now)
		var period: float = rules.period_s[form]
		var planned := {
			"period_ms": 1000.0 * period, "amplitude": [], "frequency_hz": [], "transients": []
		}
		var ahead: float = minf(rules.horizon_s, _expires_at - now)
		if _voices.is_silent() or ahead <= 0.0:
			return planned
		var wave := _voices.fork().render(roundi(rules.horizon_s * rules.rate_hz), now)
		var count := maxi(1, floori(ahead / period + 1e-9))
		var size := roundi(period * rules.rate_hz)
		var drive := wave
		var stride := 1
		if form == "amplitude":
			drive = FeelSynthesis.loudness(wave, _feel.loudness)
			stride = FeelSynthesis.STRIDE
		var energy := FeelSynthesis.energies(drive)
		var beginning := 0 if impacts.is_empty() else roundi(rules.min_impact_s / period)
		var amplitude := []
		for level in FeelSynthesis.levels(energy, size, count, stride):
			var value := FeelSynthesis.controller_amplitude(level, form, rules)
			value = maxf(value, rules.min_impact) if amplitude.size() < beginning else value
			amplitude.append(snappedf(gain * value, 0.0001))
		if amplitude.max() < rules.min_amplitude:
			return planned
		planned.amplitude = amplitude
		if form == "parametric":
			var steps := FeelSynthesis.step_energies(wave)
			planned.frequency_hz = Array(FeelSynthesis.frequencies(energy, steps, size, count, rules))
			planned.transients = impacts.map(_transient.bind(gain))
		return planned

	func _transient(voice: FeelVoices.Voice, gain: float) -> Dictionary:
		var rules: Dictionary = _feel.rules.plan
		var peak: float = voice.source.peak
		var amplitude := FeelSynthesis.controller_amplitude(peak, "parametric", rules)
		var facts: Dictionary = _feel.materials[voice.material]
		return {
			"at_ms": 0.0,
			"amplitude": snappedf(gain * maxf(amplitude, rules.min_impact), 0.0001),
			"frequency_hz": facts.impact.modes[0].frequency_hz,
		}

	func _advance(now: float) -> void:
		var elapsed := 0.0
		if _rendered_until != null:
			elapsed = clampf(now - _rendered_until, 0.0, _feel.rules.plan.stale_s)
		_rendered_until = now
		var count := roundi(elapsed * _feel.rules.plan.rate_hz)
		if count > 0 and not _voices.is_silent():
			_voices.render(count, now - elapsed)
		if _renewal != null:
			_voices.apply(_renewal)
		_renewal = null


## One hand whose touches are heard. What ends fades instead of a click.
class SoundHand:
	extends Hand
	var is_muted := false

	func is_silent() -> bool:
		return _voices.is_silent()

	func rest() -> void:
		_voices.rest()

	func apply(command: Dictionary, _now: float) -> void:
		if not is_muted:
			_voices.apply(command)

	func render(count: int, now: float) -> PackedFloat64Array:
		return _voices.render(count, now)
