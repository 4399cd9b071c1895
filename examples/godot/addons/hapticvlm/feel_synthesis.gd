class_name FeelSynthesis
extends RefCounted
## The equations of impacts, grains and levels, without state: a port of the service's impacts.py,
## vibration_plan.py and controller_scale.py.
##
## A script runs some ten million operations a second, so that whatever is done for every sample is
## done for four at once where the engine has an operation for it: a Vector4 has four samples or four
## modes, a Projection times a Vector4 is sixteen products, and a sort finds the extremes of an array.

const LANES := 4  # numbers of a Vector4
const ONES := Vector4.ONE
const REACH := 128  # samples on each side of the loudness filter; a multiple of LANES
const PHASES := 256  # places between two samples of a loop
const STRIDE := 2  # the loudness filter gives every second sample: it passes nothing above 1 kHz


## Returns the waveform of one impact.
static func impact(
	feel: Dictionary, facts: Dictionary, kind: String, command: Dictionary, rate: float
) -> PackedFloat64Array:
	var rules: Dictionary = feel.rules.impacts
	var draws := FeelVoices.Draws.new(feel, command.seed)
	var modes: Array[Dictionary] = []
	for mode: Dictionary in facts.impact.modes:
		var pitch: float = 2.0 * draws.next() - 1.0
		var frequency: float = mode.frequency_hz * (1.0 + rules.pitch_varies * pitch)
		var drawn: float = 2.0 * draws.next() - 1.0
		var placed: float = pow(10.0, rules.place_db / 20.0 * drawn)
		var gain: float = mode.gain * (placed if modes else 1.0 + rules.gain_varies * drawn)
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
	var scale := level / maxf(level * peak(wave), 1.0)
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


## Returns the energy of a wave before each sample, and of all of it: one number more than samples.
static func energies(wave: PackedFloat64Array) -> PackedFloat64Array:
	var values := PackedFloat64Array()
	values.resize(wave.size() + 1)
	var total := 0.0
	for at in wave.size():
		var sample := wave[at]
		total += sample * sample
		values[at + 1] = total
	return values


## Returns the energy of the steps from sample to sample before each sample, and of all of them.
static func step_energies(wave: PackedFloat64Array) -> PackedFloat64Array:
	var values := PackedFloat64Array()
	values.resize(wave.size() + 1)
	var total := 0.0
	var before := wave[0]
	for at in wave.size():
		var sample := wave[at]
		total += (sample - before) * (sample - before)
		before = sample
		values[at + 1] = total
	return values


## Returns the level of each of the first periods of a wave, sqrt(2) times its rms, from the energies
## of every sample of it, or of every second one (`stride` 2). Such a sample stands for its neighbours'
## nearer halves, too, so that a period may begin between two.
static func levels(
	energy: PackedFloat64Array, size: int, count: int, stride: int
) -> PackedFloat64Array:
	var values := PackedFloat64Array()
	var before := 0.0
	for at in count + 1:
		var place := (at * size + 0.5 * (stride - 1)) / stride
		var whole := mini(int(place), energy.size() - 2)
		var until := lerpf(energy[whole], energy[whole + 1], minf(place - whole, 1.0))
		if at > 0:
			values.append(minf(sqrt(2.0 * stride * (until - before) / size), 1.0))
		before = until
	return values


## Returns the frequency of each period: that of a sine whose samples differ as much.
static func frequencies(
	energy: PackedFloat64Array, steps: PackedFloat64Array, size: int, count: int, rules: Dictionary
) -> PackedFloat64Array:
	var half: int = roundi(rules.frequency_s * rules.rate_hz) / 2
	var samples := energy.size() - 1
	var values := PackedFloat64Array()
	for at in mini(samples / size, count):
		var middle := at * size + size / 2
		var begin := clampi(middle - half, 0, samples - 1)
		var end := clampi(middle + half, 1, samples)
		var share := maxf(steps[end] - steps[begin], 0.0) / maxf(energy[end] - energy[begin], 1e-12)
		var hertz: float = asin(minf(sqrt(share) / 2.0, 1.0)) * rules.rate_hz / PI
		values.append(clampf(hertz, rules.lowest_hz, rules.highest_hz))
	return values


## Returns every second sample of the drive at the carrier that feels as strong as this wave.
## `filter` is that of `loudness_filter`.
static func loudness(wave: PackedFloat64Array, filter: Array[Projection]) -> PackedFloat64Array:
	var padded := PackedFloat64Array()
	padded.resize(REACH)
	padded.append_array(wave)
	padded.resize(padded.size() + REACH + 2 * STRIDE * LANES)
	var input := PackedVector4Array()
	for at in range(0, padded.size() - LANES + 1, LANES):
		input.append(Vector4(padded[at], padded[at + 1], padded[at + 2], padded[at + 3]))
	var drive := PackedFloat64Array()
	for first in range(0, ceili(float(wave.size()) / LANES), STRIDE):
		var output := Vector4.ZERO
		var at := first
		for part in filter:
			output += part * input[at]
			at += 1
		drive.append(output.x)
		drive.append(output.y)
		drive.append(output.z)
		drive.append(output.w)
	return drive.slice(0, ceili(float(wave.size()) / STRIDE))


## Returns the filter from a wave to the drive at the carrier that feels as strong: its gain at each
## frequency is that of `_drive_threshold`, its delay is none.
##
## Part j gives, from four samples of the wave, their share in four samples of the drive: number r of
## them is at sample STRIDE * r, and number c of the wave at LANES * j + c - REACH. The response is
## cut REACH samples from its middle.
static func loudness_filter(rules: Dictionary) -> Array[Projection]:
	var response := _loudness_response(rules)
	var parts: Array[Projection] = []
	for j in (2 * REACH + STRIDE * LANES) / LANES:
		var columns: Array[Vector4] = []
		for c in LANES:
			var column := Vector4.ZERO
			for r in LANES:
				var lag := absi(LANES * j + c - REACH - STRIDE * r)
				column[r] = response[lag] if lag <= REACH else 0.0
			columns.append(column)
		parts.append(Projection(columns[0], columns[1], columns[2], columns[3]))
	return parts


