// "Feel this": the user touches a picture of their own with the pointer and feels the recognised material.
import { show as showReach } from "./connect.js";
import { byId, degrees, list, make, percent, setText } from "./dom.js";
import { materialColour, warmthWord } from "./feel.js";
import { offerSound, sound, speakerIs, startWithTouch } from "./hear.js";
import { Link } from "./link.js";
import { offerStop } from "./stop.js";
import { hand, offerHand } from "./try.hand.js";
import * as rumble from "./try.rumble.js";
import { TryScene } from "./try.scene.js";
import { offerSources } from "./try.source.js";

const SHOWN_PX = 720; // longest side on the page of a smaller picture
const MAX_LIKELY = 3;
const FOUR = ["wood", "glass", "fabric", "metal"];
const HERE = { path: "try", code: "connect-try.svg" }; // the page that a phone opens
const WHOLE = { picture: "The whole picture", thing: "The whole picture, and the thing outlined on its plain ground" };
const TOKEN_KEY = "hapticvlm-token"; // stored until this tab is closed
const SOURCES = {
  scene: "stated by you", name: "by its name", shader: "by its shader", encoder: "by how it looks",
  vlm: "by the vision-language model", unknown: "too uncertain to decide",
};
const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`;
const canvas = byId("picture");
let picture = null;
let watching = null;
let scene = null;
let chosen = null; // the material chosen by the user for a patch, which newer decisions do not change

function connect() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? sessionStorage.getItem(TOKEN_KEY);
  scene = new TryScene(url, token, { onDecision: show, onState: showState, onMessage: receive });
  // A separate observer connection receives the sound, because the service does not send it to scenes.
  watching = new Link(url, {
    token, name: "try page, sound",
    onMessage: (message) => {
      if (message.type === "welcome") watching.ask({ type: "set", watch: ["waveform"] });
      else if (message.type === "view") sound.take(message);
    },
  });
  watching.connect();
  offerStop(scene.link, () => {});
}

function receive(message) {
  if (message.type === "welcome") {
    setText(byId("link"), `Connected to ${message.service.name} ${message.service.version}.`);
    speakerIs(message.devices.speaker);
    fetch("status").then((answer) => answer.ok && answer.json().then((status) => showReach(status, HERE))).catch(() => {}); // the state of the link reports a lost service
    const select = byId("correct-material");
    if (!select.options.length) select.append(...message.materials.map((name) => make("option", name, { value: name })));
  } else if (message.type === "vibration") rumble.take(message);
  else if (message.type === "error") setText(byId("told"), message.text);
  showOwner();
}

function showOwner() {
  byId("take").hidden = scene.owner || scene.link.state !== "open";
  setText(byId("plays"), scene.owner ? `Your device: ${rumble.plays()}.` : "Another scene owns the outputs: this page shows decisions but is not felt.");
}

function showState(state) {
  const words = {
    connecting: "Connecting to the service.", gone: "Service unreachable; retrying.",
    silent: "The service does not answer.", token: "The service requires its token.",
  };
  document.body.dataset.link = state;
  if (words[state]) setText(byId("link"), words[state]);
  byId("token-form").hidden = state !== "token";
  if (state !== "open") sound.silence();
}

// Shows the decision about the patch under the hand; decisions about others are stored for later.
function show() {
  const decision = scene.decision();
  if (!decision) return;
  const { material, confidence, runner_up: next, source } = decision;
  byId("answer").style.setProperty("--body", materialColour(material));
  setText(byId("object"), scene.isWhole ? WHOLE[scene.thing ? "thing" : "picture"] : "Under your hand");
  setText(byId("material"), material === "unknown" ? `perhaps ${next ?? "anything"}` : material);
  setText(byId("sure"), `${percent(confidence)} sure, ${SOURCES[source]}${material !== "unknown" && next ? `; next ${next}` : ""}`);
  list(byId("because"), because(decision));
  byId("correct").hidden = !decision.object_id;
  const likeliest = material === "unknown" ? (next ?? "wood") : material;
  byId("correct-material").value = chosen && chosen.id === decision.object_id ? chosen.material : likeliest;
  showLikeliest(decision);
  outline();
}

// Shows the three most likely materials as buttons: one press corrects the decision.
function showLikeliest({ material, runner_up: next, evidence }) {
  const seen = [...evidence].sort((one, other) => other.confidence - one.confidence).map((one) => one.material);
  const names = [...new Set([material, next, ...seen])].filter((name) => name && name !== "unknown").slice(0, MAX_LIKELY);
  const group = byId("likeliest");
  if ([...group.children].map((button) => button.textContent).join() === names.join()) return;
  group.replaceChildren(...names.map((name) => make("button", name, { type: "submit", value: name })));
}

function because(decision) {
  const looks = decision.evidence.map(({ rung, material, confidence }) => `${rung}: ${material} ${percent(confidence)}`);
  const feels = decision.thermal_cue ? `${warmthWord(decision.setpoint_c)}: ${degrees(decision.contact_c)} under the hand` : "no noticeable warmth or cold";
  return [
    ["evidence", looks.join("; ") || "none"],
    ["felt as", decision.felt ?? (decision.basis === "expectation" ? "a mean of materials" : "nothing")],
    ["warmth", feels],
    ["surface", `${degrees(decision.surface_c)} (${decision.surface_why || decision.surface_source})`],
    ["vibration", decision.pattern ?? (hand.pressed ? "felt now" : "press to feel it")],
  ];
}

// Draws the picture and the outline of the region under the hand.
function outline() {
  if (!picture) return;
  const context = canvas.getContext("2d");
  context.drawImage(picture.canvas, 0, 0, canvas.width, canvas.height);
  const decision = scene.decision();
  if (scene.isWhole && scene.thing) {
    darkenGround(context);
    return;
  }
  if (!hand.over && !decision) return;
  const { x, y, w, h } = scene.target().region;
  context.lineWidth = Math.max(2, canvas.width / 250);
  context.strokeStyle = hand.pressed ? "#45d3bf" : "#fff";
  context.fillStyle = `${materialColour(decision?.material)}40`;
  context.setLineDash(decision ? [] : [6, 6]);
  context.fillRect(x * canvas.width, y * canvas.height, w * canvas.width, h * canvas.height);
  context.strokeRect(x * canvas.width, y * canvas.height, w * canvas.width, h * canvas.height);
}

function darkenGround(context) {
  context.globalCompositeOperation = "multiply";
  context.globalAlpha = 0.6;
  context.drawImage(scene.thing.canvas, 0, 0, canvas.width, canvas.height);
  context.globalCompositeOperation = "source-over";
  context.globalAlpha = 1;
}

offerSound();
connect();
offerSources((next) => {
  picture = next;
  const scale = Math.max(1, SHOWN_PX / Math.max(next.canvas.width, next.canvas.height));
  canvas.width = Math.round(scale * next.canvas.width);
  canvas.height = Math.round(scale * next.canvas.height);
  scene.show(next);
  outline();
});
offerHand(canvas, () => { scene.moved(); show(); outline(); }, startWithTouch);
byId("correct").addEventListener("submit", async (event) => {
  event.preventDefault();
  const material = event.submitter?.value || byId("correct-material").value;
  byId("correct-material").value = material;
  const answer = await scene.state(material);
  setText(byId("corrected"), answer.type === "ok" ? `Corrected to ${material}. It feels like ${material} from now on.` : (answer.text ?? "The service did not answer."));
  byId("keep").hidden = answer.type !== "ok";
});
byId("correct-material").addEventListener("input", () => {
  chosen = { id: scene.decision()?.object_id, material: byId("correct-material").value };
});
byId("keep").addEventListener("click", async () => {
  const answer = await scene.keep();
  const material = byId("correct-material").value;
  const lasting = `To keep it permanently, save a cut-out and run: hapticvlm gallery add my-${material} --like ${material} PICTURE`;
  setText(byId("corrected"), answer.type === "decision" ? `Kept for this session, where it helps to recognise similar objects. ${lasting}` : (answer.text ?? "The service did not answer."));
});
byId("among").addEventListener("change", ({ target }) => scene.among(target.value === "four" ? FOUR : null));
byId("outline").addEventListener("change", ({ target }) => {
  scene.outlining(target.checked);
  outline();
});
byId("take").addEventListener("click", async () => {
  const answer = await scene.take();
  if (answer.type === "ok") scene.owner = true;
  else setText(byId("told"), answer.text ?? "The service did not answer.");
  showOwner();
});
byId("token-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const token = byId("token").value;
  sessionStorage.setItem(TOKEN_KEY, token);
  scene.link.offer(token);
  watching.offer(token);
});
