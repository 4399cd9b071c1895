// Shows faults with their remedies, and recent errors.
import { byId, clock, make } from "./dom.js";

const MAX_TROUBLES = 8;
const SPEAKER_GONE = ["The speaker is silent: its audio output is not available.", "reconnect it; vibration is off until then"];
const SIMULATED_GONE = ["The simulated speaker is silent: its process has ended.", "nothing, the service restarts it; no device is affected"];
let shown = null;

// Takes the service's status: plate.faults is {name: "cause (name, number n): remedy"}.
export function show({ plate, speaker }) {
  const key = JSON.stringify([plate.faults, speaker.plays, speaker.faults]);
  if (key === shown) return;
  shown = key;
  const items = Object.entries(plate.faults).map(plateFault);
  const quiet = Object.entries(speaker.faults).filter(([name]) => name !== "speaker_gone");
  items.unshift(...quiet.map(speakerFault));
  if (!speaker.plays && !quiet.length) items.unshift(fault("speaker_gone", ...(speaker.simulated ? SIMULATED_GONE : SPEAKER_GONE)));
  const none = make("li", "None: plate and speaker report no fault.", { className: "fine" });
  byId("faults").replaceChildren(...(items.length ? items : [none]));
}

export function gap() {
  shown = null;
  byId("faults").replaceChildren(make("li", "Unknown: no connection to the service.", { className: "fine" }));
}

export function trouble({ code, text }) {
  const troubles = byId("troubles");
  troubles.hidden = false;
  troubles.prepend(make("li", `${clock()} ${code}: ${text}`));
  while (troubles.children.length > MAX_TROUBLES) troubles.lastElementChild.remove();
}

function plateFault([name, text]) {
  const [, cause, remedy] = /^(.*\)): (.*)$/s.exec(text) ?? [null, text, "see the README of the firmware"];
  return fault(name, `The plate is off: ${cause}.`, remedy);
}

function speakerFault([name, text]) {
  const [, cause, remedy] = /^(.*) \(.*\): (.*)$/s.exec(text) ?? [null, text, "see the system's sound settings"];
  return fault(name, `Hardly anything is felt: ${cause}.`, remedy);
}

function fault(name, cause, remedy) {
  const item = make("li", "", { className: "fault" });
  item.append(make("span", cause), make("span", `Remedy: ${remedy}.`, { className: "cure" }));
  item.dataset.fault = name;
  return item;
}
