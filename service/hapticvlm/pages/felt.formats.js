// Writes a felt moment as files of other tools: WAV, `.haptic` (Meta Haptics SDK), `.ahap` (Apple Core Haptics) and ZIP. Pure.
//
// A moment is {material, interaction, samples, rateHz}: the true voice, -1..1. The formats and the fit of their points are
// those of hapticvlm/touches (clip.py, haptic.py, ahap.py), which explain them; a test compares the two.

const STEP_S = 0.005;
const WINDOW_S = 0.02;
const ROUNDS = 12;
const MAX_GAIN = 4;
const FREQUENCY_S = 0.015;
const HEARD_HZ = { low: 20, high: 1000 };
const RANGE_HZ = { low: 55, high: 200 }; // of a Quest controller
const MAX_POINTS = 16; // of a curve
const MAX_EVENT_S = 30;

// Returns samples (-1..1) as a 16-bit mono WAV file.
export function wav(samples, rateHz) {
  const view = new DataView(new ArrayBuffer(44 + 2 * samples.length));
  const name = (at, letters) => [...letters].forEach((letter, index) => view.setUint8(at + index, letter.charCodeAt(0)));
  name(0, "RIFF");
  view.setUint32(4, 36 + 2 * samples.length, true);
  name(8, "WAVEfmt ");
  [[16, 16, 4], [20, 1, 2], [22, 1, 2], [24, rateHz, 4], [28, 2 * rateHz, 4], [32, 2, 2], [34, 16, 2]].forEach(([at, value, size]) => (size === 4 ? view.setUint32(at, value, true) : view.setUint16(at, value, true)));
  name(36, "data");
  view.setUint32(40, 2 * samples.length, true);
  samples.forEach((sample, index) => view.setInt16(44 + 2 * index, 32767 * Math.min(1, Math.max(-1, sample)), true));
  return new Uint8Array(view.buffer);
}

// Returns {samples, rateHz} of a 16-bit mono WAV file; chunks besides `fmt ` and `data` are skipped. Throws Error.
export function unwav(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const nameAt = (at) => String.fromCharCode(...bytes.subarray(at, at + 4));
  let rateHz = null;
  for (let at = 12; at + 8 <= bytes.length; at += 8 + view.getUint32(at + 4, true)) {
    if (nameAt(at) === "fmt ") rateHz = view.getUint32(at + 12, true);
    if (nameAt(at) !== "data") continue;
    const count = Math.min(view.getUint32(at + 4, true), bytes.length - at - 8) >> 1;
    return { rateHz, samples: Float32Array.from({ length: count }, (_, index) => view.getInt16(at + 8 + 2 * index, true) / 32767) };
  }
  throw new Error("its sound is not a WAV file");
}

export function haptic(moment) {
  const { material, interaction } = moment;
  const amplitude = points(moment);
  const frequency = frequencies(moment);
  const envelope = (name, values) => values.map((value, index) => ({ time: round(index * STEP_S, 3), [name]: round(value, 4) }));
  return {
    version: { major: 1, minor: 0, patch: 0 },
    metadata: { editor: "HapticVLM", author: "", source: "", project: "", tags: [material, interaction], description: `${interaction} on ${material}` },
    signals: { continuous: { envelopes: { amplitude: envelope("amplitude", amplitude), frequency: envelope("frequency", frequency) } } },
  };
}

export function ahap(moment) {
  const intensity = points(moment, 2);
  const sharpness = frequencies(moment).map(Math.sqrt);
  const lasts = (intensity.length - 1) * STEP_S;
  const events = [];
  for (let begin = 0; begin < lasts; begin += MAX_EVENT_S) {
    events.push({
      Event: {
        EventType: "HapticContinuous", Time: begin, EventDuration: round(Math.min(MAX_EVENT_S, lasts - begin), 3),
        EventParameters: [{ ParameterID: "HapticIntensity", ParameterValue: 1 }, { ParameterID: "HapticSharpness", ParameterValue: 0 }],
      },
    });
  }
  const description = `${moment.interaction} on ${moment.material}, by HapticVLM`;
  return { Version: 1, Metadata: { Description: description }, Pattern: [...events, ...curves("HapticIntensityControl", intensity), ...curves("HapticSharpnessControl", sharpness)] };
}

function curves(name, values) {
  const parts = [];
  for (let first = 0; first < values.length - 1; first += MAX_POINTS - 1) {
    const control = values.slice(first, first + MAX_POINTS).map((value, index) => ({ Time: round(index * STEP_S, 3), ParameterValue: round(value, 4) }));
    parts.push({ ParameterCurve: { ParameterID: name, Time: round(first * STEP_S, 3), ParameterCurveControlPoints: control } });
  }
  return parts;
}

