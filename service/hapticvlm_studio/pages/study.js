// The participant's page: shows the view the study sends and asks for what is pressed. It never
// learns which pattern a trial presents.
import { make } from "./dom.js";
import { draw, paragraphs } from "./study.form.js";
import { glyph, warmth } from "./glyphs.js";
import { offerSound, silence, sound, startSound } from "./study.sound.js";
import { learn, own, phase, speak, spoken, text, word } from "./study.texts.js";

const KEYS = "1234567890abcdefghijklmnoqrstuvwxyz";
const FORMS = ["consent", "questions", "rating"];
const byId = (id) => document.getElementById(id);
let socket = null;
let view = null;
let study = null;
let askedAt = null;
let drawn = null; // what the form shows, so that an answer half given stays

function connect() {
  socket = new WebSocket(`ws://${location.host}/`);
  socket.onmessage = (event) => receive(JSON.parse(event.data));
  socket.onclose = () => {
    silence();
    if (study) showPrompt(...phase("lost"));
    else showPrompt("No connection", "");
    for (const button of document.querySelectorAll(".pattern, #go, #pause, #form button")) button.disabled = true;
    drawn = null;
    setTimeout(connect, 500);
  };
}

function ask(request) {
  const isOpen = socket?.readyState === WebSocket.OPEN;
  if (isOpen) socket.send(JSON.stringify(request));
  return isOpen;
}

function receive(message) {
  if (message.waveform) return sound.take(message.waveform);
  if (message.refused) return alarm(message.refused);
  if (message.texts) return setUp(message);
  if (message.phase === "asking" && view?.phase !== "asking") askedAt = performance.now();
  const before = view?.phase;
  view = message;
  if (view.participant) history.replaceState(null, "", `#${encodeURIComponent(view.participant)}`);
  if (view.phase !== before && isQuiet()) silence();
  alarm(view.trouble);
  if (view.phase !== "consent") speak(view.language);
  show();
}

function setUp({ texts, form }) {
  study = form;
  learn(texts);
}

const isAnswered = () => view.answered !== undefined && view.answered >= view.trials;

// Whether no pattern can play any more; right after the last answer one still does.
function isQuiet() {
  return ["done", "stopped", "choosing"].includes(view.phase) || (isAnswered() && FORMS.includes(view.phase));
}

function words() {
  return { renderings: view.renderings_wanted, trials: view.trials - view.answered, pattern: view.feeling && called(view.feeling) };
}

// Who sat here before the study or the page began anew: the address keeps the code, so that nobody
// takes part under another's by accident.
function satHere() {
  const code = decodeURIComponent(location.hash.slice(1));
  return view.phase === "choosing" && view.participants.some((person) => person.code === code) ? code : null;
}

function prompt() {
  if (satHere()) return phase("resuming", { participant: satHere() });
  if (view.phase !== "training") return phase(view.phase, words());
  if (view.feeling) return phase("feeling", words());
  return phase(view.next_to_feel ? "training" : "trained", words());
}

function show() {
  showPrompt(...prompt());
  const { speaker, peltier } = view.devices;
  byId("devices").textContent = [speaker, peltier].map((device) => device.name + (device.simulated && !device.name.includes("simulated") ? ` (${text("page.simulated")})` : "")).join(", ");
  const title = own(study.title) || text("page.study");
  byId("title").textContent = view.participant ? `${title} · ${view.participant}` : title;
  document.title = title;
  showProgress();
  showPeople();
  showForm();
  showActions();
  layPatterns();
  showPatterns();
}

function showPrompt(title, detail) {
  if (byId("prompt").textContent !== title) byId("prompt").textContent = title;
  byId("detail").textContent = detail;
}

function alarm(why) {
  byId("alert").hidden = !why;
  byId("alert").textContent = why ?? "";
}

function showProgress() {
  const bar = byId("progress");
  byId("course").hidden = !view.participant || FORMS.slice(0, 2).includes(view.phase);
  bar.max = view.trials ?? 1;
  bar.value = view.answered ?? 0;
  bar.ariaLabel = text("page.trials_answered");
  bar.dataset.answered = bar.value;
  const minutes = !view.is_trained || view.seconds_left == null || isAnswered() ? null : Math.max(1, Math.round(view.seconds_left / 60));
  const counted = text("page.progress", { answered: view.answered ?? 0, trials: view.trials ?? 0 });
  byId("left").textContent = minutes === null ? counted : `${counted}, ${text("page.left", { minutes })}`;
}

function showPeople() {
  const people = view.phase === "choosing" ? view.participants : [];
  const again = satHere();
  const first = people.toSorted((a, b) => (b.code === again) - (a.code === again));
  byId("people").replaceChildren(...first.map((person) => {
    const button = make("button", person.code, { type: "button", className: person.code === again ? "again" : "" });
    button.dataset.participant = person.code;
    button.append(make("span", text("page.progress", person)));
    button.addEventListener("click", () => ask({ do: "choose", participant: person.code }));
    return button;
  }));
}

