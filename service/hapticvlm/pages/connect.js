// Shows how to connect a scene while none is connected: the address, example code, and a QR code for a phone.
import { byId, make, setText } from "./dom.js";

const SNIPPETS = {
  Python: (url) => `import asyncio
from hapticvlm.client import connect

async def main():
    async with connect("${url}") as client:
        await client.scene([{"object_id": "cup", "name": "GlassCup"}])
        await client.touch("contact", "cup", speed_mps=0.4, force_n=2.0)
        await client.touch("release", "cup")

asyncio.run(main())`,
  Unity: (url) => `// Package Manager: add the package in unity_client,
// then GameObject > HapticVLM > Set Up Scene,
// and enter this address in the client:
${url}`,
  Godot: (url) => `# Copy examples/godot/addons/hapticvlm into your project,
# enable it in Project Settings > Plugins, add a HapticObject
# below each body and a HapticHand to each hand. Then:
HapticVLM.connect_to("${url}")`,
  Browser: (url) => `import {Haptics, Pulses} from 'hapticvlm'; // npm pack examples/webxr/client

const haptics = new Haptics('${url}');
const pulses = new Pulses(); // controllers: pulses.play(source), every frame
pulses.follow(haptics);
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

// `status.reach`: {page: address for other machines of the network or null, why: the reason} from the service.
// `place` is the path below that address, with the image of its QR code.
export function show({ reach }, place = { path: "", code: "connect.svg" }) {
  const page = reach?.page ? `${reach.page}${place.path}` : null;
  if (byId("reach").dataset.page === String(page)) return;
  byId("reach").dataset.page = String(page);
  byId("qr").hidden = page === null;
  if (page !== null) byId("qr").src = place.code;
  setText(byId("reach-said"), page ? there(page, reach.page) : (reach?.why ?? "").replaceAll("`", ""));
}

// Names the page for browsers, and the address of the service for programs of Unity or Godot.
function there(page, service) {
  return `On a phone or headset in this network, open ${page}. A program there connects to ${service.replace("http", "ws")} with the token.`;
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
    setText(byId("copied"), "This browser could not copy it: select and copy the text.");
  }
}
