// Plays a recorded session: a scrubber through frames, decisions, plate and vibration, with its sound.
import { byId, copyAddress } from "hapticvlm/dom";
import { materialColour, warmthColour } from "hapticvlm/feel";
import * as felt from "hapticvlm/felt";
import { unwav } from "hapticvlm/felt.formats";
import { MOST_S, save } from "hapticvlm/felt.saved";
import { outlined } from "hapticvlm/outline";
import * as card from "hapticvlm/try.card";
import { accompany } from "hapticvlm/try.rumble";

const LOW_C = 16;
const HIGH_C = 42;
const NEUTRAL_C = 32;
const STEP_S = 0.1; // of an arrow key
const FADES_S = 0.5; // after a touch
const PEAKS_PER_S = 100;
const SOURCES = { ...felt.SOURCES, scene: "stated by the scene" };

const session = JSON.parse(byId("session").textContent);
const sound = byId("sound");
let now = 0;
let centre = { x: 0.5, y: 0.5 }; // of the touched object in the frame

// The newest entry of a list in order of `t_s`, at or before a time.
function newest(list, at) {
  let low = 0;
  let high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle].t_s <= at) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

const degrees = (value) => (value == null ? "no reading" : `${value.toFixed(1)} °C`);
const touchAt = (at) => session.touches.findLast((touch) => touch.from_s <= at && at <= touch.to_s);
const isOn = (touch, { object_id, surface }) => object_id === touch.object_id && (surface ?? 0) === touch.surface;
const decisionOf = (touch, at) => session.decisions.findLast((decision) => decision.t_s <= at && isOn(touch, decision));

function seek(at, { isPlaying = false } = {}) {
  now = Math.min(Math.max(at, 0), session.duration_s);
  if (!isPlaying) sound.currentTime = now;
  byId("scrubber").value = now;
  byId("clock").textContent = `${now.toFixed(2)} of ${session.duration_s.toFixed(1)} s`;
  const touch = touchAt(now);
  showState(touch);
  showFrame(touch);
  draw();
}

function showState(touch) {
  const decision = touch && decisionOf(touch, now);
  const plate = session.plate[newest(session.plate, now)];
  byId("touching").textContent = touch ? `the ${touch.hand} hand touches` : "nothing is touched";
  byId("name").textContent = touch ? touch.name : "";
  byId("material").textContent = decision ? felt.headline(decision) : "";
  byId("material").style.setProperty("--body", decision ? materialColour(decision.material) : "transparent");
  byId("told").textContent = decision ? confidence(decision) : "";
  byId("feels").textContent = decision ? felt.sentence(decision, gestureAt(touch), levelAt(now)) : "";
  showCard();
  const rows = [["plate measured", degrees(plate?.plate_c)], ["plate setpoint", degrees(plate?.setpoint_c)]];
  if (decision?.contact_c != null) rows.unshift(["skin should feel", degrees(decision.contact_c)]);
  byId("warmth").replaceChildren(...rows.map(pair));
  byId("evidence").replaceChildren(...(decision?.evidence ?? []).map(evidence));
  for (const link of byId("touches").querySelectorAll("a")) {
    link.setAttribute("aria-current", String(touch !== undefined && Number(link.dataset.from) === touch.from_s));
  }
}

// Shows the card beside the touched object, with the vibration before this moment.
function showCard() {
  const touch = touchAt(now);
  const decision = touch && decisionOf(touch, now);
  if (!decision) return card.show(null);
  const end = Math.round(now * PEAKS_PER_S);
  card.recall(session.peaks.slice(Math.max(0, end - card.HISTORY), end));
  const motion = felt.motion(gestureAt(touch), levelAt(now));
  card.show({ word: felt.headline(decision), source: confidence(decision), decision, motion }, onStage(centre));
}

// Returns where a point of the frame (0..1) is on the stage, px; the frame is as large as fits into its canvas.
function onStage({ x, y }) {
  const { offsetLeft: left, offsetTop: top, clientWidth: width, clientHeight: height, width: columns, height: rows } = byId("frame");
  if (!width) return { x: byId("seen").clientWidth / 2, y: 0 }; // no frame was kept
  const scale = Math.min(width / columns, height / rows);
  return { x: left + width / 2 + (x - 0.5) * columns * scale, y: top + height / 2 + (y - 0.5) * rows * scale };
}

function confidence(decision) {
  const sure = decision.source === "scene" || decision.material === "unknown" ? "" : `${Math.round(100 * decision.confidence)} % sure, `;
  return sure + SOURCES[decision.source];
}

