class_name FeelSynthesis
extends RefCounted
## The equations of impacts, grains and levels, without state: a port of the service's impacts.py,
## vibration_plan.py and controller_scale.py. Complex numbers are pairs of floats,
## since Vector2 has single precision.


## Returns the waveform of one impact.
static func impact(
	feel: Dictionary, facts: Dictionary, kind: String, command: Dictionary, rate: float
) -> PackedFloat64Array:
	var rules: Dictionary = feel.rules.impacts
	var draws := FeelVoices.Draws.new(feel, command.seed)
	var modes: Array[Dictionary] = []
	for mode: Dictionary in facts.impact.modes:
		var frequency: float = mode.frequency_hz * (0.985 + 0.03 * draws.next())
		var gain: float = mode.gain * (0.9 + 0.2 * draws.next())
		modes.append({"frequency_hz": frequency, "decay_per_s": mode.decay_per_s, "gain": gain})
	var force: float = command.force
	var slow := pow(maxf(command.speed, 0.05), -0.2)
	var contact: float = rules.contact_s[kind] * slow * pow(1.0 + force / rules.hard_n, -0.1)
	contact = maxf(contact, rules.shortest_s)
	var held: float = 0.7 + 0.6 * force / (force + rules.loud_force_n)
	var push: float = held * command.speed / rules.loud_speed_mps
	if kind == "press":
		push += force / rules.loud_force_n
	var log_level := interpolated(log(contact), rules.log_contact_s, facts.impact.log_level[kind])
	var level := (1.0 - exp(-push)) * exp(log_level)
	var wave := _struck(modes, contact, rules.damping[kind], rules, rate)
	var scale := level / maxf(level * peak(wave, 0, wave.size()), 1.0)
	for at in wave.size():
		wave[at] *= scale
	return wave


## Returns the waveform of one grain.
static func grain(facts: Dictionary, rules: Dictionary, rate: float) -> PackedFloat64Array:
	var mode: Dictionary = facts.merged({"gain": 1.0}, true)
	var wave := _struck([mode], rules.textures.grain_contact_s, 1.0, rules.impacts, rate)
	wave = wave.slice(0, int(rules.textures.grain_s * rate))
	for at in wave.size():
		wave[at] *= facts.gain
	return wave


## Returns the level of each of the first periods of a wave: sqrt(2) times its rms.
static func levels(wave: PackedFloat64Array, size: int, count: int) -> PackedFloat64Array:
	var values := PackedFloat64Array()
	for at in mini(wave.size() / size, count):
		var energy := 0.0
		for sample in range(at * size, (at + 1) * size):
			energy += wave[sample] * wave[sample]
		values.append(minf(sqrt(2.0 * energy / size), 1.0))
	return values


## Returns the frequency of each period: that of a sine whose samples differ as much.
static func frequencies(
	wave: PackedFloat64Array, size: int, count: int, rules: Dictionary
) -> PackedFloat64Array:
	var half: int = roundi(rules.frequency_s * rules.rate_hz) / 2
	var energy := PackedFloat64Array([0.0])
	var steps := PackedFloat64Array([0.0])
	for at in wave.size():
		var step := 0.0 if at == 0 else wave[at] - wave[at - 1]
		energy.append(energy[at] + wave[at] * wave[at])
		steps.append(steps[at] + step * step)
	var values := PackedFloat64Array()
	for at in mini(wave.size() / size, count):
		var middle := at * size + size / 2
		var begin := clampi(middle - half, 0, wave.size() - 1)
		var end := clampi(middle + half, 1, wave.size())
		var share := maxf(steps[end] - steps[begin], 0.0) / maxf(energy[end] - energy[begin], 1e-12)
		var hertz: float = asin(minf(sqrt(share) / 2.0, 1.0)) * rules.rate_hz / PI
		values.append(clampf(hertz, rules.lowest_hz, rules.highest_hz))
	return values


## Returns the drive at the carrier that feels as strong as this wave.
static func loudness(wave: PackedFloat64Array, weights: PackedFloat64Array) -> PackedFloat64Array:
	var re := wave.duplicate()
	var im := PackedFloat64Array()
	re.resize(weights.size())
	im.resize(weights.size())
	_transform(re, im)
	for bin in weights.size():
		re[bin] *= weights[bin]
		im[bin] *= weights[bin]
	_transform(im, re)  # real and imaginary parts exchanged: the inverse
	return re.slice(0, wave.size())


## Returns the weight of each bin of the transform of one plan, over the number of bins.
static func weights(rules: Dictionary) -> PackedFloat64Array:
	var rate: float = rules.plan.rate_hz
	var size := 1
	while size <= 2.0 * rules.plan.horizon_s * rate - 1.0:
		size *= 2
	var carrier := _drive_threshold(rules.plan.carrier_hz, rules.perception)
	var values := PackedFloat64Array()
	for bin in size:
		var hertz := mini(bin, size - bin) * rate / size
		var felt_db := carrier - _drive_threshold(hertz, rules.perception)
		values.append(pow(10.0, felt_db / 20.0) / size)
	return values


