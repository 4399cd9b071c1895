// How to connect a scene, for as long as none is: the address, a few lines to copy, and a code for a phone.
import { byId, make, setText } from "./dom.js";

const SNIPPETS = {
  Python: (url) => `from hapticvlm.client import connect

async with connect("${url}") as client:
    await client.scene([{"object_id": "cup", "name": "GlassCup"}])
    await client.touch("contact", "cup", speed_mps=0.4, force_n=2.0)`,
  Unity: (url) => `// Package Manager: add the package in unity_client,
// then GameObject > HapticVLM > Set up scene,
// and give the client this address:
${url}`,
  Browser: (url) => `import {Haptics} from './haptics.js'; // examples/webxr

const haptics = new Haptics('${url}');
haptics.scene([{object_id: 'cup', name: 'GlassCup'}]);
haptics.touch({phase: 'contact', object_id: 'cup', hand: 'right',
               speed_mps: 0.4, force_n: 2, interaction: 'tap'});`,
};

export function begin(url) {
  choose("Python", url);
  for (const name of Object.keys(SNIPPETS)) {
    const button = make("button", name, { type: "button", ariaPressed: String(name === "Python") });
    button.addEventListener("click", () => choose(name, url));
    byId("snippets").append(button);
  }
  setText(byId("address"), url);
  byId("copy").addEventListener("click", () => copy(byId("snippet").textContent));
}

// `status.reach`: {page: address that others of the network open, or null, why} as the service says.
export function show({ reach }) {
  const page = reach?.page ?? null;
  if (byId("reach").dataset.page === String(page)) return;
  byId("reach").dataset.page = String(page);
  byId("qr").hidden = page === null;
  if (page !== null) byId("qr").src = "connect.svg";
  setText(byId("reach-said"), page ? `Open ${page} on a phone or headset of this network.` : (reach?.why ?? ""));
}

function choose(name, url) {
  setText(byId("snippet"), SNIPPETS[name](url));
  for (const button of byId("snippets").children) button.ariaPressed = String(button.textContent === name);
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    setText(byId("copied"), "Copied.");
  } catch {
    setText(byId("copied"), "This browser did not copy it: select the text.");
  }
}
