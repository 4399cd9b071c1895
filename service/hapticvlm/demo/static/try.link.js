// Takes the place of link.js where the page is plain files: answers as the service would, from a bake.
//
// It has the part of the protocol that the page speaks. What is stated to be of a material is decided as the service decided
// that material when the page was written (`try.decisions.json`); nothing else is recognised here.
import { BakedWave } from "./scene/webxr/baked.js";
import { openFeel } from "./scene/webxr/client/feel.js";
import { FeelPlayer } from "./scene/webxr/client/player.js";

const PLAN_MS = 30;
const HAND = "right";
const OK = { type: "ok" };

const read = async (name) => (await fetch(new URL(name, import.meta.url))).json();
const { service, decisions } = await read("try.decisions.json");
const feel = openFeel(await read("scene/webxr/client/feel.true.json"));
const links = [];
const materials = new Map(); // that were stated, by object id
const player = new FeelPlayer(feel, ({ felt }) => felt);
const wave = new BakedWave(feel, (piece) => tell("observer", { type: "view", ...piece }));
let plays = false;

const ANSWERS = {
  scene({ objects, replace }) {
    if (replace) materials.clear();
    for (const { object_id: id, material } of objects) materials.set(id, material);
  },
  frame: ({ object_id: id }) => ({ ...(decisions[materials.get(id)] ?? { ...decisions.unknown, neutral_because: "unseen" }), object_id: id }),
  touch({ object_id: id, ...touch }) {
    const material = materials.get(id);
    const felt = material && { material };
    wave.touch(touch, felt);
    if (player.touch({ ...touch, felt }, performance.now() / 1000)) plan();
  },
  stop() {
    player.stop();
    wave.stop();
    plan();
  },
};

export class Link {
  state = "connecting";

  constructor(url, { onMessage, onState = () => {}, role = "observer" }) {
    Object.assign(this, { onMessage, onState, role });
    links.push(this);
  }

  connect() {
    setTimeout(() => {
      this.state = "open";
      this.onState(this.state);
      const simulated = { simulated: true };
      const devices = { speaker: simulated, peltier: simulated };
      this.onMessage({ type: "welcome", owner: true, service, devices, materials: [...feel.materials.keys()] });
    });
  }

  async ask(message) { return ANSWERS[message.type]?.(message) ?? OK; }
}

function tell(role, message) {
  for (const link of links) if (link.role === role && link.state === "open") link.onMessage(message);
}

// Sends what a gamepad or a phone plays next, and once that nothing is left to play.
function plan() {
  const next = player.plan(HAND, "amplitude", performance.now() / 1000);
  const isHeard = next.amplitude.length > 0;
  if (isHeard || plays) tell("scene", { type: "vibration", hand: HAND, ...next });
  plays = isHeard;
}

setInterval(plan, PLAN_MS);
