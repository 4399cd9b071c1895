/** Decodes the clips and loops of a feel file, each when it is first played, and reads their samples. */
const GUARD = 3; // samples on either side of a wave, so that the cubic needs no bounds
const DIGITS = new Map([...'ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/'].map((digit, at) => [digit.charCodeAt(0), at]));
const known = new WeakMap(); // decoded ones by what the file has

/** One turn of a sine as a loop: a hum is played as everything else, and its rate is its frequency. */
export const SINE = {isLoop: true, rate_hz: 32, ...wavesOf(Array.from({length: 64}, (_, at) => (at % 2 ? Math.sin : Math.cos)((Math.PI * (at >> 1)) / 16)), true, true)};

/** Returns a clip or loop with its samples and tracks. */
export function decoded(clip) {
  if (!known.has(clip)) known.set(clip, decode(clip));
  return known.get(clip);
}

/** Returns a clip between two of one rate: 1 - share of the one, share of the other. */
export function blended(one, other, share) {
  if (!share || one === other) return one;
  const clip = {...one, size: Math.max(one.size, other.size), most: (1 - share) * one.most + share * other.most};
  for (const name of ['re', 'drive', 'felt', 'hz', 'body']) {
    clip[name] = Float32Array.from({length: Math.max(one[name].length, other[name].length)}, (_, at) => (1 - share) * (one[name][at] ?? 0) + share * (other[name][at] ?? 0));
  }
  return clip;
}

/**
 * Adds the samples of a clip to `part`, from `at`, s, on; `step` is how many of its samples pass in each, and the gain goes from
 * `begin` to `end`. With `shift`, complex samples are turned by it.
 */
export function addSamples(part, {isLoop, rate_hz: rate, size, re, im}, at, step, begin, end, shift) {
  const slope = (end - begin) / Math.max(part.length - 1, 1);
  for (let n = 0; n < part.length; n++) {
    const place = at * rate + n * step * rate;
    const whole = Math.floor(place);
    if (!isLoop && (whole < -2 || whole > size)) continue;
    const from = (isLoop ? whole % size : whole) + GUARD - 1;
    let sample = cubic(re, from, place - whole);
    if (im && shift) sample = sample * shift.re[n] - cubic(im, from, place - whole) * shift.im[n];
    part[n] += sample * (begin + n * slope);
  }
}

function cubic(wave, at, share) {
  const [a, b, c, d] = [wave[at], wave[at + 1], wave[at + 2], wave[at + 3]];
  return b + 0.5 * share * (c - a + share * (2 * a - 5 * b + 4 * c - d + share * (3 * (b - c) + d - a)));
}

function decode({wave, peak, hz, drive, felt, body, ...facts}) {
  const samples = Float32Array.from(new Int8Array(bytesOf(wave).buffer), (code) => (code * peak) / 127);
  const isLoop = facts.gain !== undefined;
  const clip = {...facts, isLoop, ...wavesOf(samples, isLoop, isLoop && body !== null), drive: trackOf(drive)};
  if (isLoop) return {...clip, hz, felt, loud: facts.loud ?? facts.rate.map(() => 1), body: body ?? facts.rate.map(() => 0)};
  return {...clip, felt: trackOf(felt), body: trackOf(body), hz: Float32Array.from(bytesOf(hz), (code) => 20 * 10 ** (code / 150))};
}

/** Returns waves with what is before and after them: 0, or what a loop goes on with. */
function wavesOf(samples, isLoop, isComplex) {
  const every = isComplex ? 2 : 1;
  const size = Math.max(1, Math.floor(samples.length / every));
  const part = (first) => Float32Array.from({length: size + 2 * GUARD}, (_, at) => samples[first + every * (isLoop ? (at - GUARD + GUARD * size) % size : at - GUARD)] ?? 0);
  return {size, re: part(0), im: isComplex ? part(1) : null};
}

function trackOf(track) {
  return Float32Array.from(track ? bytesOf(track.bytes) : [255], (code) => (code === 255 ? 0 : track.peak * 10 ** (-code / 40)));
}

/** Decodes base64; the audio thread has no `atob`. */
function bytesOf(text) {
  const bytes = new Uint8Array((text.length / 4) * 3 - (text.endsWith('==') ? 2 : text.endsWith('=') ? 1 : 0));
  for (let at = 0, to = 0; at < text.length; at += 4, to += 3) {
    let bits = 0;
    for (let digit = 0; digit < 4; digit++) bits = 64 * bits + (DIGITS.get(text.charCodeAt(at + digit)) ?? 0);
    for (let byte = 0; byte < 3; byte++) bytes[to + byte] = bits >> (16 - 8 * byte);
  }
  return bytes;
}
