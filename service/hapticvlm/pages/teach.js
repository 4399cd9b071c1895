// The form in which a person states an object's material; the only place that sends it to the service.
import { byId, make, setText } from "./dom.js";
import { authorised } from "./link.js";

const FILE = "stated.json";
const URL_LIFETIME_MS = 30_000;
const stated = new Set(); // keys of objects and surfaces whose material a person has stated, and may change again
let link = null;
let current = null;
let loadedFor = null;

const keyOf = ({ object_id, surface }) => JSON.stringify([object_id, surface ?? null]);

// An object of several surfaces is corrected where it was touched; the others stay as they are.
const corrected = ({ object_id, surface }, material) =>
  surface == null ? { object_id, material } : { object_id, surfaces: [...Array(surface).fill({}), { material }] };

function* keysOf({ object_id, material, surfaces = [] }) {
  if (material) yield keyOf({ object_id });
  for (const [surface, own] of surfaces.entries()) if (own.material) yield keyOf({ object_id, surface });
}

export function begin(given) {
  link = given;
  byId("teach").addEventListener("submit", (event) => {
    event.preventDefault();
    state(byId("teach-material").value);
  });
  byId("teach-save").addEventListener("click", save);
}

export function welcome({ materials }) {
  const select = byId("teach-material");
  if (!select.options.length) select.append(...materials.map((name) => make("option", name, { value: name })));
}

// Offers the choice for the object shown, unless the scene itself states the material.
export function offer(decision, title) {
  const isOther = current === null || keyOf(current) !== keyOf(decision);
  current = decision;
  const isSettled = decision.source === "scene" && !stated.has(keyOf(decision)) && !stated.has(keyOf({ object_id: decision.object_id }));
  byId("teach").hidden = !decision.object_id || isSettled;
  byId("teach-save").hidden = !stated.size;
  if (!isOther) return;
  setText(byId("teach-label"), `${title} is`);
  setText(byId("teach-told"), "");
  const likely = decision.material === "unknown" ? decision.runner_up : decision.material;
  if (likely) byId("teach-material").value = likely;
}

// Reads the stated materials from the service for each new owner: other dashboards and earlier runs state some too.
export async function show({ owner }) {
  if (owner === loadedFor) return;
  // A status names a new owner up to a second late, so materials stated since then are not cleared.
  if (loadedFor) stated.clear();
  loadedFor = owner;
  try {
    const { objects } = JSON.parse(await read());
    for (const object of objects) for (const key of keysOf(object)) stated.add(key);
  } catch {
    loadedFor = null; // retried with the next status
  }
}

async function read() {
  const answer = await fetch(`/${FILE}`, authorised(link.token));
  const text = await answer.text();
  if (!answer.ok) throw new Error(text.trim());
  return text;
}

// The service accepts it for the owner's scene, from this machine only; a refusal is shown unchanged.
async function state(material) {
  const key = keyOf(current);
  const isNew = !stated.has(key);
  stated.add(key);
  const answer = await link.ask({ type: "scene", objects: [corrected(current, material)], replace: false });
  if (answer.type !== "ok" && isNew) stated.delete(key);
  byId("teach-save").hidden = !stated.size;
  setText(byId("teach-told"), answer.type === "ok" ? `Corrected to ${material} until the scene ends.` : (answer.text ?? "The service did not answer."));
}

// Saves the stated materials of this scene as a file for the service's next start.
async function save() {
  try {
    const href = URL.createObjectURL(new Blob([await read()], { type: "application/json" }));
    make("a", "", { href, download: FILE }).click();
    setTimeout(() => URL.revokeObjectURL(href), URL_LIFETIME_MS); // the browser reads it after the click
    setText(byId("teach-told"), `Saved: use --stated ${FILE} at the next start.`);
  } catch (error) {
    setText(byId("teach-told"), `Not saved: ${error.message}`);
  }
}
