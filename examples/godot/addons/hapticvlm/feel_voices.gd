class_name FeelVoices
extends RefCounted
## The voices of one hand from `feel.json`: a port of the service's rendering/vibration.
##
## Holds the equations; every figure is in the file. `feel` is what `FeelPlayer.open` returns. A
## command is a dictionary of material, interaction, onset, speed, force, seed, expires_at, gain,
## thickness (or null) and hum (or null).

const IMPACTS: Array[String] = ["tap", "strike", "press"]
const TEXTURES: Array[String] = ["slide", "carve", "swing"]
const NEGLIGIBLE := 1e-6
const SEGMENT := 8  # samples along which what is smoothed changes in a line: 2 ms of a plan
const TURN := 256  # samples of one turn of a hum

var _feel: Dictionary
var _rate: float
var _voices: Array[Voice] = []
var _texture: Variant = null
var _press: Variant = null
var _hum: Variant = null
var _expires_at := -INF
var _limiter: Limiter


func _init(feel: Dictionary, rate: float) -> void:
	_feel = feel
	_rate = rate
	_limiter = Limiter.new(feel.rules.voices, rate)


func fork() -> FeelVoices:
	var forked := FeelVoices.new(_feel, _rate)
	for voice in _voices:
		forked._voices.append(voice.fork())
	forked._texture = _texture
	forked._press = _press
	forked._hum = _hum
	forked._expires_at = _expires_at
	forked._limiter = _limiter.fork()
	return forked


func is_silent() -> bool:
	var idle := _voices.is_empty() and _texture == null and _press == null and _hum == null
	return idle and _limiter.is_empty()


func silence() -> void:
	rest()
	_voices.clear()
	_limiter = Limiter.new(_feel.rules.voices, _rate)


## Fades what sounds; an impact that has not begun is dropped.
func rest() -> void:
	_texture = null
	_press = null
	_hum = null
	_expires_at = -INF
	_voices.assign(_voices.filter(func(voice: Voice) -> bool: return not voice.begins()))
	for voice in _voices:
		voice.aim = 0.0


## Returns the impacts that begin in the next block.
func beginning() -> Array[Voice]:
	var impacts: Array[Voice] = []
	impacts.assign(_voices.filter(func(voice: Voice) -> bool: return voice.begins()))
	return impacts


func apply(command: Dictionary) -> void:
	_expires_at = command.expires_at
	_hum = command.hum
	var facts: Variant = _feel.materials.get(command.material)
	if facts == null:
		_texture = null
		_press = null
		return
	var yields: bool = facts.press_n_per_grain != null
	_press = command if command.interaction == "press" and yields else null
	if command.onset and command.interaction != "swing":
		_strike(command, facts)
	var is_held: bool = command.onset or command.interaction in IMPACTS
	_texture = command if command.interaction in TEXTURES or not is_held else null


## Returns the next `count` samples, -1..1; `now` is the time of the first.
func render(count: int, now: float) -> PackedFloat64Array:
	var wave := PackedFloat64Array()
	if is_silent():
		wave.resize(count)
		return wave
	var chunk := int(_feel.rules.voices.chunk)
	for begin in range(0, count, chunk):
		wave.append_array(_mix(mini(chunk, count - begin), now + begin / _rate))
	return wave


func _mix(count: int, now: float) -> PackedFloat64Array:
	if not _expires_at >= now:
		rest()
	_follow_texture()
	_follow_press()
	_follow_hum()
	var part := PackedFloat64Array()
	var step: float = 1.0 / (_feel.rules.voices.fade_s * _rate)
	for voice in _voices:
		var block := voice.render(count, step)
		if part.is_empty():
			part = block
			continue
		for at in count:
			part[at] += block[at]
	part.resize(count)
	_voices.assign(_voices.filter(func(voice: Voice) -> bool: return not voice.ended))
	return _limiter.apply(part)


