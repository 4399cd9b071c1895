// Shows the duration of each stage: median and 99th percentile of the newest few hundred.
import { byId, make, setText } from "./dom.js";
import { Ring, quantile } from "./ring.js";

const CAPACITY = 512;
const MAX_STAGES = 12; // bounds the memory, because the names come from the service
const stages = new Map();

export function take({ stages_ms = {}, frame_age_ms }) {
  const entries = Object.entries(stages_ms);
  if (!entries.length) return;
  for (const [name, ms] of entries) record(name, ms);
  record("whole recognition", entries.reduce((sum, [, ms]) => sum + ms, 0));
  if (frame_age_ms != null) record("frame captured to decision", frame_age_ms);
}

// `waits`: {n, median, p99} of touches waiting for their first sample, in ms, or null.
export function paint(waits) {
  const rows = [...stages].map(([name, ring]) => {
    const sorted = ring.sorted(0);
    return [name, quantile(sorted, 0.5), quantile(sorted, 0.99), sorted.length];
  });
  if (waits) rows.unshift(["touch to first sample", waits.median, waits.p99, waits.n]);
  const body = byId("stages");
  if (rows.length && !body.querySelector("th")) body.replaceChildren();
  rows.forEach((row, index) => fill(body.rows[index] ?? addRow(body), row));
}

function record(name, ms) {
  if (!stages.has(name) && stages.size >= MAX_STAGES) return;
  if (!stages.has(name)) stages.set(name, new Ring(CAPACITY, 1));
  stages.get(name).push(ms);
}

function addRow(body) {
  const row = body.insertRow();
  row.append(make("th", "", { scope: "row" }));
  for (let column = 0; column < 3; column++) row.insertCell();
  return row;
}

function fill(row, [name, median, p99, count]) {
  const texts = [name, `${median.toFixed(2)} ms`, `${p99.toFixed(2)} ms`, String(count)];
  texts.forEach((text, index) => setText(row.cells[index], text));
}
