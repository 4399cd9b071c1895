// The recorded sessions, where this service keeps them: each is a page of its own to look through.
import { byId, make, setText } from "./dom.js";
import { authorised } from "./link.js";

let link = null;
let listedFor = null;

export function begin(given) {
  link = given;
  byId("sessions-open").addEventListener("click", () => {
    list();
    byId("sessions-title").scrollIntoView({ block: "center" });
    byId("sessions-title").focus();
  });
}

// Listed anew when a connection came or went: then a session may have begun or ended.
export function show({ record, connections, owner }) {
  byId("sessions-open").hidden = byId("sessions-card").hidden = !record;
  const now = `${connections} ${owner}`;
  if (!record || now === listedFor) return;
  listedFor = now;
  list();
}

async function list() {
  try {
    const answer = await fetch("/sessions", authorised(link.token));
    if (!answer.ok) throw new Error(await answer.text());
    const { sessions } = await answer.json();
    byId("sessions").replaceChildren(...sessions.map(row));
    setText(byId("sessions-told"), sessions.length ? "" : "None yet: a scene that connects is recorded.");
  } catch (error) {
    setText(byId("sessions-told"), `Not listed: ${error.message}`);
  }
}

function row({ name, written_at, has_frames }) {
  const item = make("li");
  const href = `/sessions/${encodeURIComponent(name)}`;
  const when = new Date(1000 * written_at).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" });
  const frames = has_frames ? "with frames" : "no frames kept";
  item.append(make("a", name, { href, target: "_blank", rel: "noopener" }));
  item.append(make("small", `${when}, ${frames}`));
  return item;
}