func _of_kinds(kinds: Array[String]) -> Array[Voice]:
	var some: Array[Voice] = []
	some.assign(_voices.filter(func(voice: Voice) -> bool: return voice.kind in kinds))
	return some


func _strike(command: Dictionary, facts: Dictionary) -> void:
	var impacts := _of_kinds(IMPACTS)
	if impacts.size() >= _feel.rules.voices.max_impacts:
		return
	var loud := impacts.filter(func(voice: Voice) -> bool: return voice.aim > 0.0)
	if loud.size() >= _feel.rules.voices.max_ringing:
		loud[0].aim = 0.0
	var kind: String = command.interaction if command.interaction in IMPACTS else "tap"
	var wave := FeelSynthesis.impact(_feel, facts, kind, command, _rate)
	_voices.append(Voice.new(Played.new(wave), command, kind, command.gain, command.gain))


func _follow_texture() -> void:
	var textures := _of_kinds(TEXTURES)
	for voice in textures:
		voice.aim = 0.0
	if _texture == null:
		return
	var command: Dictionary = _texture
	var kind: String = command.interaction if command.interaction in TEXTURES else "slide"
	var current: Voice = null
	for voice in textures:
		if voice.is_of(command, kind) and voice.thickness == command.thickness:
			current = voice
	if current != null:
		current.motion = command
		current.aim = command.gain
	elif textures.size() <= _feel.rules.voices.max_fading_textures:
		var source := Relief.new(_feel, kind, command, _rate)
		_voices.append(Voice.new(source, command, kind, 0.0, command.gain))


func _follow_press() -> void:
	var current: Voice = null
	for voice in _of_kinds(["grains"]):
		voice.aim = 0.0
		if _press != null and voice.is_of(_press, "grains") and current == null:
			current = voice
	if _press == null:
		return
	if current == null:
		var source := Grains.new(_feel, _press, _rate)
		current = Voice.new(source, _press, "grains", _press.gain, _press.gain)
		_voices.append(current)
	current.motion = _press
	current.aim = _press.gain


func _follow_hum() -> void:
	var humming := _of_kinds(["hum"])
	for voice in humming:
		voice.aim = 0.0 if _hum == null else _hum.level
		if _hum != null:
			voice.source.hum = _hum
	if _hum != null and humming.is_empty():
		var source := Tone.new(_feel.rules, _hum, _rate)
		_voices.append(Voice.new(source, {}, "hum", 0.0, _hum.level))


## One source with a gain that fades towards `aim`.
class Voice:
	var source: RefCounted
	var motion: Dictionary
	var material: Variant
	var thickness: Variant
	var kind: String
	var gain: float
	var aim: float
	var ended := false

	func _init(of: RefCounted, command: Dictionary, as_kind: String, at: float, to: float) -> void:
		source = of
		motion = command
		material = command.get("material")
		thickness = command.get("thickness")
		kind = as_kind
		gain = at
		aim = to

	func begins() -> bool:
		return source is Played and source.at == 0

	func is_of(command: Dictionary, as_kind: String) -> bool:
		return material == command.material and kind == as_kind

	func fork() -> Voice:
		var forked := Voice.new(source.fork(), motion, kind, gain, aim)
		forked.material = material
		forked.thickness = thickness
		return forked

	func render(count: int, step: float) -> PackedFloat64Array:
		var block: PackedFloat64Array = source.render(count, motion)
		if gain != 1.0 or aim != 1.0:
			for at in count:
				gain = move_toward(gain, aim, step)
				block[at] *= gain
		ended = source.has_ended() or (gain == 0.0 and aim == 0.0)
		return block


## An impact that was computed as a whole.
class Played:
	var at := 0
	var peak: float
	var _wave: PackedFloat64Array

	func _init(wave: PackedFloat64Array) -> void:
		_wave = wave
		peak = FeelSynthesis.peak(wave)

	func has_ended() -> bool:
		return at >= _wave.size()

	func fork() -> Played:
		var forked := Played.new(PackedFloat64Array())
		forked.at = at
		forked.peak = peak
		forked._wave = _wave
		return forked

	func render(count: int, _motion: Dictionary) -> PackedFloat64Array:
		var block := _wave.slice(at, at + count)
		block.resize(count)
		at += count
		return block


