// "This is ...": a person states an object's material. The one place that asks the service to believe it.
import { byId, make, setText } from "./dom.js";

const stated = new Set(); // object ids that this page has stated: a person may change it
let link = null;
let current = null;

export function begin(given) {
  link = given;
  byId("teach").addEventListener("submit", (event) => {
    event.preventDefault();
    state(byId("teach-material").value);
  });
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
  if (!isOther) return;
  setText(byId("teach-label"), `${title} is`);
  setText(byId("teach-told"), "");
  const likely = decision.material === "unknown" ? decision.runner_up : decision.material;
  if (likely) byId("teach-material").value = likely;
}

// The service takes it for the owner's scene, from this machine only; a refusal is shown as it is.
async function state(material) {
  const { object_id } = current;
  stated.add(object_id);
  const answer = await link.ask({ type: "scene", objects: [{ object_id, material }], replace: false });
  if (answer.type !== "ok") stated.delete(object_id);
  setText(byId("teach-told"), answer.type === "ok" ? `Taken: ${material}, until the scene ends.` : (answer.text ?? "The service did not answer."));
}