## Returns the response of the loudness filter at lags of 0 to REACH samples.
static func _loudness_response(rules: Dictionary) -> PackedFloat64Array:
	var bins := 128  # of half the circle
	var cosines := PackedFloat64Array()
	for at in 2 * bins:
		cosines.append(cos(PI * at / bins))
	var carrier := _drive_threshold(rules.plan.carrier_hz, rules.perception)
	var response := PackedFloat64Array()
	response.resize(REACH + 1)
	for bin in bins + 1:
		var hertz: float = 0.5 * rules.plan.rate_hz * bin / bins
		var gain := pow(10.0, (carrier - _drive_threshold(hertz, rules.perception)) / 20.0)
		if gain < 1e-4:
			continue
		gain *= (0.5 if bin == 0 or bin == bins else 1.0) / bins
		for lag in REACH + 1:
			response[lag] += gain * cosines[bin * lag % (2 * bins)]
	return response


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


## Returns the shares of four samples in the cubic through them, at each of PHASES places between
## the second and the third.
static func cubic_shares() -> PackedVector4Array:
	var shares := PackedVector4Array()
	for phase in PHASES:
		var t := (phase + 0.5) / PHASES
		var near := 1.0 + t * t * (1.5 * t - 2.5)
		var far := t * (0.5 + t * (2.0 - 1.5 * t))
		shares.append(Vector4(-0.5 * t * (1.0 - t) * (1.0 - t), near, far, 0.5 * t * t * (t - 1.0)))
	return shares


## Returns the largest absolute value; 0 if there are none.
static func peak(values: PackedFloat64Array) -> float:
	if values.is_empty():
		return 0.0
	var sorted := values.duplicate()
	sorted.sort()
	return maxf(-sorted[0], sorted[-1])


## Returns the response of modes to one soft pulse; the equations are at the head of impacts.py.
##
## After the pulse each mode rings alone. Samples of a decaying sine are 2 d cos(w) times the one
## before less d^2 times the one before that, so four modes ring in two products of vectors.
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
	for first in range(0, modes.size(), LANES):
		var now := Vector4.ZERO
		var next := Vector4.ZERO
		var ring := Vector4.ZERO
		var fall := Vector4.ZERO
		for lane in mini(LANES, modes.size() - first):
			var mode := modes[first + lane]
			var a: float = -damping * mode.decay_per_s
			var b: float = TAU * mode.frequency_hz
			var pushed := _pushed(wave, a, b, mode.gain, pulse, rate)
			var size := exp(a / rate)
			now[lane] = pushed[1]
			next[lane] = size * (pushed[0] * sin(b / rate) + pushed[1] * cos(b / rate))
			ring[lane] = 2.0 * size * cos(b / rate)
			fall[lane] = size * size
		for at in range(pulse, count):
			wave[at] += now.dot(ONES)
			var later := ring * next - fall * now
			now = next
			next = later
	var fade := mini(int(rules.end_fade_s * rate), count / 2)
	for at in fade:
		wave[count - fade + at] *= 0.5 + 0.5 * cos(PI * at / maxi(fade - 1, 1))
	return wave


## Adds what a mode with the pole s = a + bi answers during the pulse, and returns its complex
## answer at the end, [re, im]. With v = 2 pi / contact it is, at the time t, s times
## (e^(st) - 1) / s - (s (e^(st) - cos(vt)) + v sin(vt)) / (s^2 + v^2), scaled.
static func _pushed(
	wave: PackedFloat64Array, a: float, b: float, gain: float, pulse: int, rate: float
) -> Array[float]:
	var turn := TAU * rate / pulse
	var length := a * a + b * b
	var scale := gain * rate / (pulse * sqrt(length))
	var below_re := a * a - b * b + turn * turn
	var below_im := 2.0 * a * b
	var below := below_re * below_re + below_im * below_im
	var re := 0.0
	var im := 0.0
	for at in pulse + 1:
		var time := at / rate
		var size := exp(a * time)
		var ring_re := size * cos(b * time)
		var ring_im := size * sin(b * time)
		var apart := ring_re - cos(turn * time)
		var swing_re := a * apart - b * ring_im + turn * sin(turn * time)
		var swing_im := b * apart + a * ring_im
		var push_re := ((ring_re - 1.0) * a + ring_im * b) / length
		var push_im := (ring_im * a - (ring_re - 1.0) * b) / length
		push_re -= (swing_re * below_re + swing_im * below_im) / below
		push_im -= (swing_im * below_re - swing_re * below_im) / below
		re = scale * (a * push_re - b * push_im)
		im = scale * (a * push_im + b * push_re)
		if at < mini(pulse, wave.size()):
			wave[at] += im
	return [re, im]


## Returns the drive that is just felt, dB relative to the frequency that a palm feels best.
static func _drive_threshold(hertz: float, rules: Dictionary) -> float:
	var above := log(maxf(hertz, rules.resonance_hz) / rules.best_hz) / log(10.0)
	return _threshold(hertz, rules) - _threshold(rules.best_hz, rules) + 40.0 * above


static func _threshold(hertz: float, rules: Dictionary) -> float:
	var logs: Array = rules.threshold_hz.map(func(one: float) -> float: return log(one))
	return interpolated(log(maxf(hertz, rules.threshold_hz[0])), logs, rules.threshold_db)