## Returns the amplitude, 0..1, that a controller plays for a level.
static func controller_amplitude(level: float, form: String, rules: Dictionary) -> float:
	if level < rules.min_level:
		return 0.0
	return minf(rules.scale[form] * pow(level, rules.exponent), 1.0)


## Bends a frequency into the band of touch.
static func bent(hertz: float, rules: Dictionary) -> float:
	if hertz <= rules.best_hz:
		return hertz
	var room: float = rules.highest_hz - rules.best_hz
	return rules.best_hz + room * (1.0 - exp((rules.best_hz - hertz) / rules.bend_hz))


## Returns the value at `x` of a line through points with rising `xs`.
static func interpolated(x: float, xs: Array, ys: Array) -> float:
	if x <= xs[0]:
		return ys[0]
	for after in range(1, xs.size()):
		if xs[after] > x:
			var share: float = (x - xs[after - 1]) / (xs[after] - xs[after - 1])
			return ys[after - 1] + share * (ys[after] - ys[after - 1])
	return ys[-1]


static func peak(values: PackedFloat64Array, begin: int, count: int) -> float:
	var highest := 0.0
	for at in range(begin, begin + count):
		highest = maxf(highest, absf(values[at]))
	return highest


## Returns the response of modes to one soft pulse; the equations are at the head of impacts.py.
static func _struck(
	modes: Array[Dictionary], contact: float, damping: float, rules: Dictionary, rate: float
) -> PackedFloat64Array:
	var slowest := INF
	for mode in modes:
		slowest = minf(slowest, mode.decay_per_s * damping)
	var wave := PackedFloat64Array()
	wave.resize(int(minf(contact + 6.0 / slowest, rules.longest_s) * rate))
	var count := wave.size()
	var pulse := int(contact * rate)
	var turn := TAU * rate / pulse
	for mode in modes:
		var a: float = -damping * mode.decay_per_s
		var b: float = TAU * mode.frequency_hz
		var scale: float = mode.gain * rate / (pulse * sqrt(a * a + b * b))
		var value := [0.0, 0.0]
		for at in pulse + 1:
			value = _times(a * scale, b * scale, _pushed(a, b, turn, at / rate))
			if at < mini(pulse, count):
				wave[at] += value[1]
		var size := exp(a / rate)
		var cosine := size * cos(b / rate)
		var sine := size * sin(b / rate)
		var re: float = value[0]
		var im: float = value[1]
		for at in range(pulse, count):
			wave[at] += im
			var next := re * cosine - im * sine
			im = re * sine + im * cosine
			re = next
	var fade := mini(int(rules.end_fade_s * rate), count / 2)
	for at in fade:
		wave[count - fade + at] *= 0.5 + 0.5 * cos(PI * at / maxi(fade - 1, 1))
	return wave


## Returns what a mode with the pole a + bi has answered after `time` of the pulse, [re, im].
static func _pushed(a: float, b: float, turn: float, time: float) -> Array:
	var size := exp(a * time)
	var ring_re := size * cos(b * time)
	var ring_im := size * sin(b * time)
	var swing := _times(a, b, [ring_re - cos(turn * time), ring_im])
	var below := a * a - b * b + turn * turn
	swing = _over(swing[0] + turn * sin(turn * time), swing[1], below, 2.0 * a * b)
	var built := _over(ring_re - 1.0, ring_im, a, b)
	return [built[0] - swing[0], built[1] - swing[1]]


static func _times(a: float, b: float, other: Array) -> Array:
	return [a * other[0] - b * other[1], a * other[1] + b * other[0]]


static func _over(a: float, b: float, c: float, d: float) -> Array:
	var size := c * c + d * d
	return [(a * c + b * d) / size, (b * c - a * d) / size]


## Returns the drive that is just felt, dB relative to the frequency that a palm feels best.
static func _drive_threshold(hertz: float, rules: Dictionary) -> float:
	var above := log(maxf(hertz, rules.resonance_hz) / rules.best_hz) / log(10.0)
	return _threshold(hertz, rules) - _threshold(rules.best_hz, rules) + 40.0 * above


static func _threshold(hertz: float, rules: Dictionary) -> float:
	var logs: Array = rules.threshold_hz.map(func(one: float) -> float: return log(one))
	return interpolated(log(maxf(hertz, rules.threshold_hz[0])), logs, rules.threshold_db)


## Fourier transform in place; the number of samples is a power of 2.
static func _transform(re: PackedFloat64Array, im: PackedFloat64Array) -> void:
	var count := re.size()
	var to := 0
	for at in range(1, count):
		var bit := count >> 1
		while to & bit:
			to ^= bit
			bit >>= 1
		to ^= bit
		if at < to:
			var swapped := re[at]
			re[at] = re[to]
			re[to] = swapped
			swapped = im[at]
			im[at] = im[to]
			im[to] = swapped
	var half := 1
	while half < count:
		for order in half:
			var cosine := cos(-PI * order / half)
			var sine := sin(-PI * order / half)
			for at in range(order, count, 2 * half):
				var other := at + half
				var x := re[other] * cosine - im[other] * sine
				var y := re[other] * sine + im[other] * cosine
				re[other] = re[at] - x
				im[other] = im[at] - y
				re[at] += x
				im[at] += y
		half *= 2
