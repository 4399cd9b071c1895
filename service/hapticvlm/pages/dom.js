// Helpers that all panels use to change the page.

export const byId = (id) => document.getElementById(id);

// Sets the text only if it differs; most of the text does not change with each message.
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function make(tag, text = "", fields = {}) {
  return Object.assign(document.createElement(tag), { textContent: text, ...fields });
}

// Writes [[term, text], ...] into a <dl> and reuses its rows.
export function list(dl, entries) {
  while (dl.children.length > entries.length) dl.lastElementChild.remove();
  entries.forEach(([term, text], index) => {
    const row = dl.children[index] ?? dl.appendChild(pair());
    setText(row.firstElementChild, term);
    setText(row.lastElementChild, String(text));
  });
}

// Returns a function that runs `paint` once in the next frame, however often it is called. A hidden page
// has no frames, so no calls accumulate.
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

// Copies the page's address with this fragment (`#...`), which also becomes the page's own, and without a token, which is
// not for others. Returns what to tell.
export async function copyAddress(fragment) {
  history.replaceState(null, "", fragment);
  const address = new URL(location.href);
  address.searchParams.delete("token");
  try {
    await navigator.clipboard.writeText(address.href);
    return "Copied.";
  } catch {
    return "It is in the address bar.";
  }
}

export const degrees = (value) => (value == null ? "no reading" : `${value.toFixed(1)} °C`);
export const percent = (share) => `${Math.round(100 * share)} %`;
// Returns a device's name, with "simulated" if it is simulated.
export const named = ({ name, simulated }) => (simulated && !name.includes("simulated") ? `${name}, simulated` : name);
export const clock = (date = new Date()) => date.toLocaleTimeString("en-GB");

function pair() {
  const row = document.createElement("div");
  row.append(document.createElement("dt"), document.createElement("dd"));
  return row;
}