## Sliding, carving and swinging.
class Relief:
	var _kind: String
	var _rules: Dictionary
	var _roughness: float
	var _period: float
	var _stick: float
	var _surface: Reader
	var _slips: Reader
	var _breaks: Breaks

	func _init(feel: Dictionary, kind: String, command: Dictionary, rate: float) -> void:
		if feel.is_empty():
			return
		var facts: Dictionary = feel.materials[command.material]
		var draws := Draws.new(feel, command.seed)
		_kind = kind
		_rules = feel.rules.textures
		var swings := kind == "swing"
		var thickness: float = facts.swing.thickness_m
		if command.thickness != null:
			thickness = command.thickness
		_roughness = 1.0 if swings else facts.slide.roughness
		_period = thickness / _rules.strouhal if swings else facts.slide.period_m
		_stick = {"slide": facts.slide.stick, "carve": facts.carve.stick, "swing": 0.0}[kind]
		var loop: Dictionary = facts.swing.loop if swings else facts.slide.loop
		_surface = Reader.new(loop, draws.next(), feel.rules, rate)
		if _stick > 0.0:
			_slips = Reader.new(feel.slips, draws.next(), feel.rules, rate)
		if kind == "carve" and facts.carve.fibre_m != null:
			_breaks = Breaks.new(facts, draws, feel.rules, rate)

	func has_ended() -> bool:
		return false

	func fork() -> Relief:
		var forked := Relief.new({}, "", {}, 0.0)
		forked._kind = _kind
		forked._rules = _rules
		forked._roughness = _roughness
		forked._period = _period
		forked._stick = _stick
		forked._surface = _surface.fork()
		forked._slips = null if _slips == null else _slips.fork()
		forked._breaks = null if _breaks == null else _breaks.fork()
		return forked

	func render(count: int, motion: Dictionary) -> PackedFloat64Array:
		var speed: float = motion.speed
		var moved := _share(speed, motion.force)
		var caught := _caught(speed, motion.force)
		var centre := maxf(FeelSynthesis.bent(speed / _period, _rules), _rules.lowest_hz)
		var wave := _surface.read(count, centre, moved * _roughness * sqrt(1.0 - caught * caught))
		if _slips != null:
			var limits: Array = _rules.slips_hz
			var slips_hz := clampf(speed / _rules.slip_m, limits[0], limits[1])
			var slips := _slips.read(count, slips_hz, moved * caught)
			for at in count:
				wave[at] += slips[at]
		if _breaks != null:
			var breaks := _breaks.render(count, moved, speed)
			for at in count:
				wave[at] = _rules.carve_rub * wave[at] + breaks[at]
		return wave

	func _share(speed: float, force: float) -> float:
		if _kind == "swing":
			return 1.0 - exp(-speed * speed / (_rules.swing_speed_mps * _rules.swing_speed_mps))
		var pressed: float = 0.3 + 0.7 * force / (force + _rules.light_force_n)
		return pressed * speed / (speed + _rules.slow_speed_mps)

	func _caught(speed: float, force: float) -> float:
		var held: float = _stick * force / (force + _rules.stuck_n)
		var limit: float = _rules.catch_mps * held
		return 0.0 if limit == 0.0 else held * limit * limit / (limit * limit + speed * speed)


