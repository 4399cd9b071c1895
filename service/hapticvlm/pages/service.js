// What the service says of itself once a second: owner, models, VLM, drops and refusals.
import { byId, list, say } from "./dom.js";

let welcomed = null;

export function welcome(message) {
  welcomed = message;
}

export function show(status) {
  say(byId("owner"), ownerWords(status));
  byId("owner").dataset.owned = String(Boolean(status.owner));
  list(byId("service"), facts(status));
  list(byId("counts"), counts(status));
}

function ownerWords({ owner, leases }) {
  if (!owner) return "Nobody owns the outputs";
  const [, name] = /^'(.*)' #\d+$/.exec(owner) ?? [null, owner];
  return `Owner: ${name}${leases ? ", touching" : ""}`;
}

function facts(status) {
  return [
    ["owner of the outputs", status.owner?.replaceAll("'", "") ?? "nobody"],
    ["touching (leases)", status.leases],
    ["connections, with this page", status.connections],
    ["encoder", status.recogniser.encoder ?? "none"],
    ["vision-language model", vlm(status.vlm)],
    ["dose, heated for", `${status.plate.dose_cem43.toFixed(3)} CEM43, ${status.plate.heated_s.toFixed(0)} s`],
    ["real-time audio", status.speaker.realtime ? "yes" : "no"],
    ...privacy(),
  ];
}

function vlm(state) {
  if (!state) return "none: ambient from the scene or the default";
  if (state.absent) return `absent: ${state.absent}`;
  const where = state.remote ? "remote, frames are sent there" : "on this machine";
  const now = state.name ? (state.busy ? "answering" : "idle") : "loading";
  const told = `${state.answered} answered, ${state.failed} failed, ${state.dropped} dropped`;
  const error = state.last_error ? `; last error: ${state.last_error}` : "";
  return `${state.name ?? "not loaded yet"} (${where}), ${now}; ${told}${error}`;
}

function privacy() {
  if (!welcomed) return [];
  const { frames_stored, frames_leave_machine } = welcomed.privacy;
  return [
    ["frames are stored", frames_stored ? "YES" : "no"],
    ["frames may leave this machine", frames_leave_machine ? "YES" : "no"],
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
  const counted = Object.entries(status.counts).sort(([one], [other]) => one.localeCompare(other));
  const plate = Object.entries(status.plate.counts ?? {}).map(([name, count]) => [`plate: ${name}`, count]);
  return [...fixed, ...counted, ...plate];
}
