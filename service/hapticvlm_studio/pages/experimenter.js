// The experimenter's page: shows which pattern is presented, what the devices do and how long it still takes.
import { byId, degrees, list, make, named, percent, setText } from "./dom.js";

const PHASES = {
  choosing: "No participant is chosen", consent: "The participant reads the consent", questions: "The participant answers questions", training: "Training",
  ready: "Ready for the trials", resting: "The participant rests before the next pattern", playing: "A pattern is playing", asking: "The participant is asked which pattern it was",
  rating: "The participant rates the pattern", paused: "Paused", stopped: "Stopped: vibration and plate are at rest", trouble: "A device has a problem", done: "All done",
};
let socket = null;
let view = null;

function connect() {
  socket = new WebSocket(`ws://${location.host}/experimenter`);
  socket.onmessage = ({ data }) => receive(JSON.parse(data));
  socket.onclose = () => {
    setText(byId("prompt"), "No connection to the study: what is shown is out of date");
    for (const id of ["pause", "go"]) byId(id).disabled = true;
    setTimeout(connect, 500);
  };
}

function send(request) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(request));
  else alarm("NOT SENT: no connection to the study. Switch the devices off by hand.");
}

function receive(message) {
  if (message.texts) return;
  if (message.refused) return alarm(message.refused);
  view = message;
  alarm(view.trouble);
  show();
}

function alarm(reason) {
  byId("alert").hidden = !reason;
  setText(byId("alert"), reason ?? "");
}

function show() {
  setText(byId("title"), view.participant ? `Experimenter, ${view.participant}` : "Experimenter");
  setText(byId("prompt"), PHASES[view.phase]);
  byId("progress").max = view.trials ?? 1;
  byId("progress").value = view.answered ?? 0;
  setText(byId("left"), view.participant ? `${view.answered} of ${view.trials} trials${left()}` : "");
  list(byId("now"), now());
  list(byId("outputs"), outputs());
  byId("recent").replaceChildren(...(view.recent ?? []).toReversed().map(answer));
  const canPause = ["resting", "playing", "asking", "rating"].includes(view.phase);
  byId("pause").hidden = !canPause;
  byId("pause").disabled = false;
  byId("go").hidden = !["paused", "stopped", "trouble"].includes(view.phase);
  byId("go").disabled = false;
  byId("leave").hidden = !view.participant || canPause;
  showPeople();
}

function left() {
  return view.seconds_left == null || view.answered >= view.trials ? "" : `, about ${Math.max(1, Math.round(view.seconds_left / 60))} min of ${view.is_trained ? "trials" : "training"} left`;
}

function now() {
  if (!view.participant) return [["participant", "none"]];
  const rendered = Object.values(view.renderings ?? {}).reduce((sum, each) => sum + each, 0);
  return [
    pattern(),
    ["presented", `${view.attempt} time${view.attempt === 1 ? "" : "s"}`],
    ["correct so far", view.answered ? `${view.correct} of ${view.answered}, ${percent(view.correct / view.answered)}` : "no answer yet"],
    ["played in training", `${rendered}, planned ${view.patterns.length * view.renderings_wanted}`],
    ["language", view.language],
  ];
}

function pattern() {
  if (view.feeling) return ["playing in training", view.feeling];
  if (!view.is_trained) return ["next in training", view.next_to_feel ?? "none"];
  return [["playing", "asking"].includes(view.phase) ? "pattern presented" : "next pattern", view.next_trial ?? "none"];
}

function outputs() {
  const { plate_c: plate, setpoint_c: setpoint, speaker_level: level, faults, underruns } = view.outputs;
  return [
    ["speaker", named(view.devices.speaker)],
    ["plate", named(view.devices.peltier)],
    ["plate temperature", degrees(plate)],
    ["plate setpoint", degrees(setpoint)],
    ["speaker level", level == null ? "no reading" : percent(level)],
    ["underruns", view.devices.speaker.simulated ? "not counted: simulated" : underruns ?? "no reading"],
    ["faults", faults?.length ? faults.join(", ") : "none"],
    ["sound for the participant", view.hear ? "the vibration (pilot)" : view.masking_noise ? "masking noise" : "none"],
  ];
}

function answer({ trial, pattern, answered, reaction_s: reaction }) {
  const row = make("tr");
  row.append(make("td", String(trial + 1)), make("td", pattern), make("td", pattern === answered ? "✓ correct" : answered), make("td", reaction.toFixed(1)));
  return row;
}

function showPeople() {
  const shown = JSON.stringify([view.participants, view.participant]);
  if (byId("people").dataset.shown === shown) return;
  byId("people").dataset.shown = shown;
  byId("people").replaceChildren(...view.participants.map(({ code, answered, trials }) => {
    const button = make("button", code, { type: "button", disabled: Boolean(view.participant) });
    button.append(make("span", `${answered} of ${trials} trials${code === view.participant ? ", open" : ""}`));
    button.addEventListener("click", () => send({ do: "choose", participant: code }));
    return button;
  }));
}

byId("stop").addEventListener("click", () => send({ do: "stop" }));
byId("pause").addEventListener("click", () => send({ do: "pause" }));
byId("go").addEventListener("click", () => send({ do: "begin" }));
byId("leave").addEventListener("click", () => send({ do: "leave" }));
document.addEventListener("keydown", (event) => { if (event.key === "Escape") send({ do: "stop" }); });
connect();
