// Computes the amplitude spectrum of a short piece of vibration; pure functions without access to the page.
//
// X(f) = 2 / sum(w) * |sum(w[n] x[n] exp(-2 pi i f n / rate))| with a Hann window w, so that a sine of
// amplitude A yields A at its frequency. Only the drawn frequencies are evaluated: a hundred frequencies of a
// few hundred samples with cached tables cost less than padding to a power of two for an FFT.

export const STEP_HZ = 10;
export const HIGHEST_HZ = 1000;
export const BINS = HIGHEST_HZ / STEP_HZ + 1;

let tables = null;

// samples: numbers of -1..1, evenly spaced at rateHz. Returns Float64Array(BINS), amplitudes at
// 0, STEP_HZ, ... HIGHEST_HZ; the same array each time, overwritten.
export function spectrum(samples, rateHz) {
  if (tables?.length !== samples.length || tables.rateHz !== rateHz) {
    tables = prepare(samples.length, rateHz);
  }
  const { length, window, cosines, sines, amplitudes, scale } = tables;
  for (let bin = 0; bin < BINS; bin++) {
    let real = 0;
    let imaginary = 0;
    for (let n = 0; n < length; n++) {
      const value = window[n] * samples[n];
      real += value * cosines[bin * length + n];
      imaginary -= value * sines[bin * length + n];
    }
    amplitudes[bin] = scale * Math.hypot(real, imaginary);
  }
  return amplitudes;
}

export const decibels = (amplitude) => 20 * Math.log10(Math.max(amplitude, 1e-9));

export function strongestHz(amplitudes) {
  let best = 1;
  for (let bin = 2; bin < amplitudes.length; bin++) {
    if (amplitudes[bin] > amplitudes[best]) best = bin;
  }
  return best * STEP_HZ;
}

function prepare(length, rateHz) {
  const window = Float64Array.from({ length }, (_, n) => 0.5 - 0.5 * Math.cos((2 * Math.PI * n) / length));
  const angle = (index) => (2 * Math.PI * STEP_HZ * Math.floor(index / length) * (index % length)) / rateHz;
  const cosines = Float64Array.from({ length: BINS * length }, (_, index) => Math.cos(angle(index)));
  const sines = Float64Array.from({ length: BINS * length }, (_, index) => Math.sin(angle(index)));
  const scale = 2 / window.reduce((sum, value) => sum + value, 0);
  return { length, rateHz, window, cosines, sines, scale, amplitudes: new Float64Array(BINS) };
}