// Returns the gesture of this moment of a touch, and the level of its vibration, of full scale.
function gestureAt({ from_s: from, motion }) {
  const isMoving = motion.findLast(([at]) => at <= now)?.[1] ?? false;
  return felt.gesture({ pressed: true, touchedFor: 1000 * (now - from), speed: isMoving ? 1 : 0 });
}

const levelAt = (at) => Math.max(0, ...session.peaks.slice(Math.max(0, Math.floor((at - 0.05) * PEAKS_PER_S)), Math.ceil((at + 0.05) * PEAKS_PER_S)));

// Returns the touch of this moment to save. Throws Error where there is none.
async function moment() {
  const touch = touchAt(now);
  const decision = touch && decisionOf(touch, now);
  if (!touch) throw new Error("nothing is touched at this moment; choose one of the touches below.");
  if (!decision) throw new Error(`it is not yet decided what ${touch.name} is; choose a later moment.`);
  const next = session.touches.find(({ from_s: from }) => from >= touch.to_s) ?? { from_s: Infinity };
  const whole = [touch.from_s, Math.min(touch.to_s + FADES_S, next.from_s, session.duration_s)];
  const from = Math.max(whole[0], Math.min(now - MOST_S / 2, whole[1] - MOST_S));
  const to = Math.min(whole[1], from + MOST_S);
  const [own, heard] = await Promise.all([session.voices.true, session.voices.sound].map((address) => cut(address, from, to)));
  const hasPicture = byId("frame").dataset.frame !== undefined;
  return {
    decision,
    interaction: touch.motion.some(([, isMoving]) => isMoving) ? "slide" : "tap",
    picture: hasPicture ? { canvas: byId("frame"), region: null } : null, // the frame has its outline
    samples: own.samples, rateHz: own.rateHz, heard: heard.samples, heardHz: heard.rateHz,
    note: [hasPicture ? "" : "No frame was kept, so the picture has words and wave only.", to - from < whole[1] - whole[0] ? `It has ${MOST_S} s of the touch.` : ""].filter(Boolean).join(" "),
  };
}

async function cut(address, from, to) {
  const { samples, rateHz } = unwav(new Uint8Array(await (await fetch(address)).arrayBuffer()));
  return { samples: samples.slice(Math.round(from * rateHz), Math.round(to * rateHz)), rateHz };
}

function pair([term, text]) {
  const row = document.createElement("div");
  row.append(Object.assign(document.createElement("dt"), { textContent: term }));
  row.append(Object.assign(document.createElement("dd"), { textContent: text }));
  return row;
}

function evidence({ rung, material, confidence }) {
  return Object.assign(document.createElement("li"), { textContent: `${rung}: ${material} ${Math.round(100 * confidence)} %` });
}

async function showFrame(touch) {
  const number = newest(session.frames, now);
  byId("frame").hidden = !session.frames.length;
  byId("frame-none").hidden = session.frames.length > 0;
  if (number < 0) return;
  const isTouched = touch !== undefined && session.frames[number].object_id === touch.object_id;
  const { picture, centre: middle } = await outlined(session.frames[number], isTouched, resolved("--wave"));
  if (newest(session.frames, now) !== number) return; // another moment was asked for meanwhile
  const canvas = byId("frame");
  if (canvas.width !== picture.width || canvas.height !== picture.height) Object.assign(canvas, { width: picture.width, height: picture.height });
  canvas.getContext("2d").drawImage(picture, 0, 0);
  canvas.dataset.frame = number;
  centre = middle;
  showCard();
}

// The browser resolves light-dark() for a real property only, so a colour is read back from one.
function resolved(name) {
  const probe = byId("clock");
  probe.style.outlineColor = `var(${name})`;
  const colour = getComputedStyle(probe).outlineColor;
  probe.style.outlineColor = "";
  return colour;
}

// Draws vibration above, plate below, touches as bands behind both, and the current time.
function draw() {
  const canvas = byId("chart");
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio)) Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  const across = (at) => (at / session.duration_s) * width;
  for (const touch of session.touches) {
    context.fillStyle = `color-mix(in srgb, ${materialColour(decisionOf(touch, touch.to_s)?.material)} 25%, transparent)`;
    context.fillRect(across(touch.from_s), 0, Math.max(across(touch.to_s) - across(touch.from_s), 1), height);
  }
  drawWave(context, width, height * 0.5);
  drawPlate(context, across, height * 0.55, height * 0.45 - 4);
  context.fillStyle = resolved("--ink");
  context.fillRect(across(now) - 1, 0, 2, height);
}

