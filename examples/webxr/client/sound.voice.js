// Makes a vibration audible: rendering/vibration/sound_voice.py in JavaScript. Figures and reasons are there; a
// test compares the two. It takes the true voice at IN_HZ and returns the sound voice at OUT_HZ, HALF_S later.

export const IN_HZ = 3000;
export const UP = 4;
export const OUT_HZ = UP * IN_HZ;
export const HALF_S = 0.024;
const SHIFT_HZ = 300;
const EDGES_HZ = [0, 90, 190, 400, 1100];
const WEIGHTS = [1.6, 1.3, 1, 0.8];
const LEVEL = 0.22;
const EXPONENT = 0.25;
const LOWEST = 1e-3;
const FALL_PER_S = 1;

const HALF = Math.round(HALF_S * IN_HZ);
const SPAN = 2 * HALF + 1;
const PERIOD = Math.round(OUT_HZ / SHIFT_HZ);
const FALL = Math.exp(-FALL_PER_S / IN_HZ);
const KERNELS = WEIGHTS.map((weight, band) => kernels(EDGES_HZ[band], EDGES_HZ[band + 1], weight));
const SHIFT = Array.from({ length: PERIOD }, (_, turn) => {
  const angle = (2 * Math.PI * turn) / PERIOD;
  return { re: Math.cos(angle), im: Math.sin(angle) };
});

export class SoundVoice {
  #line = new Float64Array(2 * SPAN); // the newest samples of the true voice, twice, so that a window never wraps
  #at = 0; // where the oldest one is
  #level = 0;
  #turn = 0;
  #silent = SPAN; // zeros in a row; a line of zeros needs no work

  // Returns the next samples (N) at IN_HZ as sound, (N * UP) at OUT_HZ, within -1 and 1.
  render(samples) {
    const heard = new Float32Array(samples.length * UP);
    for (let index = 0; index < samples.length; index++) {
      this.#line[this.#at] = this.#line[this.#at + SPAN] = samples[index];
      this.#at = (this.#at + 1) % SPAN;
      this.#silent = samples[index] === 0 ? this.#silent + 1 : 0;
      const gain = this.#gain();
      for (let phase = 0; phase < UP; phase++) {
        if (this.#silent < SPAN) heard[index * UP + phase] = Math.max(-1, Math.min(1, gain * this.#sample(phase)));
        this.#turn = (this.#turn + 1) % PERIOD;
      }
    }
    return heard;
  }

  #gain() {
    let sum = 0;
    if (this.#silent < SPAN) for (let index = 0; index < SPAN; index++) sum += this.#line[index] * this.#line[index];
    this.#level = Math.max(Math.sqrt(sum / SPAN), this.#level * FALL);
    return LEVEL * Math.max(this.#level, LOWEST) ** (EXPONENT - 1);
  }

  #sample(phase) {
    const line = this.#line;
    const at = this.#at;
    let wave = 0;
    for (const band of KERNELS) {
      const { re, im } = band[phase];
      let zRe = 0;
      let zIm = 0;
      for (let index = 0; index < SPAN; index++) {
        const sample = line[at + index];
        zRe += sample * re[index];
        zIm += sample * im[index];
      }
      const size = Math.sqrt(zRe * zRe + zIm * zIm);
      const [re1, im1] = [zRe / Math.max(size, 1e-12), zIm / Math.max(size, 1e-12)];
      const [re2, im2] = [re1 * re1 - im1 * im1, 2 * re1 * im1];
      const [re4, im4] = [re2 * re2 - im2 * im2, 2 * re2 * im2];
      wave += size * (re4 * SHIFT[this.#turn].re - im4 * SHIFT[this.#turn].im);
    }
    return wave;
  }
}

// Returns the analytic kernel of one band under its window: for each phase, the weights of the samples, oldest first.
function kernels(low, high, weight) {
  const phases = [];
  for (let phase = 0; phase < UP; phase++) {
    const [re, im] = [new Float64Array(SPAN), new Float64Array(SPAN)];
    for (let index = 0; index < SPAN; index++) {
      const at = (UP * (SPAN - 1 - index) + phase - HALF * UP) / OUT_HZ;
      if (Math.abs(at) >= HALF_S) continue;
      const scale = (weight * (0.5 + 0.5 * Math.cos((Math.PI * at) / HALF_S))) / IN_HZ;
      const [lower, higher] = [2 * Math.PI * low * at, 2 * Math.PI * high * at];
      re[index] = scale * (at === 0 ? 2 * (high - low) : (Math.sin(higher) - Math.sin(lower)) / (Math.PI * at));
      im[index] = at === 0 ? 0 : (scale * (Math.cos(lower) - Math.cos(higher))) / (Math.PI * at);
    }
    phases.push({ re, im });
  }
  return phases;
}
