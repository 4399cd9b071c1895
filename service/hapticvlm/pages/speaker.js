// The palm speaker: level, the newest tenth of a second, and what frequencies are in it.
import { Chart, palette, rule, trace } from "./chart.js";
import { byId, eachFrame, named, say } from "./dom.js";
import { BINS, HIGHEST_HZ, STEP_HZ, decibels, spectrum, strongestHz } from "./spectrum.js";

const LOWEST_DB = -80;
const SILENT = 1e-4; // of full scale
const SCALES = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1];
const DECAY = 0.97; // of the waveform's scale per picture, so that it does not jump

let samples = [];
let rateHz = null;
let isSilent = true;
let amplitudes = null; // of the samples, once asked for
let peak = 0;
const wave = new Chart(byId("wave-chart"), paintWave);
const lines = new Chart(byId("spectrum-chart"), paintSpectrum);
const tellStrongest = eachFrame(() => say(byId("strongest"), strongest()));

export function welcome(message) {
  const { speaker } = message.devices;
  say(byId("speaker-name"), named(speaker));
}

export function telemetry(message) {
  say(byId("level"), message.speaker_level.toFixed(3));
}

export function waveform(view) {
  const wasSilent = isSilent && samples.length > 0;
  take(view.samples, view.rate_hz);
  if (!(isSilent && wasSilent)) repaint();
}

// Nothing is known of the speaker while the service is not heard.
export function gap() {
  take([], null);
  say(byId("level"), "no reading");
  repaint();
}

function take(newest, hertz) {
  samples = newest;
  rateHz = hertz;
  isSilent = samples.every((sample) => Math.abs(sample) < SILENT);
  amplitudes = null;
}

function repaint() {
  wave.change();
  lines.change();
  tellStrongest();
}

function strongest() {
  if (!samples.length) return "not known";
  return isSilent ? "silent" : `strongest at ${strongestHz(found())} Hz`;
}

function found() {
  return (amplitudes ??= spectrum(samples, rateHz));
}

function paintWave(context, width, height) {
  peak = samples.reduce((most, sample) => Math.max(most, Math.abs(sample)), peak * DECAY);
  const scale = SCALES.find((step) => step >= peak) ?? 1;
  const y = (value) => height * (0.5 - 0.46 * (value / scale));
  rule(context, y(0), width, "");
  rule(context, y(scale) + 14, width, `±${scale} of full scale`);
  const x = (index) => (width * index) / (samples.length - 1);
  trace(context, { count: samples.length, x, y: (index) => y(samples[index]), colour: palette().wave });
}

function paintSpectrum(context, width, height) {
  const y = (level) => height * (1 - Math.max(0, level - LOWEST_DB) / -LOWEST_DB) + 2;
  rule(context, y(-20), width, "-20 dB of full scale");
  rule(context, y(-60), width, "-60 dB");
  const x = (bin) => (width * bin * STEP_HZ) / HIGHEST_HZ;
  for (const hertz of [250, 500, 750]) context.fillText(`${hertz} Hz`, x(hertz / STEP_HZ) - 18, height - 4);
  if (!samples.length) return;
  trace(context, { count: BINS, x, y: (bin) => y(decibels(found()[bin])), colour: palette().wave });
}
