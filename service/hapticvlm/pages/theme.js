// The theme: light, dark or the system's, stored in this browser. Dispatches "themechange" when colours change.
import { byId } from "./dom.js";

const KEY = "hapticvlm-theme";
const CHOICES = ["system", "light", "dark"];

export function offerThemes() {
  const choice = byId("theme");
  choice.value = CHOICES.includes(remembered()) ? remembered() : "system";
  choice.addEventListener("change", () => {
    remember(choice.value);
    wear(choice.value);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", notifyChange);
  wear(choice.value);
}

function wear(name) {
  document.documentElement.dataset.theme = name;
  notifyChange();
}

function notifyChange() {
  document.dispatchEvent(new Event("themechange"));
}

// A browser may refuse storage; the choice then lasts as long as the page.
function remembered() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

function remember(name) {
  try {
    localStorage.setItem(KEY, name);
  } catch {
    return;
  }
}