## Reads a loop at a rate and a level that follow their targets.
class Reader:
	var _loop: Dictionary
	var _rules: Dictionary
	var _rate: float
	var _at: float
	var _centre: Smoothed
	var _level: Smoothed

	func _init(loop: Dictionary, place: float, rules: Dictionary, rate: float) -> void:
		_loop = loop
		_rules = rules
		_rate = rate
		_at = place * loop.count
		_level = Smoothed.new(0.0, rules, rate)

	func fork() -> Reader:
		var forked := Reader.new(_loop, 0.0, _rules, _rate)
		forked._at = _at
		forked._centre = null if _centre == null else _centre.fork()
		forked._level = _level.fork()
		return forked

	func read(count: int, centre: float, strength: float) -> PackedFloat64Array:
		if _centre == null:
			_centre = Smoothed.new(centre, _rules, _rate)
		var drive := FeelSynthesis.interpolated(centre, _rules.textures.grid_hz, _loop.drive)
		var target: float = _rules.textures.rms * strength * drive * _loop.step
		var per_hz: float = _loop.samples / _rate
		var samples: PackedByteArray = _loop.padded
		var shares: PackedVector4Array = _rules.cubic_shares
		var phases := float(FeelSynthesis.PHASES)
		var size: float = _loop.count
		var wave := PackedFloat64Array()
		wave.resize(count)
		var at := _at
		for begin in range(0, count, SEGMENT):
			var length := mini(SEGMENT, count - begin)
			var pace := _centre.value * per_hz
			var level := _level.value
			var pace_step := (_centre.after(centre, length) * per_hz - pace) / length
			var level_step := (_level.after(target, length) - level) / length
			for sample in range(begin, begin + length):
				pace += pace_step
				level += level_step
				at += pace
				if at >= size:
					at -= size
				var i := int(at)
				var four := Vector4(
					samples.decode_s8(i),
					samples.decode_s8(i + 1),
					samples.decode_s8(i + 2),
					samples.decode_s8(i + 3)
				)
				wave[sample] = four.dot(shares[int(phases * (at - i))]) * level
		_at = at
		return wave


## Fibre breaks under a blade.
class Breaks:
	var _draws: Draws
	var _rate: float
	var _spacing: float
	var _limits_hz: Array
	var _grain: PackedFloat64Array
	var _tail: PackedFloat64Array
	var _to_next: float  # in mean spacings
	var _level: Smoothed

	func _init(facts: Dictionary, draws: Draws, rules: Dictionary, rate: float) -> void:
		if facts.is_empty():
			return
		_draws = draws
		_rate = rate
		_spacing = facts.carve.fibre_m
		_limits_hz = rules.textures.breaks_hz
		_grain = FeelSynthesis.grain(facts.grain, rules, rate)
		_tail.resize(_grain.size())
		_to_next = draws.next()
		_level = Smoothed.new(0.0, rules, rate)

	func fork() -> Breaks:
		var forked := Breaks.new({}, null, {}, 0.0)
		forked._draws = _draws.fork()
		forked._rate = _rate
		forked._spacing = _spacing
		forked._limits_hz = _limits_hz
		forked._grain = _grain
		forked._tail = _tail.duplicate()
		forked._to_next = _to_next
		forked._level = _level.fork()
		return forked

	func render(count: int, target: float, speed: float) -> PackedFloat64Array:
		var level := _level.block(target, count)
		var wave := _tail.duplicate()
		wave.resize(count + _grain.size())
		var hertz := clampf(speed / _spacing, _limits_hz[0], _limits_hz[1])
		var per_sample := hertz / _rate if speed > 0.0 else 0.0
		_to_next -= per_sample * count
		while _to_next < 0.0:
			var begin := maxi(count + floori(_to_next / per_sample), 0)
			var strength := (0.4 + 0.6 * _draws.next()) * level[begin]
			for at in _grain.size():
				wave[begin + at] += strength * _grain[at]
			_to_next += 0.5 + _draws.next()
		_tail = wave.slice(count)
		return wave.slice(0, count)


