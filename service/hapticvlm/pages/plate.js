// Shows the plate: its temperature and setpoint on the scale of warmth, and both over the last minute.
import { Chart, palette, trace } from "./chart.js";
import { byId, degrees, named, percent, setText } from "./dom.js";
import { NEUTRAL_C, addScale, warmthColour, warmthWord } from "./feel.js";
import { Ring } from "./ring.js";

const SECONDS = 60;
const PER_SECOND = 10;
const LOWEST_C = 12; // the trips at 13 and 43 degC are in view
const HIGHEST_C = 44;
const REPAINT_MS = 200; // a minute is about 500 px wide, so it moves by less than two pixels
const STEADY_C = 0.3; // three pixels of the scale
const AXIS = 30; // px for the labels
const FOOT = 16;
const [AT, MEASURED, SETPOINT] = [0, 1, 2];

const history = new Ring(SECONDS * PER_SECOND, 3);
let limits = { low: 18, high: 40 };
let steady = {}; // the reading from which the plate has not moved since
let steadyFor = 0; // readings
let newest = { plate_c: null, setpoint_c: null };
const chart = new Chart(byId("plate-chart"), paint, REPAINT_MS);
const scale = new Chart(byId("plate-scale"), paintScale, REPAINT_MS);

export function welcome(message) {
  const { peltier } = message.devices;
  setText(byId("plate-name"), named(peltier));
  limits = message.limits.setpoint_c;
}

export function telemetry(message) {
  newest = message;
  setText(byId("plate"), degrees(message.plate_c));
  setText(byId("plate-word"), warmthWord(message.plate_c));
  byId("plate-card").style.setProperty("--now", message.plate_c == null ? "transparent" : warmthColour(message.plate_c));
  const isResting = message.leases === 0 && message.duty === 0;
  setText(byId("setpoint-words"), isResting ? "off: nothing is touched" : "setpoint");
  setText(byId("setpoint"), isResting ? "" : degrees(message.setpoint_c));
  setText(byId("sink"), degrees(message.sink_c));
  setText(byId("duty"), percent(message.duty));
  history.push(performance.now() / 1000, message.plate_c, message.setpoint_c);
  if (!isNear(message, steady)) {
    steady = message;
    steadyFor = 0;
  }
  // A steady plate moves its chart only along, for which a picture a second is enough, until nothing else is shown.
  const isSteady = steadyFor++ > PER_SECOND;
  if (isSteady && (steadyFor > SECONDS * PER_SECOND || steadyFor % PER_SECOND)) return;
  chart.change();
  if (!isSteady) scale.change();
}

// Returns whether two readings look alike on the scale.
function isNear(one, other) {
  return ["plate_c", "setpoint_c"].every((name) => one[name] === other[name] || Math.abs(one[name] - other[name]) < STEADY_C);
}

// Interrupts the lines while the service is not connected.
export function gap() {
  newest = { plate_c: null, setpoint_c: null };
  steady = {};
  history.push(performance.now() / 1000, null, null);
  setText(byId("plate"), degrees(null));
  setText(byId("plate-word"), "");
  byId("plate-card").style.setProperty("--now", "transparent");
  chart.change();
  scale.change();
}

// Draws the scale from cold to hot, with the allowed range, the setpoint (a ring) and the temperature (a dot).
function paintScale(context, width, height) {
  const x = (celsius) => 8 + (width - 16) * ((celsius - LOWEST_C) / (HIGHEST_C - LOWEST_C));
  const [middle, thick] = [11, 10];
  bar(context, [x(LOWEST_C), x(HIGHEST_C)], middle, thick / 2.5, addScale(context.createLinearGradient(x(LOWEST_C), 0, x(HIGHEST_C), 0), LOWEST_C, HIGHEST_C, 0.35));
  bar(context, [x(limits.low), x(limits.high)], middle, thick, addScale(context.createLinearGradient(x(limits.low), 0, x(limits.high), 0), limits.low, limits.high));
  const { ink, soft, card } = palette();
  context.fillStyle = soft;
  context.textAlign = "center";
  for (const celsius of [limits.low, NEUTRAL_C, limits.high]) context.fillText(celsius === NEUTRAL_C ? "skin 32" : `${celsius}`, x(celsius), height - 2);
  context.textAlign = "start";
  const { plate_c: plate, setpoint_c: setpoint } = newest;
  if (setpoint != null) ring(context, x(setpoint), middle, 8, { line: ink, fill: null });
  if (plate != null) ring(context, x(plate), middle, 5.5, { line: card, fill: ink });
}

function bar(context, [from, to], middle, thick, fill) {
  context.fillStyle = fill;
  context.beginPath();
  context.roundRect(from, middle - thick / 2, to - from, thick, thick / 2);
  context.fill();
}

function ring(context, x, y, radius, { line, fill }) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) {
    context.fillStyle = fill;
    context.fill();
  }
  context.strokeStyle = line;
  context.lineWidth = 2;
  context.stroke();
}

function paint(context, width, height) {
  const [left, bottom] = [AXIS, height - FOOT];
  const [low, high] = span();
  const y = (value) => 4 + (bottom - 8) * (1 - (value - low) / (high - low));
  grid(context, { left, width, bottom, y, low, high });
  const now = performance.now() / 1000;
  const x = (row) => left + (width - left) * (1 - (now - history.at(row, AT)) / SECONDS);
  const warmth = addScale(context.createLinearGradient(0, y(LOWEST_C), 0, y(HIGHEST_C)), LOWEST_C, HIGHEST_C);
  const line = (column, colour, dash, thick) =>
    trace(context, { count: history.count, x, y: (row) => y(history.at(row, column)), colour, dash, thick });
  context.save();
  context.beginPath();
  context.rect(left, 0, width - left, bottom);
  context.clip();
  line(MEASURED, warmth, [], 4);
  line(SETPOINT, palette().ink, [5, 4], 1.5);
  context.restore();
}

// Returns the recent range of temperature and setpoint with a margin, so that a plate at rest is not drawn at the edge.
function span() {
  let [low, high] = [NEUTRAL_C - 3, NEUTRAL_C + 3];
  for (let row = 0; row < history.count; row++) {
    for (const column of [MEASURED, SETPOINT]) {
      const value = history.at(row, column);
      if (Number.isNaN(value)) continue;
      [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
  }
  return [Math.max(LOWEST_C, Math.floor(low - 1)), Math.min(HIGHEST_C, Math.ceil(high + 1))];
}

function grid(context, { left, width, bottom, y, low, high }) {
  const { line, soft } = palette();
  const step = high - low > 14 ? 5 : 2;
  for (let celsius = Math.ceil(low / step) * step; celsius <= high; celsius += step) {
    context.fillStyle = line;
    context.fillRect(left, Math.round(y(celsius)), width - left, 1);
    context.fillStyle = soft;
    context.fillText(`${celsius}°`, 2, y(celsius) + 4);
  }
  for (const seconds of [60, 40, 20]) {
    const x = left + (width - left) * (1 - seconds / SECONDS);
    context.fillText(`${seconds} s`, Math.max(left, x - 10), bottom + 13);
  }
  context.fillText("now", width - 24, bottom + 13);
}
