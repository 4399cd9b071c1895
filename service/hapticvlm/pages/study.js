// The participant's page: shows the view the study sends and asks for what is pressed. It never
// learns which pattern a trial presents.
import { glyph, warmth } from "./study.glyphs.js";
import { Masking } from "./study.masking.js";

const KEYS = "1234567890abcdefghijklmnoqrstuvwxyz";
const byId = (id) => document.getElementById(id);
const masking = new Masking();
let socket = null;
let view = null;
let askedAt = null;

function connect() {
  socket = new WebSocket(`ws://${location.host}/`);
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = () => {
    masking.stop();
    say("No connection to the study", "Nothing is lost. This page goes on by itself once the study runs again.");
    for (const button of document.querySelectorAll(".pattern, #go, #pause")) button.disabled = true;
    setTimeout(connect, 500);
  };
}

function ask(request) {
  const isOpen = socket?.readyState === WebSocket.OPEN;
  if (isOpen) socket.send(JSON.stringify(request));
  return isOpen;
}

function take(message) {
  if (message.refused) return alarm(message.refused);
  if (message.phase === "asking" && view?.phase !== "asking") askedAt = performance.now();
  const hadPatterns = view?.patterns.length === message.patterns.length;
  view = message;
  if (!hadPatterns) layPatterns();
  alarm(view.trouble);
  show();
}

const PROMPTS = {
  choosing: () => ["Who takes part?", "Each code is a participant; work goes on where it ended."],
  training: () => view.feeling
    ? [`Feel: ${nameOf(view.feeling)}`, "Rest your palm on the device."]
    : view.next_to_feel
      ? ["Get to know the patterns", `Each is played ${view.renderings_wanted} times; press one again whenever you like.`]
      : ["You felt every pattern", "Go on feeling them, or start the trials."],
  ready: () => ["Ready", `${view.trials - view.answered} trials to go. Feel the pattern, then say which it was. No answer is shown as right or wrong.`],
  resting: () => ["Rest", "The next pattern comes by itself."],
  playing: () => ["Now", "Rest your palm on the device."],
  asking: () => ["Which pattern was it?", "Press its picture or its key."],
  paused: () => ["Paused", "The interrupted pattern will be played again."],
  stopped: () => ["Stopped", "Vibration and plate are at rest."],
  trouble: () => ["Please wait", "The experimenter has to look at the devices."],
  done: () => ["Thank you", "All trials are answered."],
};

function show() {
  if (["done", "stopped"].includes(view.phase)) silence();
  const [title, detail] = PROMPTS[view.phase]();
  say(title, detail);
  const { speaker, peltier } = view.devices;
  byId("devices").textContent = [speaker, peltier].map((device) => device.name + (device.simulated && !device.name.includes("simulated") ? " (simulated)" : "")).join(", ");
  byId("title").textContent = view.participant ? `Study, ${view.participant}` : "Study";
  showProgress();
  showPeople();
  showActions();
  showPatterns();
}

function say(title, detail) {
  if (byId("prompt").textContent !== title) byId("prompt").textContent = title;
  byId("detail").textContent = detail;
}

function alarm(text) {
  byId("alert").hidden = !text;
  byId("alert").textContent = text ?? "";
}

function showProgress() {
  const bar = byId("progress");
  bar.hidden = !view.participant;
  bar.max = view.trials ?? 1;
  bar.value = view.answered ?? 0;
  bar.dataset.answered = bar.value;
}

function showPeople() {
  const people = view.phase === "choosing" ? view.participants : [];
  byId("people").replaceChildren(...people.map((person) => {
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.participant = person.code;
    button.append(person.code, Object.assign(document.createElement("span"), { textContent: `${person.answered} of ${person.trials} trials` }));
    button.addEventListener("click", () => { ask({ do: "choose", participant: person.code }); startMasking(true); });
    return button;
  }));
}

function goes() {
  const wake = view.answered ? "Go on" : "Start the trials";
  switch (view.phase) {
    case "training": return view.next_to_feel ? "Play the next" : "Start the trials";
    case "ready": return wake;
    case "paused": case "stopped": case "trouble": return "Go on";
    default: return null;
  }
}