## A press on something that yields.
class Grains:
	var _per_grain: float
	var _grain: PackedFloat64Array
	var _gap: int
	var _back: float
	var _tail: PackedFloat64Array
	var _depth: Smoothed
	var _next: float
	var _rest := 0

	func _init(feel: Dictionary, command: Dictionary, rate: float) -> void:
		if feel.is_empty():
			return
		var facts: Dictionary = feel.materials[command.material]
		_per_grain = facts.press_n_per_grain
		_grain = FeelSynthesis.grain(facts.grain, feel.rules, rate)
		for at in _grain.size():
			_grain[at] *= feel.rules.press.strength
		_gap = roundi(rate / feel.rules.press.max_rate_hz)
		_back = feel.rules.press.back
		_tail.resize(_grain.size())
		_depth = Smoothed.new(0.0, feel.rules, rate)
		_next = 0.3 + 0.4 * Draws.new(feel, command.seed).next()

	func has_ended() -> bool:
		return false

	func fork() -> Grains:
		var forked := Grains.new({}, {}, 0.0)
		forked._per_grain = _per_grain
		forked._grain = _grain
		forked._gap = _gap
		forked._back = _back
		forked._tail = _tail.duplicate()
		forked._depth = _depth.fork()
		forked._next = _next
		forked._rest = _rest
		return forked

	func render(count: int, motion: Dictionary) -> PackedFloat64Array:
		var wave := _tail.duplicate()
		wave.resize(count + _grain.size())
		var depth := _depth.block(motion.force / _per_grain, count)
		var at := _rest
		while at < count:
			if depth[at] < _next:
				at += 1
				continue
			for after in _grain.size():
				wave[at + after] += _grain[after]
			_next += floorf(depth[at] - _next) + 1.0
			_rest = at + _gap
			at = _rest
		var left := _next - 1.0 - depth[count - 1] - _back
		if left > 0.0:
			_next -= floorf(left) + 1.0
		_rest = maxi(_rest - count, 0)
		_tail = wave.slice(count)
		return wave.slice(0, count)


## The hum of a thing that runs: {frequency_hz, level, drives}.
class Tone:
	var hum: Dictionary
	var _rate: float
	var _turns := 0.0
	var _pitch: Smoothed
	var _drives: Array = []
	var _turn := PackedFloat64Array()  # one turn of the drives, and its first sample again

	func _init(rules: Dictionary, of: Dictionary, rate: float) -> void:
		hum = of
		_rate = rate
		if not rules.is_empty():
			_pitch = Smoothed.new(of.frequency_hz, rules, rate)

	func has_ended() -> bool:
		return false

	func fork() -> Tone:
		var forked := Tone.new({}, hum, _rate)
		forked._turns = _turns
		forked._pitch = _pitch.fork()
		forked._drives = _drives
		forked._turn = _turn
		return forked

	func render(count: int, _motion: Dictionary) -> PackedFloat64Array:
		if _drives != hum.drives:
			_draw()
		var wave := PackedFloat64Array()
		wave.resize(count)
		var pitch := _pitch.block(hum.frequency_hz, count)
		for at in count:
			_turns = fmod(_turns + pitch[at] / _rate, 1.0)
			var place := TURN * _turns
			var whole := int(place)
			wave[at] = lerpf(_turn[whole], _turn[whole + 1], place - whole)
		return wave

	func _draw() -> void:
		_drives = hum.drives
		_turn = PackedFloat64Array()
		_turn.resize(TURN + 1)
		for order in _drives.size():
			for at in TURN + 1:
				_turn[at] += _drives[order] * sin(TAU * (order + 1) * at / TURN)


