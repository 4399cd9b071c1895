class_name FeelVoices
extends RefCounted
## What sounds of a hand: docs/player.md, "What sounds". A voice advances by a step of `dt`, s, and returns its power for a
## pad: the squares of its level, of its loudness, and of level times frequency. It adds its samples to `part`, if there are any.

const SOON := 1e-9
const NEGLIGIBLE := 1e-6

static var fall := _table(func(code: int) -> float: return 0.0 if code == 255 else pow(10.0, code / -40.0))
static var hertz := _table(func(code: int) -> float: return 20.0 * pow(10.0, code / 150.0))
static var signed := _table(func(code: int) -> float: return (code if code < 128 else code - 256) / 127.0)
## One turn, as a loop of 32 samples: a hum is played as everything else.
static var sine := {"rate_hz": 32.0, "seconds": 1.0, "padded": _sine()}


## Something that sounds. `fade` moves to `aim`; at 0 with aim 0 the voice ends.
class Voice:
	var advance: Callable  # one of the functions below
	var clip: Dictionary
	var facts: Dictionary
	var grain: String
	var is_impact := false
	var is_new := true  # for a plan
	var has_begun := false
	var palm := 0.0
	var pad := 0.0
	var rate := 1.0
	var read := Vector3.ZERO  # of a loop: its rate, loudness and frequency
	var read_at := NAN  # the speed at which it was read
	var hz := 0.0
	var key := ""  # voices of a key follow touches; impacts and grains have none
	var pitch := 0.0  # the speed at which a loop is read
	var fade := 0.0
	var aim := 0.0
	var at := 0.0  # place in its clip, s
	var level := Vector2.ZERO  # value and slope of a smoothed number
	var flow := Vector2.ZERO  # another one
	var target := 0.0  # of the level

	func _init(kind: Callable, values: Dictionary) -> void:
		advance = kind
		for name: String in values:
			set(name, values[name])

	## Returns all that a step changes; `recall` takes it back.
	func memory() -> Array:
		return [fade, aim, at, level, flow]

	func recall(kept: Array) -> void:
		fade = kept[0]
		aim = kept[1]
		at = kept[2]
		level = kept[3]
		flow = kept[4]

	## Takes the speed and force of a touch, which the level moves to, and the speed at which loops are read; a hum takes its tone.
	func follow(player: FeelPlayer, to: Variant) -> void:
		if advance == FeelVoices.hum:
			facts = to
			return
		if advance == FeelVoices.press:
			target = to.y / facts.n_per_grain
			return
		target = player.look(player.feel.levels[facts.level], to.x, to.y)
		pitch = to.z
		if advance == FeelVoices.layer:
			target *= facts.factor * FeelVoices.value(clip.gain, FeelVoices.place(player.feel.speeds_mps, pitch))
		else:
			rate = FeelVoices.value(facts.per_s, FeelVoices.place(player.feel.speeds_mps, to.x))


## An impact or a grain that sounds once; before 0, `at` waits for its begin.
static func shot(player: FeelPlayer, _hand: FeelPlayer.Hand, voice: Voice, before: float, dt: float, part: PackedFloat64Array) -> Vector3:
	var clip := voice.clip
	var step := maxi(int(voice.at / player.step_s + SOON), 0)
	var power := Vector3.ZERO
	var powers: PackedVector3Array = clip.powers
	if step < powers.size():
		power = (voice.pad * voice.fade) ** 2 * powers[step]
	if part:
		mix(part, clip, false, voice.at, voice.rate / player.sound_hz, voice.palm * before, voice.palm * voice.fade)
	voice.at += voice.rate * dt
	voice.has_begun = true
	if step >= powers.size() and voice.at >= clip.seconds:
		voice.fade = 0.0
		voice.aim = 0.0
	return power


