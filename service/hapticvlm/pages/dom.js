// The few things every panel does to the page.

export const byId = (id) => document.getElementById(id);

// Sets text only when it differs: ten times a second, most of it does not.
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function make(tag, text = "", fields = {}) {
  return Object.assign(document.createElement(tag), { textContent: text, ...fields });
}

// Writes [[term, text], ...] into a <dl>, keeping the rows that are there.
export function list(dl, entries) {
  while (dl.children.length > entries.length) dl.lastElementChild.remove();
  entries.forEach(([term, text], index) => {
    const row = dl.children[index] ?? dl.appendChild(pair());
    setText(row.firstElementChild, term);
    setText(row.lastElementChild, String(text));
  });
}

// Returns what runs `paint` in the next frame, once however often it is called; a page nobody sees
// has no frames, so nothing piles up.
export function eachFrame(paint) {
  let isDue = false;
  return () => {
    if (isDue) return;
    isDue = true;
    requestAnimationFrame(() => {
      isDue = false;
      paint();
    });
  };
}

export const degrees = (value) => (value == null ? "no reading" : `${value.toFixed(1)} °C`);
export const percent = (share) => `${Math.round(100 * share)} %`;
// A device's name, with "simulated" where it is.
export const named = ({ name, simulated }) => (simulated && !name.includes("simulated") ? `${name}, simulated` : name);
export const clock = (date = new Date()) => date.toLocaleTimeString("en-GB");

function pair() {
  const row = document.createElement("div");
  row.append(document.createElement("dt"), document.createElement("dd"));
  return row;
}
