// "This is ...": a person states an object's material. The one place that asks the service to believe it.
import { byId, make, setText } from "./dom.js";
import { authorised } from "./link.js";

const FILE = "stated.json";
const KEPT_MS = 30_000;
const stated = new Set(); // object ids that a person has stated, now or before: a person may change it
let link = null;
let current = null;
let loadedFor = null;

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

// Offers the choice for the object that is shown; what the scene itself states needs none.
export function offer(decision, title) {
  const isOther = current?.object_id !== decision.object_id;
  current = decision;
  const isSettled = decision.source === "scene" && !stated.has(decision.object_id);
  byId("teach").hidden = !decision.object_id || isSettled;
  byId("teach-save").hidden = !stated.size;
  if (!isOther) return;
  setText(byId("teach-label"), `${title} is`);
  setText(byId("teach-told"), "");
  const likely = decision.material === "unknown" ? decision.runner_up : decision.material;
  if (likely) byId("teach-material").value = likely;
}

// What was stated is the service's to know: by another dashboard, or before this run. Read anew for each owner.
export async function show({ owner }) {
  if (owner === loadedFor) return;
  // A scene is touched, and spoken of, up to a second before a status names it: what was said since stays.
  if (loadedFor) stated.clear();
  loadedFor = owner;
  try {
    const { objects } = JSON.parse(await read());
    for (const { object_id } of objects) stated.add(object_id);
  } catch {
    loadedFor = null; // asked again with the next status
  }
}

async function read() {
  const answer = await fetch(`/${FILE}`, authorised(link.token));
  const text = await answer.text();
  if (!answer.ok) throw new Error(text.trim());
  return text;
}

// The service takes it for the owner's scene, from this machine only; a refusal is shown as it is.
async function state(material) {
  const { object_id } = current;
  const isNew = !stated.has(object_id);
  stated.add(object_id);
  const answer = await link.ask({ type: "scene", objects: [{ object_id, material }], replace: false });
  if (answer.type !== "ok" && isNew) stated.delete(object_id);
  byId("teach-save").hidden = !stated.size;
  setText(byId("teach-told"), answer.type === "ok" ? `Taken: ${material}, until the scene ends.` : (answer.text ?? "The service did not answer."));
}

// All that was stated of this scene, as a file that the service reads at its next start.
async function save() {
  try {
    const href = URL.createObjectURL(new Blob([await read()], { type: "application/json" }));
    make("a", "", { href, download: FILE }).click();
    setTimeout(() => URL.revokeObjectURL(href), KEPT_MS); // the browser reads it after the click
    setText(byId("teach-told"), `Saved: start with --stated ${FILE} next time.`);
  } catch (error) {
    setText(byId("teach-told"), `Not saved: ${error.message}`);
  }
}