// Redrawn only when something else is asked: half an answer must not vanish with the next view.
function showForm() {
  const form = byId("form");
  form.hidden = !FORMS.includes(view.phase);
  const wanted = form.hidden ? null : [view.phase, view.participant, view.questions, view.to_rate, spoken()].join();
  if (wanted && wanted !== drawn) draw(form, view.phase, view, study, ask);
  drawn = wanted;
  const instructions = byId("instructions");
  instructions.hidden = !["training", "ready"].includes(view.phase) || !own(study.instructions);
  if (!instructions.hidden) instructions.replaceChildren(...paragraphs(own(study.instructions)));
}

function goes() {
  switch (view.phase) {
    case "training": return text(view.next_to_feel ? "buttons.play_next" : "buttons.start");
    case "ready": return text(view.answered ? "buttons.go_on" : "buttons.start");
    case "paused": case "stopped": case "trouble": return text("buttons.go_on");
    default: return null;
  }
}

function showActions() {
  const go = byId("go");
  const label = goes();
  go.hidden = label === null;
  go.disabled = view.phase === "training" && Boolean(view.busy);
  go.replaceChildren(label ?? "", " ", make("kbd", text("page.space")));
  const canPause = ["resting", "playing", "asking", "rating"].includes(view.phase);
  byId("pause").hidden = !canPause;
  byId("pause").disabled = !canPause;
  byId("leave").hidden = !["consent", "done"].includes(view.phase); // else it is for the experimenter's page
  byId("masking").hidden = !view.masking_noise || view.phase === "choosing";
  byId("hear").hidden = !view.hear;
  byId("masking-level").ariaLabel = text("page.masking_level");
  byId("hear-level").ariaLabel = text("page.hear_level");
}

function layPatterns() {
  const laid = byId("patterns");
  const wanted = `${spoken()} ${view.patterns.map((pattern) => pattern.name)}`;
  if (laid.dataset.laid === wanted) return;
  laid.dataset.laid = wanted;
  laid.replaceChildren(...view.patterns.map((pattern, index) => {
    const button = make("button", "", { type: "button", className: "pattern" });
    button.dataset.pattern = pattern.name;
    button.append(make("kbd", KEYS[index] ?? ""), glyph(pattern), make("span", word(pattern.vibration, study)), warmth(pattern, word(pattern.temperature, study)), make("span", "", { className: "dots" }));
    button.addEventListener("click", () => press(pattern.name));
    return button;
  }));
}

function showPatterns() {
  byId("patterns").hidden = !view.participant || ["done", ...FORMS].includes(view.phase);
  for (const button of document.querySelectorAll(".pattern")) {
    const name = button.dataset.pattern;
    const rendered = view.renderings?.[name] ?? 0;
    const training = view.phase === "training";
    button.disabled = training ? Boolean(view.busy) : view.phase !== "asking";
    button.classList.toggle("next", training && !view.busy && view.next_to_feel === name);
    button.classList.toggle("playing", view.feeling === name);
    button.querySelector(".dots").textContent = training ? "●".repeat(rendered) + "○".repeat(Math.max(0, view.renderings_wanted - rendered)) : "";
  }
}

function called(name) {
  const pattern = view.patterns.find((each) => each.name === name);
  return `${word(pattern.vibration, study)}, ${word(pattern.temperature, study)}`;
}

function press(name) {
  if (view.phase === "training") {
    startSound(view, ask);
    ask({ do: "feel", pattern: name });
  }
  if (view.phase === "asking") ask({ do: "answer", trial: view.answered, pattern: name, seen_ms: performance.now() - askedAt });
}

function go() {
  startSound(view, ask);
  if (view.phase === "training" && view.next_to_feel) ask({ do: "feel", pattern: view.next_to_feel });
  else ask({ do: "begin" });
}

function stop() {
  silence();
  if (!ask({ do: "stop" })) alarm(text("page.not_stopped"));
}

function onKey(event) {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || !view) return;
  if (event.key === "Escape") return stop();
  if (event.target.closest?.("#form")) return;
  const at = KEYS.indexOf(event.key.toLowerCase());
  if (event.key === " " || event.key === "Enter") {
    if (event.target.closest?.("button, input") || byId("go").hidden || byId("go").disabled) return;
    event.preventDefault();
    go();
  } else if (event.key.toLowerCase() === "p") {
    if (!byId("pause").hidden) ask({ do: "pause" });
  } else if (at >= 0 && at < view.patterns.length && !byId("patterns").hidden && !document.querySelectorAll(".pattern")[at].disabled) press(view.patterns[at].name);
}

byId("go").addEventListener("click", go);
byId("stop").addEventListener("click", stop);
byId("pause").addEventListener("click", () => ask({ do: "pause" }));
byId("leave").addEventListener("click", () => {
  silence();
  history.replaceState(null, "", "#");
  ask({ do: "leave" });
});
byId("form").addEventListener("language", show);
document.addEventListener("keydown", onKey);
offerSound(ask);
connect();