## One loop of a texture: follows speed, force, and the speed at which it is read.
static func layer(player: FeelPlayer, _hand: FeelPlayer.Hand, voice: Voice, before: float, dt: float, part: PackedFloat64Array) -> Vector3:
	var clip := voice.clip
	var old := voice.level.x
	voice.level = smoothed(player, voice.level, voice.target)
	voice.flow = smoothed(player, voice.flow, voice.pitch)
	if voice.flow.x != voice.read_at:
		voice.read_at = voice.flow.x
		var on := place(player.feel.speeds_mps, voice.flow.x)
		var reads: PackedVector3Array = clip.reads
		var below := mini(int(on), reads.size() - 2)
		voice.read = reads[below].lerp(reads[below + 1], on - below)
	var gain := voice.level.x * voice.fade
	var rate := voice.read.x
	var drives: PackedFloat64Array = clip.drives
	var drive := gain * drives[int(voice.at / player.step_s + SOON) % drives.size()]
	if part:
		mix(part, clip, true, voice.at, rate / player.sound_hz, old * before, gain)
	voice.at = fposmod(voice.at + rate * dt, clip.seconds)
	var loud := drive * voice.read.y
	var turned := drive * voice.read.z
	return Vector3(drive * drive, loud * loud, turned * turned)


## The fibres that break under a blade, a grain each: `rate` of them in each s. `at` is the distance to the next one.
static func breaks(player: FeelPlayer, hand: FeelPlayer.Hand, voice: Voice, _before: float, dt: float, _part: PackedFloat64Array) -> Vector3:
	voice.level = smoothed(player, voice.level, voice.target)
	voice.at -= voice.rate * dt
	if voice.at < 0.0:
		var gain := (0.4 + 0.6 * player.draw()) * voice.level.x * voice.fade
		hand.voices.append(player.grain(voice.grain, gain, dt + voice.at / voice.rate))
		voice.at = maxf(voice.at + 0.5 + player.draw(), 0.0)
	return Vector3.ZERO


## A press on what yields: a grain for each step that it deepens with the force. `level` is the depth, `at` the depth of the
## next grain, `flow.x` the time until another may begin, s.
static func press(player: FeelPlayer, hand: FeelPlayer.Hand, voice: Voice, _before: float, dt: float, _part: PackedFloat64Array) -> Vector3:
	var rules: Dictionary = player.feel.rules
	var old := voice.level.x
	voice.level = smoothed(player, voice.level, voice.target)
	var deeper := voice.level.x - old
	if voice.level.x >= voice.at and voice.flow.x < dt:
		var late_s := maxf(maxf(voice.flow.x, dt * (voice.at - old) / deeper if deeper > 0.0 else 0.0), 0.0)
		var name: String = voice.facts.grain if late_s > voice.flow.x else voice.facts.again
		hand.voices.append(player.grain(name, rules.grain_strength * voice.fade, late_s))
		voice.at += floorf(maxf(old + deeper * late_s / dt - voice.at, 0.0)) + 1.0
		voice.flow.x = late_s + 1.0 / rules.grains_per_s
	voice.flow.x -= dt
	var left: float = voice.at - 1.0 - voice.level.x - rules.grain_back
	if left > 0.0:
		voice.at -= floorf(left) + 1.0
	return Vector3.ZERO


## A tone and its harmonics; `fade` is its level, `at` its turns.
static func hum(player: FeelPlayer, _hand: FeelPlayer.Hand, voice: Voice, before: float, dt: float, part: PackedFloat64Array) -> Vector3:
	var pad: Dictionary = player.feel.rules.pad
	var tone := voice.facts
	var power := Vector3.ZERO
	for order in range(1, tone.drives.size() + 1):
		var hz: float = order * tone.hz
		var drive: float = tone.drives[order - 1]
		var felt := value(pad.hum_felt, place(pad.hum_hz, hz))
		power += (drive * voice.fade) ** 2 * Vector3(1.0, felt * felt, hz * hz)
		if part:
			var turn := fposmod(order * voice.at, 1.0)
			mix(part, sine, true, turn, hz / player.sound_hz, drive * before, drive * voice.fade)
	voice.at = fposmod(voice.at + tone.hz * dt, 1.0)
	return power


## Returns value and slope of a number that follows its target through two low-passes, after a step of the player.
static func smoothed(player: FeelPlayer, state: Vector2, target: float) -> Vector2:
	var distance := state.x - target
	if absf(distance) + absf(state.y) < NEGLIGIBLE:
		return Vector2(target, 0.0)
	var push := (state.y + distance) * player.smoothing
	return Vector2((distance + push) * player.decay + target, (state.y - push) * player.decay)


