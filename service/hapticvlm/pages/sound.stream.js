// Fills blocks of an output from a numbered stream of samples, which a windowed sinc resamples to the output's rate.
//
// Duplicate or late pieces are harmless, because their samples are numbered. A few milliseconds are buffered against
// jitter: more after each underrun, less while playback is stable. Neither an audio node nor a clock is known here:
// `sound.worklet.js` calls it in the audio thread, `sound.buffers.js` in the page where there are no worklets.

const CAPACITY = 32768; // samples of the stream, a power of two
const HALF = 8; // taps on either side
const PHASES = 256;
const SHAPE = 8; // of the Kaiser window: content above the stream's band is attenuated by 80 dB
const MIN_BUFFER_S = 0.03;
const MAX_BUFFER_S = 0.15;
const STEP_S = 0.01;
const CALM_S = 10; // time without an underrun before the buffer shrinks
const HURRY = 0.02; // share by which playback speeds up when the buffer is too full
const LATE_S = 0.1; // an excess above this is skipped
const FADE_S = 0.004;
const MUTE_S = 0.4; // after a stop, so that samples already in transit are not played
const SILENT = 2e-4;
const REPORT_S = 0.1;
const TABLE = taps();

export class StreamPlayer {
  // `sampleRate` is that of the output; `onReport` gets what is in hand and the peak every REPORT_S.
  constructor(sampleRate, onReport) {
    this.sampleRate = sampleRate;
    this.onReport = onReport;
    this.samples = new Float32Array(CAPACITY);
    this.rateHz = 3000;
    this.end = null; // number after the newest sample; null = none yet
    this.at = null; // number (with fraction) now played; null = waiting
    this.keepS = MIN_BUFFER_S;
    this.gain = 0;
    this.mutedUntil = 0;
    this.isStopping = false;
    this.calmSince = 0;
    this.reportAt = 0;
    this.now = 0;
    this.peak = 0;
  }

  // Fills the next block; `now` is the time in s at which it is played. Returns whether it is silent.
  fill(output, now) {
    this.now = now;
    const step = this.#advance();
    const fade = 1 / (FADE_S * this.sampleRate);
    let peak = 0;
    for (let index = 0; index < output.length; index++) {
      const isPlaying = this.at !== null && !this.isStopping && this.at + HALF < this.end;
      this.gain = Math.max(0, Math.min(1, this.gain + (isPlaying ? fade : -fade)));
      const value = this.at === null ? 0 : this.#sample(Math.min(this.at, this.end - HALF - 1)) * this.gain;
      output[index] = value;
      peak = Math.max(peak, Math.abs(value));
      if (isPlaying) this.at += step;
    }
    this.peak = Math.max(this.peak, peak);
    if (this.isStopping && this.gain === 0) this.#forget();
    this.#report();
    return peak === 0;
  }

  // Starts, skips or speeds up according to the buffer; returns the advance per output sample.
  #advance() {
    const plain = this.rateHz / this.sampleRate;
    if (this.end === null) return plain;
    const target = this.keepS * this.rateHz + HALF;
    if (this.at === null) {
      if (this.gain === 0 && this.end - this.first >= target) this.at = this.end - target;
      return plain;
    }
    const inHand = this.end - this.at;
    if (inHand <= HALF + 1) this.#ranDry();
    else if (inHand - target > LATE_S * this.rateHz) this.at = this.end - target;
    else if (this.now - this.calmSince > CALM_S) {
      this.calmSince = this.now;
      this.keepS = Math.max(MIN_BUFFER_S, this.keepS - STEP_S);
    }
    return inHand - target > STEP_S * this.rateHz ? plain * (1 + HURRY) : plain;
  }

  #ranDry() {
    if (this.gain > 0) return; // fading out on the last samples
    this.at = null;
    this.first = this.end;
    this.keepS = Math.min(MAX_BUFFER_S, this.keepS + STEP_S);
    this.calmSince = this.now;
  }

  // Takes a piece, or `silence` after a stop.
  receive({ start, samples, rateHz, silence }) {
    if (silence) return this.#fallSilent();
    if (this.isStopping) return;
    if (this.now < this.mutedUntil) {
      if (!samples.every((sample) => Math.abs(sample) < SILENT)) return;
      this.mutedUntil = 0; // the service has stopped: later samples are new
    }
    this.rateHz = rateHz;
    if (this.end === null || start > this.end || start + samples.length < this.end - this.rateHz) this.#beginAt(start);
    for (let index = 0; index < samples.length; index++) this.samples[(start + index) & (CAPACITY - 1)] = samples[index];
    this.end = Math.max(this.end, start + samples.length);
  }

  // Restarts after a gap or with a new audio engine; earlier samples become silence.
  #beginAt(start) {
    this.samples.fill(0);
    this.end = start;
    this.first = start;
    this.at = null;
  }

  #fallSilent() {
    this.mutedUntil = this.now + MUTE_S;
    this.isStopping = true;
  }

  #forget() {
    this.isStopping = false;
    this.end = this.at = null;
  }

  #sample(at) {
    const whole = Math.floor(at);
    const phase = (at - whole) * PHASES;
    const row = Math.floor(phase);
    const share = phase - row;
    const offset = row * 2 * HALF;
    let sum = 0;
    for (let tap = 0; tap < 2 * HALF; tap++) {
      const weight = TABLE[offset + tap] + share * (TABLE[offset + 2 * HALF + tap] - TABLE[offset + tap]);
      sum += weight * this.samples[(whole - HALF + 1 + tap) & (CAPACITY - 1)];
    }
    return sum;
  }

  #report() {
    if (this.now < this.reportAt) return;
    this.reportAt = this.now + REPORT_S;
    const inHandMs = this.at === null ? null : (1000 * (this.end - this.at)) / this.rateHz;
    this.onReport({ inHandMs, peak: this.peak });
    this.peak = 0;
  }
}

// Returns (PHASES + 1) rows of 2 * HALF weights; row r is for the position r / PHASES between two samples.
function taps() {
  const table = new Float32Array((PHASES + 1) * 2 * HALF);
  for (let row = 0; row <= PHASES; row++) {
    for (let tap = 0; tap < 2 * HALF; tap++) {
      const x = tap - HALF + 1 - row / PHASES;
      const inside = Math.max(0, 1 - (x / HALF) ** 2);
      table[row * 2 * HALF + tap] = sinc(x) * (bessel(SHAPE * Math.sqrt(inside)) / bessel(SHAPE));
    }
  }
  return table;
}

function sinc(x) {
  return x === 0 ? 1 : Math.sin(Math.PI * x) / (Math.PI * x);
}

// Modified Bessel function of the first kind, order 0, by its series.
function bessel(x) {
  let [sum, term] = [1, 1];
  for (let n = 1; n < 30; n++) {
    term *= (x / (2 * n)) ** 2;
    sum += term;
  }
  return sum;
}