// Returns the points, 0..1, whose lines to this power have the energy of every WINDOW_S of the wave.
function points({ samples, rateHz }, power = 1) {
  const step = Math.round(STEP_S * rateHz);
  const window = Math.round(WINDOW_S * rateHz);
  const count = Math.max(1, Math.floor(samples.length / window)) * window;
  const squared = Float64Array.from({ length: count }, (_, index) => 2 * (samples[index] ?? 0) ** 2);
  const levels = Array.from({ length: count / step + 1 }, (_, point) => {
    let sum = 0;
    for (let index = point * step - (step >> 1); index < point * step - (step >> 1) + step; index++) sum += squared[index] ?? 0;
    return Math.sqrt(sum / step) ** (1 / power);
  });
  const wanted = windowLevels(squared, window);
  for (let turn = 0; turn < ROUNDS; turn++) {
    const lines = Float64Array.from(squared, (_, index) => {
      const [before, share] = [Math.floor(index / step), (index % step) / step];
      return (levels[before] + share * (levels[before + 1] - levels[before])) ** (2 * power);
    });
    const gains = windowLevels(lines, window).map((level, index) => Math.min(MAX_GAIN, Math.max(1 / MAX_GAIN, wanted[index] / Math.max(level, 1e-9))));
    levels.forEach((level, point) => {
      const place = Math.min(gains.length - 1, Math.max(0, (point * step) / window - 0.5));
      const before = Math.floor(place);
      const gain = gains[before] + (place - before) * ((gains[before + 1] ?? gains[before]) - gains[before]);
      levels[point] = Math.min(1, level * gain ** (1 / power));
    });
  }
  return levels;
}

function windowLevels(squared, window) {
  return Array.from({ length: squared.length / window }, (_, index) => Math.sqrt(squared.subarray(index * window, (index + 1) * window).reduce((sum, value) => sum + value, 0) / window));
}

// Returns the frequency at each point, 0 at RANGE_HZ.low to 1 at RANGE_HZ.high: that of a sine that changes as quickly.
function frequencies({ samples, rateHz }) {
  const step = Math.round(STEP_S * rateHz);
  const window = Math.round(WINDOW_S * rateHz);
  const reach = Math.round(FREQUENCY_S * rateHz);
  const count = Math.max(1, Math.floor(samples.length / window)) * window;
  const values = Array.from({ length: count / step }, (_, period) => {
    const middle = period * step + (step >> 1);
    const begin = Math.max(0, middle - (reach >> 1));
    let [energy, change] = [0, 0];
    for (let index = begin; index < Math.min(count, middle + (reach >> 1)); index++) {
      const sample = samples[index] ?? 0;
      energy += sample ** 2;
      if (index > begin) change += (sample - (samples[index - 1] ?? 0)) ** 2;
    }
    const hertz = (Math.asin(Math.min(1, Math.sqrt(change / Math.max(energy, 1e-12)) / 2)) * rateHz) / Math.PI;
    const heard = Math.min(HEARD_HZ.high, Math.max(HEARD_HZ.low, hertz));
    return Math.min(1, Math.max(0, (heard - RANGE_HZ.low) / (RANGE_HZ.high - RANGE_HZ.low)));
  });
  return [...values, values.at(-1)];
}

// Returns files ({name: bytes}) as one ZIP archive, stored without compression (PKWARE APPNOTE 6.3).
export function zip(files) {
  const parts = [];
  const entries = [];
  let at = 0;
  const add = (bytes) => {
    parts.push(bytes);
    at += bytes.length;
  };
  for (const [name, bytes] of Object.entries(files)) {
    const letters = new TextEncoder().encode(name);
    const facts = [[20, 2], [0x0800, 2], [0, 2], [0, 2], [0x21, 2], [crc32(bytes), 4], [bytes.length, 4], [bytes.length, 4], [letters.length, 2], [0, 2]];
    entries.push({ letters, facts, from: at });
    add(record(0x04034b50, facts));
    add(letters);
    add(bytes);
  }
  const directory = at;
  for (const { letters, facts, from } of entries) {
    add(record(0x02014b50, [[20, 2], ...facts, [0, 2], [0, 2], [0, 2], [0, 4], [from, 4]]));
    add(letters);
  }
  add(record(0x06054b50, [[0, 2], [0, 2], [entries.length, 2], [entries.length, 2], [at - directory, 4], [directory, 4], [0, 2]]));
  return new Blob(parts, { type: "application/zip" });
}

function record(signature, fields) {
  const all = [[signature, 4], ...fields];
  const view = new DataView(new ArrayBuffer(all.reduce((sum, [, size]) => sum + size, 0)));
  let at = 0;
  for (const [value, size] of all) {
    if (size === 4) view.setUint32(at, value, true);
    else view.setUint16(at, value, true);
    at += size;
  }
  return new Uint8Array(view.buffer);
}

function crc32(bytes) {
  let sum = ~0;
  for (const byte of bytes) {
    sum ^= byte;
    for (let bit = 0; bit < 8; bit++) sum = (sum >>> 1) ^ (sum & 1 ? 0xedb88320 : 0);
  }
  return ~sum >>> 0;
}

const round = (value, digits) => Number(value.toFixed(digits));
