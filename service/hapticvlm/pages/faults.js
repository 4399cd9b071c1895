// Faults in words with what to do, and what else went wrong lately.
import { byId, clock, make } from "./dom.js";

const MOST_TROUBLES = 8;
let shown = null;

// `faults`: {name: "what was seen (name, number n): what to do"}, as the status words them.
export function showFaults(faults) {
  const key = JSON.stringify(faults);
  if (key === shown) return;
  shown = key;
  const texts = Object.entries(faults);
  const none = make("li", "None: the plate and its board report no fault.", { className: "fine" });
  byId("faults").replaceChildren(...(texts.length ? texts.map(fault) : [none]));
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

function fault([name, text]) {
  const [, seen, cure] = /^(.*\)): (.*)$/s.exec(text) ?? [null, text, "look it up in the firmware's pages"];
  const item = make("li", "", { className: "fault" });
  item.append(make("span", `The plate is off: ${seen}.`), make("span", `What to do: ${cure}.`, { className: "cure" }));
  item.dataset.fault = name;
  return item;
}