function showActions() {
  const go = byId("go");
  const label = goes();
  const isBusy = view.phase === "training" && Boolean(view.busy);
  go.hidden = label === null;
  go.disabled = isBusy;
  go.replaceChildren(label ?? "", " ", Object.assign(document.createElement("kbd"), { textContent: "Space" }));
  const canPause = ["resting", "playing", "asking"].includes(view.phase);
  byId("pause").hidden = !canPause;
  byId("pause").disabled = !canPause;
  byId("leave").hidden = !view.participant || canPause;
  byId("masking").hidden = !view.masking_noise || view.phase === "choosing";
}

function layPatterns() {
  byId("patterns").replaceChildren(...view.patterns.map((pattern, index) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "pattern";
    button.dataset.pattern = pattern.name;
    const key = Object.assign(document.createElement("kbd"), { textContent: KEYS[index] ?? "" });
    const name = Object.assign(document.createElement("span"), { textContent: pattern.vibration });
    const dots = Object.assign(document.createElement("span"), { className: "dots" });
    button.append(key, glyph(pattern), name, warmth(pattern), dots);
    button.addEventListener("click", () => press(pattern.name));
    return button;
  }));
}

function showPatterns() {
  byId("patterns").hidden = !view.participant || view.phase === "done";
  for (const button of document.querySelectorAll(".pattern")) {
    const name = button.dataset.pattern;
    const felt = view.renderings?.[name] ?? 0;
    const training = view.phase === "training";
    button.disabled = training ? Boolean(view.busy) : view.phase !== "asking";
    button.classList.toggle("next", training && !view.busy && view.next_to_feel === name);
    button.classList.toggle("playing", view.feeling === name);
    button.querySelector(".dots").textContent = training ? "●".repeat(felt) + "○".repeat(Math.max(0, view.renderings_wanted - felt)) : "";
  }
}

function nameOf(name) {
  const pattern = view.patterns.find((each) => each.name === name);
  return `${pattern.vibration}, ${pattern.temperature}`;
}

function press(name) {
  if (view.phase === "training") ask({ do: "feel", pattern: name });
  if (view.phase === "asking") ask({ do: "answer", trial: view.answered, pattern: name, seen_ms: performance.now() - askedAt });
}

function go() {
  startMasking(true);
  if (view.phase === "training" && view.next_to_feel) ask({ do: "feel", pattern: view.next_to_feel });
  else ask({ do: "begin" });
}

function stop() {
  silence();
  if (!ask({ do: "stop" })) alarm("NOT STOPPED: no connection to the study; switch the devices off by hand");
}

function startMasking(isTold) {
  if (view.masking_noise && !masking.isOn) setMasking(true, isTold);
}

// Ends the noise and unticks its box, without a word to the study.
function silence() {
  if (masking.isOn) setMasking(false, false);
}

function setMasking(on, isTold = true) {
  if (on) masking.start(Number(byId("masking-level").value));
  else masking.stop();
  byId("masking-on").checked = on;
  if (isTold) ask({ do: "masking", on });
}

function onKey(event) {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || !view) return;
  const at = KEYS.indexOf(event.key.toLowerCase());
  if (event.key === "Escape") stop();
  else if (event.key === " " || event.key === "Enter") {
    if (event.target.closest?.("button, input") || byId("go").hidden || byId("go").disabled) return;
    event.preventDefault();
    go();
  } else if (event.key.toLowerCase() === "p") {
    if (!byId("pause").hidden) ask({ do: "pause" });
  } else if (at >= 0 && at < view.patterns.length && !document.querySelectorAll(".pattern")[at].disabled) press(view.patterns[at].name);
}

byId("go").addEventListener("click", go);
byId("stop").addEventListener("click", stop);
byId("pause").addEventListener("click", () => ask({ do: "pause" }));
byId("leave").addEventListener("click", () => { masking.stop(); ask({ do: "leave" }); });
byId("masking-on").addEventListener("change", (event) => setMasking(event.target.checked));
byId("masking-level").addEventListener("input", (event) => masking.setLevel(Number(event.target.value)));
document.addEventListener("keydown", onKey);
connect();
