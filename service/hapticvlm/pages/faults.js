// Faults in words with what to do, and what else went wrong lately.
import { byId, clock, make } from "./dom.js";

const MOST_TROUBLES = 8;
const SPEAKER_GONE = ["The speaker does not play: its audio output is gone.", "plug it in again; vibration rests until then"];
const SIMULATED_GONE = ["The simulated speaker does not play: its process has ended.", "nothing, the service starts it again; no device is concerned"];
let shown = null;

// Takes the service's status: plate.faults is {name: "what was seen (name, number n): what to do"}.
export function show({ plate, speaker }) {
  const key = JSON.stringify([plate.faults, speaker.plays]);
  if (key === shown) return;
  shown = key;
  const items = Object.entries(plate.faults).map(plateFault);
  if (!speaker.plays) items.unshift(fault("speaker_gone", ...(speaker.simulated ? SIMULATED_GONE : SPEAKER_GONE)));
  const none = make("li", "None: plate and speaker report no fault.", { className: "fine" });
  byId("faults").replaceChildren(...(items.length ? items : [none]));
}

export function gap() {
  shown = null;
  byId("faults").replaceChildren(make("li", "Not known: the service is not heard.", { className: "fine" }));
}

export function trouble({ code, text }) {
  const troubles = byId("troubles");
  troubles.hidden = false;
  troubles.prepend(make("li", `${clock()} ${code}: ${text}`));
  while (troubles.children.length > MOST_TROUBLES) troubles.lastElementChild.remove();
}

function plateFault([name, text]) {
  const [, seen, cure] = /^(.*\)): (.*)$/s.exec(text) ?? [null, text, "look it up in the firmware's pages"];
  return fault(name, `The plate is off: ${seen}.`, cure);
}

function fault(name, seen, cure) {
  const item = make("li", "", { className: "fault" });
  item.append(make("span", seen), make("span", `What to do: ${cure}.`, { className: "cure" }));
  item.dataset.fault = name;
  return item;
}