## Returns the place of a value on an axis: the number of the entry below it, and the share of the next one.
static func place(axis: Array, number: float) -> float:
	var below := clampi(axis.bsearch(number, false) - 1, 0, axis.size() - 2)
	return below + clampf((number - axis[below]) / (axis[below + 1] - axis[below]), 0.0, 1.0)


## Returns the value of a table at a place.
static func value(table: Array, at: float) -> float:
	var below := mini(int(at), table.size() - 2)
	return lerpf(table[below], table[below + 1], at - below)


## Adds to a loop, once, what a texture reads: by speed its rate, loudness and frequency, and by step its drive.
static func unpacked(loop: Dictionary) -> Dictionary:
	if not loop.has("reads"):
		loop.reads = PackedVector3Array(range(loop.rate.size()).map(
			func(at: int) -> Vector3: return Vector3(loop.rate[at], loop.felt[at], loop.hz[at])
		))
		loop.drives = PackedFloat64Array()
		_add(loop.drives, loop.drive.bytes, loop.drive.peak, fall)
	return loop


## Returns 1 - share of one clip and share of another: the power for a pad by step, and samples if it is heard.
static func blended(one: Dictionary, other: Dictionary, share: float, is_heard: bool) -> Dictionary:
	var clip := {"rate_hz": one.rate_hz, "seconds": maxf(one.seconds, other.seconds), "most": lerpf(one.most, other.most, share)}
	var drive := PackedFloat64Array()
	var felt := PackedFloat64Array()
	var hz := PackedFloat64Array()
	var wave := PackedFloat64Array()
	for part: Array in [[one, 1.0 - share], [other, share]]:
		if part[1] == 0.0:
			continue
		_add(drive, part[0].drive.bytes, part[1] * part[0].drive.peak, fall)
		_add(felt, part[0].felt.bytes, part[1] * part[0].felt.peak, fall)
		_add(hz, part[0].hz, part[1], hertz)
		if is_heard:
			_add(wave, part[0].wave, part[1] * part[0].peak, signed)
	felt.resize(drive.size())
	hz.resize(drive.size())
	clip.powers = PackedVector3Array()
	for at in drive.size():
		clip.powers.append(Vector3(drive[at] ** 2, felt[at] ** 2, (drive[at] * hz[at]) ** 2))
	if is_heard:
		clip.padded = PackedFloat64Array([0.0, 0.0]) + wave + PackedFloat64Array([0.0, 0.0, 0.0])
	return clip


## Adds samples of a clip to `part`, from the time `at` of it on, `pace` of its seconds for each; the gain goes from `begin` to
## `end`. A cubic through four samples is read between them. Before and after a clip there is 0; a loop goes on.
static func mix(
	part: PackedFloat64Array, clip: Dictionary, loops: bool, at: float, pace: float, begin: float, end: float
) -> void:
	if not clip.has("padded"):
		var wave := PackedFloat64Array()
		_add(wave, clip.wave, clip.peak, signed)
		clip.padded = wave.slice(-2) + wave + wave.slice(0, 3)
	var padded: PackedFloat64Array = clip.padded
	var size := padded.size() - 5
	var count := part.size()
	var gain_step := (end - begin) / count
	var step: float = pace * clip.rate_hz
	var from: float = at * clip.rate_hz + 1.0
	for sample in count:
		begin += gain_step
		if from >= size + 1:
			if not loops:
				return
			from = 1.0 + fmod(from - 1.0, size)
		if from >= 0.0:
			var i := int(from)
			part[sample] += begin * cubic_interpolate(padded[i + 1], padded[i + 2], padded[i], padded[i + 3], from - i)
		from += step


## Adds bytes, each as a table has it, times a scale.
static func _add(sums: PackedFloat64Array, bytes: PackedByteArray, scale: float, table: PackedFloat64Array) -> void:
	if sums.size() < bytes.size():
		sums.resize(bytes.size())
	for i in bytes.size():
		sums[i] += scale * table[bytes[i]]


static func _table(value_of: Callable) -> PackedFloat64Array:
	return PackedFloat64Array(range(256).map(value_of))


static func _sine() -> PackedFloat64Array:
	return PackedFloat64Array(range(37).map(func(i: int) -> float: return cos(TAU * (i - 2) / 32.0)))