function drawWave(context, width, height) {
  const { peaks } = session;
  const top = Math.max(0.25, ...peaks);
  context.fillStyle = resolved("--wave");
  for (let x = 0; x < width; x++) {
    const from = Math.floor((x / width) * peaks.length);
    const to = Math.max(from + 1, Math.floor(((x + 1) / width) * peaks.length));
    let peak = 0;
    for (let at = from; at < to; at++) peak = Math.max(peak, peaks[at] ?? 0);
    const reach = Math.max((peak / top) * (height / 2 - 2), 0.5);
    context.fillRect(x, height / 2 - reach, 1, 2 * reach);
  }
}

function drawPlate(context, across, top, height) {
  const up = (celsius) => top + height - ((celsius - LOW_C) / (HIGH_C - LOW_C)) * height;
  context.fillStyle = resolved("--line");
  context.fillRect(0, up(NEUTRAL_C), across(session.duration_s), 1);
  context.lineWidth = 3;
  for (let at = 1; at < session.plate.length; at++) {
    const [before, point] = [session.plate[at - 1], session.plate[at]];
    if (before.plate_c == null || point.plate_c == null) continue;
    context.strokeStyle = warmthColour(point.plate_c);
    context.beginPath();
    context.moveTo(across(before.t_s), up(before.plate_c));
    context.lineTo(across(point.t_s), up(point.plate_c));
    context.stroke();
  }
  context.fillStyle = resolved("--soft");
  context.font = "12px system-ui, sans-serif";
  context.fillText("plate, 32 °C as skin", 4, up(NEUTRAL_C) - 4);
}

function resize() {
  draw();
  showCard();
}

function listTouches() {
  for (const touch of session.touches) {
    const material = decisionOf(touch, touch.to_s)?.material ?? "undecided";
    const link = Object.assign(document.createElement("a"), { href: `#t=${touch.from_s.toFixed(2)}` });
    link.dataset.from = touch.from_s;
    link.style.setProperty("--body", materialColour(material));
    link.append(touch.name, document.createElement("br"));
    link.append(Object.assign(document.createElement("small"), { textContent: `${touch.from_s.toFixed(1)} to ${touch.to_s.toFixed(1)} s, ${material}` }));
    const item = document.createElement("li");
    item.append(link);
    byId("touches").append(item);
  }
}

function follow() {
  if (sound.paused) return;
  seek(sound.currentTime, { isPlaying: true });
  requestAnimationFrame(follow);
}

async function play() {
  if (!sound.paused) return sound.pause();
  if (now >= session.duration_s - 0.05) seek(0);
  await sound.play();
}

async function changeVoice() {
  const wasPlaying = !sound.paused;
  sound.src = session.voices[byId("voice").value];
  sound.currentTime = now;
  if (wasPlaying) await sound.play();
}

function showPlaying() {
  byId("play").setAttribute("aria-pressed", String(!sound.paused));
  byId("play").textContent = sound.paused ? "Play" : "Pause";
  follow();
  accompany(sound, session.plan);
}

function fromLink() {
  const at = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? session.at_s ?? 0);
  seek(Number.isFinite(at) ? at : 0);
}

async function copyLink() {
  byId("copied").textContent = await copyAddress(`#t=${now.toFixed(2)}`);
}

byId("title").textContent = session.title;
byId("facts").textContent = session.facts;
byId("scrubber").max = session.duration_s;
sound.src = session.voices[byId("voice").value];
sound.volume = byId("level").valueAsNumber;
byId("scrubber").addEventListener("input", (event) => seek(event.target.valueAsNumber));
byId("level").addEventListener("input", (event) => (sound.volume = event.target.valueAsNumber));
byId("voice").addEventListener("change", changeVoice);
byId("chart").addEventListener("pointerdown", (event) => seek((event.offsetX / event.target.clientWidth) * session.duration_s));
byId("play").addEventListener("click", play);
byId("link").addEventListener("click", copyLink);
byId("save").addEventListener("click", () => save(byId("copied"), moment));
for (const event of ["play", "pause", "ended"]) sound.addEventListener(event, showPlaying);
document.addEventListener("keydown", (event) => {
  if (event.target.matches("input, button, a")) return;
  if (event.key === " ") play();
  if (event.key === "ArrowLeft") seek(now - STEP_S);
  if (event.key === "ArrowRight") seek(now + STEP_S);
});
addEventListener("hashchange", fromLink);
addEventListener("resize", resize);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
card.begin(byId("seen"), Infinity); // also while it is paused
listTouches();
fromLink();
