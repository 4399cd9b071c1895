// The participant's page: shows the view that the study sends, and sends a command for what is
// pressed. It does not receive which pattern a trial presents.
import { make } from "./dom.js";
import { draw, paragraphs } from "./study.form.js";
import { NEUTRAL_C, warmthColour } from "./feel.js";
import { glyph, warmth } from "./glyphs.js";
import { offerSound, silence, sound, startSound } from "./study.sound.js";
import { learn, own, phase, speak, spoken, text, word } from "./study.texts.js";

const KEYS = "1234567890abcdefghijklmnoqrstuvwxyz";
const GROWN_C = 6; // from neutral, at which the colour of warmth has its full size
const LEAST_GROWN = 0.25; // of the full size, at neutral
const NEUTRAL_SHARE = 0.15; // of GROWN_C that is called neutral
const FORMS = ["consent", "questions", "rating"];
const byId = (id) => document.getElementById(id);
let socket = null;
let view = null;
let study = null;
let askedAt = null;
let drawn = null; // which form is drawn; it is not drawn again while a participant fills it in

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

function send(request) {
  const isOpen = socket?.readyState === WebSocket.OPEN;
  if (isOpen) socket.send(JSON.stringify(request));
  return isOpen;
}

function receive(message) {
  if (message.waveform) return sound.take(message.waveform);
  if ("plate_c" in message) return showWarmth(message.plate_c);
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

// Whether nothing can play any more. Right after the last answer, the last pattern still does.
function isQuiet() {
  return ["done", "stopped", "choosing"].includes(view.phase) || (isAnswered() && FORMS.includes(view.phase));
}

function words() {
  const count = view.renderings_wanted;
  return { renderings: count === 1 ? text("page.once") : text("page.times", { count }), trials: view.trials - view.answered, pattern: view.feeling && patternName(view.feeling) };
}

// The participant who took part here before the study or the page was restarted, or null. The page's
// address keeps the code, so that nobody continues another participant's trials by mistake.
function rememberedCode() {
  const code = decodeURIComponent(location.hash.slice(1));
  return view.phase === "choosing" && view.participants.some((person) => person.code === code) ? code : null;
}

function prompt() {
  if (rememberedCode()) return phase("resuming", { participant: rememberedCode() });
  if (view.phase !== "training") return phase(view.phase, words(), view.hear);
  if (view.feeling) return phase("feeling", words(), view.hear);
  return phase(view.next_to_feel ? "training" : "trained", words(), view.hear);
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
  drawPatterns();
  showPatterns();
}

function showPrompt(title, detail) {
  if (byId("prompt").textContent !== title) byId("prompt").textContent = title;
  byId("detail").textContent = detail;
}

function alarm(reason) {
  byId("alert").hidden = !reason;
  byId("alert").textContent = reason ?? "";
}

// In training the bar counts the patterns that were felt, afterwards the trials that were answered.
function showProgress() {
  const bar = byId("progress");
  byId("course").hidden = !view.participant || FORMS.slice(0, 2).includes(view.phase);
  if (!view.participant) return;
  const isTraining = !view.is_trained && view.renderings_wanted > 0;
  const { done, all, counted } = isTraining ? feltPatterns() : answeredTrials();
  bar.max = all;
  bar.value = done;
  bar.ariaLabel = isTraining ? phase("training")[0] : text("page.trials_answered");
  bar.dataset.answered = view.answered;
  const minutes = view.seconds_left == null || done >= all ? null : Math.max(1, Math.round(view.seconds_left / 60));
  byId("left").textContent = minutes === null ? counted : `${counted}, ${text("page.left", { minutes })}`;
}

function answeredTrials() {
  const { answered, trials } = view;
  return { done: answered, all: trials, counted: text("page.progress", { answered, trials }) };
}

function feltPatterns() {
  const wanted = view.renderings_wanted;
  const done = view.patterns.reduce((sum, { name }) => sum + Math.min(wanted, view.renderings[name] ?? 0), 0);
  const all = wanted * view.patterns.length;
  return { done, all, counted: `${done} / ${all}` };
}

// Shows the plate's temperature (degC) as colour that grows, in a pilot without a device; null: no reading.
function showWarmth(plate) {
  const box = byId("warmth");
  box.hidden = plate === null || !view?.hear || ["choosing", "done", ...FORMS].includes(view.phase);
  if (box.hidden) return; // also where nothing plays any more
  const away = Math.min(1, Math.abs(plate - NEUTRAL_C) / GROWN_C);
  box.style.setProperty("--colour", warmthColour(plate));
  box.style.setProperty("--grown", (LEAST_GROWN + (1 - LEAST_GROWN) * away).toFixed(3));
  const feels = away < NEUTRAL_SHARE ? "neutral" : plate > NEUTRAL_C ? "hot" : "cold";
  const said = word(feels, study);
  if (box.ariaLabel !== said) box.ariaLabel = said;
}

function showPeople() {
  const people = view.phase === "choosing" ? view.participants : [];
  const remembered = rememberedCode();
  const first = people.toSorted((a, b) => (b.code === remembered) - (a.code === remembered));
  byId("people").replaceChildren(...first.map((person) => {
    const button = make("button", person.code, { type: "button", className: person.code === remembered ? "again" : "" });
    button.dataset.participant = person.code;
    button.append(make("span", text("page.progress", person)));
    button.addEventListener("click", () => send({ do: "choose", participant: person.code }));
    return button;
  }));
}

// Redrawn only for another form: views arrive at any time, and must not erase half an answer.
function showForm() {
  const form = byId("form");
  form.hidden = !FORMS.includes(view.phase);
  const wanted = form.hidden ? null : [view.phase, view.participant, view.questions, view.to_rate, spoken()].join();
  if (wanted && wanted !== drawn) draw(form, view.phase, view, study, send);
  drawn = wanted;
  const instructions = byId("instructions");
  instructions.hidden = view.hear || !["training", "ready"].includes(view.phase) || !own(study.instructions);
  if (!instructions.hidden) instructions.replaceChildren(...paragraphs(own(study.instructions)));
}

function goLabel() {
  switch (view.phase) {
    case "training": return text(view.next_to_feel ? "buttons.play_next" : "buttons.start");
    case "ready": return text(view.answered ? "buttons.go_on" : "buttons.start");
    case "paused": case "stopped": case "trouble": return text("buttons.go_on");
    default: return null;
  }
}

function showActions() {
  const go = byId("go");
  const label = goLabel();
  go.hidden = label === null;
  go.disabled = view.phase === "training" && Boolean(view.busy);
  go.replaceChildren(label ?? "", " ", make("kbd", text("page.space")));
  const canPause = ["resting", "playing", "asking", "rating"].includes(view.phase);
  byId("pause").hidden = !canPause;
  byId("pause").disabled = !canPause;
  byId("leave").hidden = !["consent", "done"].includes(view.phase); // at other times only the experimenter may change the participant
  byId("masking").hidden = !view.masking_noise || view.phase === "choosing";
  byId("hear").hidden = !view.hear;
  byId("masking-level").ariaLabel = text("page.masking_level");
  byId("hear-level").ariaLabel = text("page.hear_level");
}

function drawPatterns() {
  const grid = byId("patterns");
  const wanted = `${spoken()} ${view.patterns.map((pattern) => pattern.name)}`;
  if (grid.dataset.drawn === wanted) return;
  grid.dataset.drawn = wanted;
  grid.replaceChildren(...view.patterns.map((pattern, index) => {
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

function patternName(name) {
  const pattern = view.patterns.find((each) => each.name === name);
  return `${word(pattern.vibration, study)}, ${word(pattern.temperature, study)}`;
}

function press(name) {
  if (view.phase === "training") {
    startSound(view, send);
    send({ do: "feel", pattern: name });
  }
  if (view.phase === "asking") send({ do: "answer", trial: view.answered, pattern: name, seen_ms: performance.now() - askedAt });
}

function go() {
  startSound(view, send);
  if (view.phase === "training" && view.next_to_feel) send({ do: "feel", pattern: view.next_to_feel });
  else send({ do: "begin" });
}

function stop() {
  silence();
  if (!send({ do: "stop" })) alarm(text("page.not_stopped"));
}

// The number row of some keyboards (French) writes digits with Shift only, so the place of a key counts, too.
function keyNumber({ key, code }) {
  const digit = /^Digit(\d)$/.exec(code)?.[1];
  const at = KEYS.indexOf(key.toLowerCase());
  return at < 0 && digit ? KEYS.indexOf(digit) : at;
}

function onKey(event) {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || !view) return;
  if (event.key === "Escape") return stop();
  if (event.target.closest?.("#form")) return;
  const at = keyNumber(event);
  if (event.key === " " || event.key === "Enter") {
    if (event.target.closest?.("button, input") || byId("go").hidden || byId("go").disabled) return;
    event.preventDefault();
    go();
  } else if (event.key.toLowerCase() === "p") {
    if (!byId("pause").hidden) send({ do: "pause" });
  } else if (at >= 0 && at < view.patterns.length && !byId("patterns").hidden && !document.querySelectorAll(".pattern")[at].disabled) press(view.patterns[at].name);
}

byId("go").addEventListener("click", go);
byId("stop").addEventListener("click", stop);
byId("pause").addEventListener("click", () => send({ do: "pause" }));
byId("leave").addEventListener("click", () => {
  silence();
  history.replaceState(null, "", "#");
  send({ do: "leave" });
});
byId("form").addEventListener("language", show);
document.addEventListener("keydown", onKey);
offerSound(send);
connect();
