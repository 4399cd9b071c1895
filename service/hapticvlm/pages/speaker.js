// Shows the palm speaker: its strength over the last seconds, the newest tenth of a second, and its spectrum.
import { Chart, palette, rule, trace } from "./chart.js";
import { byId, eachFrame, named, setText } from "./dom.js";
import { strength } from "./felt.js";
import { sound, speakerIs } from "./hear.js";
import { Ring } from "./ring.js";
import { BINS, HIGHEST_HZ, STEP_HZ, decibels, spectrum, strongestHz } from "./spectrum.js";

const SHOWN_S = 0.1;
const RIBBON_S = 8;
const SLICE_S = 0.02; // of the ribbon
const REPAINT_MS = 100; // a ribbon of 8 s moves by about five pixels meanwhile
const LOWEST_DB = -80;
const SILENT = 1e-4; // of full scale
const SCALES = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1];
const DECAY = 0.94; // of the waveform's scale per picture, so that it does not jump

const ribbon = new Ring(RIBBON_S / SLICE_S, 1); // one peak per slice
let samples = [];
let rateHz = null;
let next = null; // number of the next expected sample
let slice = { peak: 0, left: 0 };
let silentFor = 0; // s
let amplitudes = null; // spectrum of the samples, computed on demand
let peak = 0;
const history = new Chart(byId("ribbon-chart"), paintRibbon, REPAINT_MS);
const wave = new Chart(byId("wave-chart"), paintWave, REPAINT_MS);
const lines = new Chart(byId("spectrum-chart"), paintSpectrum, 2 * REPAINT_MS);
const showStrongest = eachFrame(() => setText(byId("strongest"), strongest()));

export function welcome(message) {
  const { speaker } = message.devices;
  setText(byId("speaker-name"), named(speaker));
  speakerIs(speaker);
}

export function telemetry(message) {
  setText(byId("level"), message.speaker_level.toFixed(3));
  setText(byId("level-word"), strength(message.speaker_level));
  showStrongest();
}

export function waveform(view) {
  sound.take(view);
  const isSilent = view.samples.every((sample) => Math.abs(sample) < SILENT);
  silentFor = isSilent ? silentFor + view.samples.length / view.rate_hz : 0;
  receive(view);
  // A silent chart looks the same as before, so it is left alone.
  if (silentFor < RIBBON_S + 1) history.change();
  if (silentFor < 2 * SHOWN_S) for (const chart of [wave, lines]) chart.change();
}

// Clears the readings while the service is not connected.
export function gap() {
  sound.silence();
  samples = [];
  next = amplitudes = null;
  ribbon.push(null);
  setText(byId("level"), "–");
  setText(byId("level-word"), "no reading");
  for (const chart of [history, wave, lines]) chart.change();
  showStrongest();
}

// Appends a piece; a piece that does not follow the last one restarts the waveform.
function receive({ samples: newest, rate_hz: hertz, start }) {
  if (start !== next || hertz !== rateHz) samples = [];
  next = start + newest.length;
  rateHz = hertz;
  samples = samples.concat(newest).slice(-Math.round(SHOWN_S * hertz));
  amplitudes = null;
  for (const sample of newest) {
    slice.peak = Math.max(slice.peak, Math.abs(sample));
    if (++slice.left < SLICE_S * hertz) continue;
    ribbon.push(slice.peak);
    slice = { peak: 0, left: 0 };
  }
}

function strongest() {
  if (samples.length < 2) return "frequency not known";
  const isSilent = samples.every((sample) => Math.abs(sample) < SILENT);
  return isSilent ? "no frequency" : `strongest at ${strongestHz(amplitudesNow())} Hz`;
}

function amplitudesNow() {
  return (amplitudes ??= spectrum(samples, rateHz));
}

// Draws the mirrored envelope of the vibration over time, the newest on the right.
function paintRibbon(context, width, height) {
  const { wave: colour, line, soft } = palette();
  const [middle, foot] = [(height - 14) / 2, height - 2];
  let largest = 0.02;
  for (let row = 0; row < ribbon.count; row++) largest = Math.max(largest, ribbon.at(row, 0) || 0);
  context.fillStyle = line;
  context.fillRect(0, Math.round(middle), width, 1);
  context.fillStyle = colour;
  const step = width / ribbon.rows;
  for (let row = 0; row < ribbon.count; row++) {
    const half = (ribbon.at(row, 0) / largest) * (middle - 2);
    if (half > 0.4) context.fillRect(width - (ribbon.count - row) * step, middle - half, Math.max(1, step), 2 * half);
  }
  context.fillStyle = soft;
  context.fillText(`${RIBBON_S} s`, 2, foot);
  context.fillText("now", width - 24, foot);
}

function paintWave(context, width, height) {
  peak = samples.reduce((most, sample) => Math.max(most, Math.abs(sample)), peak * DECAY);
  const scale = SCALES.find((step) => step >= peak) ?? 1;
  const y = (value) => (height - 14) * (0.5 - 0.46 * (value / scale));
  rule(context, y(0), width, "");
  const x = (index) => (width * index) / (samples.length - 1);
  trace(context, { count: samples.length, x, y: (index) => y(samples[index]), colour: palette().wave });
  label(context, height, `±${scale} of full scale, 0.1 s`);
}

function paintSpectrum(context, width, height) {
  const foot = height - 14;
  const y = (level) => foot * (1 - Math.max(0, level - LOWEST_DB) / -LOWEST_DB) + 2;
  rule(context, y(-60), width, "−60 dB");
  rule(context, y(-20), width, "−20 dB of full scale");
  const x = (bin) => (width * bin * STEP_HZ) / HIGHEST_HZ;
  label(context, height, "0");
  context.fillText("500", x(50) - 10, height - 2);
  context.fillText("1000 Hz", width - 48, height - 2);
  if (samples.length < 2) return;
  const line = { count: BINS, x, y: (bin) => y(decibels(amplitudesNow()[bin])), colour: palette().wave };
  fillBelow(context, line, foot);
  trace(context, line);
}

function fillBelow(context, { count, x, y }, foot) {
  context.fillStyle = palette()["wave-soft"];
  context.beginPath();
  context.moveTo(x(0), foot);
  for (let bin = 0; bin < count; bin++) context.lineTo(x(bin), y(bin));
  context.lineTo(x(count - 1), foot);
  context.fill();
}

function label(context, height, text) {
  context.fillStyle = palette().soft;
  context.fillText(text, 2, height - 2);
}