## A value that follows its target through two low-passes, in steps of any length.
class Smoothed:
	var value: float
	var _slope := 0.0
	var _time: float
	var _segment_decay: float

	func _init(begin: float, rules: Dictionary, rate: float) -> void:
		value = begin
		if not rules.is_empty():
			_time = 1.0 / (rules.voices.smooth_s * rate)
			_segment_decay = exp(-SEGMENT * _time)

	func fork() -> Smoothed:
		var forked := Smoothed.new(value, {}, 0.0)
		forked._slope = _slope
		forked._time = _time
		forked._segment_decay = _segment_decay
		return forked

	func is_at(target: float) -> bool:
		return value == target and _slope == 0.0

	## Returns the value after so many samples.
	func after(target: float, count: int) -> float:
		var distance := value - target
		if distance == 0.0 and _slope == 0.0:
			return value
		var time := count * _time
		var decay := _segment_decay if count == SEGMENT else exp(-time)
		var push := _slope + distance
		value = target + (distance + push * time) * decay
		_slope = (_slope - push * time) * decay
		_settle(target)
		return value

	## Returns the value after each of the next samples.
	func block(target: float, count: int) -> PackedFloat64Array:
		var values := PackedFloat64Array()
		values.resize(count)
		if is_at(target):
			values.fill(target)
			return values
		var distance := value - target
		var decay := exp(-_time)
		for at in count:
			var push := _slope + distance
			distance = (distance + push * _time) * decay
			_slope = (_slope - push * _time) * decay
			values[at] = target + distance
		value = target + distance
		_settle(target)
		return values

	func _settle(target: float) -> void:
		if absf(value - target) < NEGLIGIBLE and absf(_slope) < NEGLIGIBLE:
			value = target
			_slope = 0.0


## Keeps a sequence of blocks within the ceiling, with look-ahead.
class Limiter:
	var _rules: Dictionary
	var _rate: float
	var _delay: int
	var _fall: float
	var _window := PackedFloat64Array()
	var _delayed := PackedFloat64Array()
	var _reductions := PackedFloat64Array()

	func _init(rules: Dictionary, rate: float) -> void:
		_rules = rules
		_rate = rate
		_delay = roundi(rules.delay_s * rate)
		_fall = exp(-1.0 / (rules.release_s * rate))
		var total := 0.0
		for at in _delay + 1:
			_window.append(sin(PI * (at + 1) / (_delay + 2)))
			total += _window[at]
		for at in _delay + 1:
			_window[at] /= total
		_delayed.resize(_delay)
		_reductions.resize(2 * _delay)

	func is_empty() -> bool:
		return FeelSynthesis.peak(_delayed) == 0.0

	func fork() -> Limiter:
		var forked := Limiter.new(_rules, _rate)
		forked._delayed = _delayed.duplicate()
		forked._reductions = _reductions.duplicate()
		return forked

	func apply(part: PackedFloat64Array) -> PackedFloat64Array:
		var count := part.size()
		var loudest := FeelSynthesis.peak(part)
		var earlier := FeelSynthesis.peak(_reductions)
		var line := _delayed.duplicate()
		line.append_array(part)
		_delayed = line.slice(count)
		var played := line.slice(0, count)
		if loudest <= _rules.ceiling and earlier == 0.0:
			return played
		var needs := _reductions.duplicate()
		for at in count:
			var needed: float = 1.0 - _rules.ceiling / maxf(absf(line[_delay + at]), _rules.ceiling)
			needs.append(maxf(needed, needs[2 * _delay + at - 1] * _fall))
		_reductions = needs.slice(count)
		if FeelSynthesis.peak(_reductions) < NEGLIGIBLE:
			_reductions.fill(0.0)
		var held := PackedFloat64Array()
		for at in count + _delay:
			held.append(FeelSynthesis.peak(needs.slice(at, at + _delay + 1)))
		for at in count:
			var reduction := 0.0
			for after in _delay + 1:
				reduction += _window[after] * held[at + after]
			played[at] *= 1.0 - reduction
		return played


## The random numbers of one seed, as the service draws them.
class Draws:
	var _drawn: PackedByteArray
	var _begin: int
	var _count: int
	var _next := 0

	func _init(feel: Dictionary, of: int) -> void:
		if feel.is_empty():
			return
		_drawn = feel.drawn
		_count = _drawn.size() / 2 / int(feel.seeds)
		_begin = of % int(feel.seeds) * _count

	func fork() -> Draws:
		var forked := Draws.new({}, 0)
		forked._drawn = _drawn
		forked._begin = _begin
		forked._count = _count
		forked._next = _next
		return forked

	func next() -> float:
		_next += 1
		return (_drawn.decode_u16(2 * (_begin + (_next - 1) % _count)) + 0.5) / 65536.0
