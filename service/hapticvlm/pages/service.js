// Shows the service's status once a second: owner, models, VLM, drops and refusals.
import { byId, list, setText } from "./dom.js";

const IDLE_S = 30; // idle time of an owner after which another scene may take the outputs

let welcomed = null;

export function welcome(message) {
  welcomed = message;
}

export function show(status) {
  setText(byId("owner"), ownerWords(status));
  byId("owner").dataset.owned = String(Boolean(status.owner));
  byId("end-owner").hidden = !isIdle(status);
  list(byId("service"), facts(status));
  list(byId("counts"), counts(status));
}

// Offers to end an idle owner, which may hang.
export function offerEnd(link, whenDone) {
  byId("end-owner").addEventListener("click", async () => {
    const answer = await link.ask({ type: "set", ownership: "end" });
    const ended = answer.type === "ok" ? "Ended." : `Not ended: ${answer.text ?? "no answer"}.`;
    setText(byId("end-owner-told"), ended);
    whenDone();
  });
}

function isIdle({ owner, owner_idle_s }) {
  return Boolean(owner) && owner_idle_s >= IDLE_S;
}

function ownerWords(status) {
  const { owner, leases, owner_idle_s } = status;
  if (!owner) return "Nobody owns the outputs";
  const [, name] = /^'(.*)' #\d+$/.exec(owner) ?? [null, owner];
  const idle = isIdle(status) ? `, idle for ${owner_idle_s.toFixed(0)} s` : "";
  return `Owner: ${name}${leases ? ", touching" : idle}`;
}

function facts(status) {
  return [
    ["owner of the outputs", status.owner?.replaceAll("'", "") ?? "nobody"],
    ["active leases", status.leases],
    ...stopped(status),
    ["connections, including this page", status.connections],
    ["encoder", status.recogniser.encoder ?? "none"],
    ...shared(status.recogniser.remote),
    ["vision-language model", vlm(status.vlm)],
    ["thermal dose, heating time", `${status.plate.dose_cem43.toFixed(3)} CEM43, ${status.plate.heated_s.toFixed(0)} s`],
    ["real-time audio", status.speaker.realtime ? "yes" : "no"],
    ...privacy(),
  ];
}

// Lists the hands that a stop still holds, because they have not released and touched again.
function stopped({ held }) {
  const hands = Object.keys(held).filter((hand) => held[hand].length);
  return hands.length ? [["stopped until released", hands.map((hand) => `${hand} hand: ${held[hand].join(", ")}`).join("; ")]] : [];
}

function shared(state) {
  if (!state) return [];
  const now = state.is_used ? state.identity : state.reason ? `not used: ${state.reason}` : "not used yet";
  return [["shared recogniser", `${now}; ${state.answered} answered, ${state.failed} failed, ${state.local} done locally`]];
}

function vlm(state) {
  if (!state) return "none: ambient from the scene or the default";
  if (state.absent) return `absent: ${state.absent}`;
  const where = state.remote ? "remote: frames are sent to it" : "on this machine";
  const now = state.name ? (state.busy ? "answering" : "idle") : "loading";
  const totals = `${state.answered} answered, ${state.failed} failed, ${state.dropped} dropped`;
  const error = state.last_error ? `; last error: ${state.last_error}` : "";
  return `${state.name ?? "not loaded yet"} (${where}), ${now}; ${totals}${error}`;
}

function privacy() {
  if (!welcomed) return [];
  const { frames_stored, frames_leave_machine, crops_leave_machine } = welcomed.privacy;
  return [
    ["frames are stored", frames_stored ? "YES" : "no"],
    ["frames may leave this machine", frames_leave_machine ? "YES" : "no"],
    ["crops of objects may leave this machine", crops_leave_machine ? "YES" : "no"],
    ["service", `${welcomed.service.name} ${welcomed.service.version}`],
  ];
}

function counts(status) {
  const fixed = [
    ["audio underruns", status.speaker.underruns],
    ["lost audio commands", status.speaker.lost_commands],
    ["audio engine restarts", status.speaker.restarts],
    ["recogniser restarts", status.recogniser.restarts],
  ];
  if (status.vlm) fixed.push(["vision-language model restarts", status.vlm.restarts]);
  const counted = Object.entries(status.counts).sort(([a], [b]) => a.localeCompare(b));
  const plate = Object.entries(status.plate.counts ?? {}).map(([name, count]) => [`plate: ${name.replaceAll("_", " ")}`, count]);
  return [...fixed, ...counted, ...plate];
}
