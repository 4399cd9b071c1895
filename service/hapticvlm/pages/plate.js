// The plate: what it is, what it should be, and both over the last minute.
import { Chart, palette, rule, trace } from "./chart.js";
import { byId, degrees, named, percent, say } from "./dom.js";
import { Ring } from "./ring.js";

const SECONDS = 60;
const PER_SECOND = 10;
const LOWEST_C = 12; // the trips at 13 and 43 degC are in view
const HIGHEST_C = 44;
const NEUTRAL_C = 32;
const REPAINT_MS = 190; // a minute is some 500 px wide: it moves by less than two of them
const [AT, MEASURED, SETPOINT] = [0, 1, 2];

const history = new Ring(SECONDS * PER_SECOND, 3);
let limits = { low: 18, high: 40 };
const chart = new Chart(byId("plate-chart"), paint, REPAINT_MS);

export function welcome(message) {
  const { peltier } = message.devices;
  say(byId("plate-name"), named(peltier));
  limits = message.limits.setpoint_c;
}

export function telemetry(message) {
  say(byId("plate"), degrees(message.plate_c));
  say(byId("setpoint"), degrees(message.setpoint_c));
  say(byId("sink"), degrees(message.sink_c));
  say(byId("duty"), percent(message.duty));
  history.push(performance.now() / 1000, message.plate_c, message.setpoint_c);
  chart.change();
}

// Breaks the lines where the service was not heard.
export function gap() {
  history.push(performance.now() / 1000, null, null);
  say(byId("plate"), degrees(null));
  chart.change();
}

function paint(context, width, height) {
  const y = (value) => height * (1 - (value - LOWEST_C) / (HIGHEST_C - LOWEST_C));
  rule(context, y(limits.high), width, `${limits.high} °C, highest setpoint`);
  rule(context, y(NEUTRAL_C), width, `${NEUTRAL_C} °C, neutral`);
  rule(context, y(limits.low), width, `${limits.low} °C, lowest setpoint`);
  const now = performance.now() / 1000;
  const x = (row) => width * (1 - (now - history.at(row, AT)) / SECONDS);
  const line = (column, colour, dash) =>
    trace(context, { count: history.count, x, y: (row) => y(history.at(row, column)), colour, dash });
  line(SETPOINT, palette().setpoint, [6, 4]);
  line(MEASURED, palette().plate, []);
}
