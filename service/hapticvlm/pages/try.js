// "Feel this": the user touches a picture of their own with the pointer and feels the recognised material.
import { show as showReach } from "./connect.js";
import { byId, setText } from "./dom.js";
import { offerSound, sound, speakerIs, startWithTouch } from "./hear.js";
import { Link } from "./link.js";
import { offerStop } from "./stop.js";
import * as answer from "./try.answer.js";
import * as card from "./try.card.js";
import { hand, offerHand, speed } from "./try.hand.js";
import * as light from "./try.light.js";
import { SPOT, touchOnce } from "./try.opening.js";
import * as rumble from "./try.rumble.js";
import * as saving from "./try.save.js";
import { TryScene } from "./try.scene.js";
import { offerSources } from "./try.source.js";

const LEVEL_FALL = 0.7; // of the shown level, per piece of the vibration
const FOUR = ["wood", "glass", "fabric", "metal"];
const HERE = { path: "try", code: "connect-try.svg" }; // the page that a phone opens
const TOKEN_KEY = "hapticvlm-token"; // stored until this tab is closed
const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`;
const canvas = byId("picture");
let picture = null;
let size = { width: 0, height: 0 }; // of the picture on the page, px
let level = 0; // of the vibration, of full scale
let opens = true; // the page has not yet shown how to touch
let wasPressed = false;
let watching = null;
let scene = null;

function connect() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? sessionStorage.getItem(TOKEN_KEY);
  scene = new TryScene(url, token, { onDecision: show, onState: showState, onMessage: receive });
  // A separate observer connection receives the sound, because the service does not send it to scenes.
  watching = new Link(url, {
    token, name: "try page, sound",
    onMessage: (message) => {
      if (message.type === "welcome") watching.ask({ type: "set", watch: ["waveform"] });
      else if (message.type === "view") vibrate(message);
    },
  });
  watching.connect();
  offerStop(scene.link, () => scene.stopped());
}

function receive(message) {
  if (message.type === "welcome") {
    setText(byId("link"), `Connected to ${message.service.name} ${message.service.version}.`);
    speakerIs(message.devices.speaker);
    fetch("status").then((reply) => reply.ok && reply.json().then((status) => showReach(status, HERE))).catch(() => {}); // the state of the link reports a lost service
    answer.offerMaterials(message.materials);
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

// Takes a piece of the vibration: plays it, and shows its strength at the finger.
function vibrate(view) {
  sound.take(view);
  if (!view.samples) return;
  saving.take(view);
  level = Math.max(LEVEL_FALL * level, card.vibrate(view.samples, view.rate_hz));
  light.vibrate(level);
  showMotion();
}

function show() {
  answer.show();
  showHand();
  if (picture && scene.decision()) byId("pane").dataset.looked = picture.number;
  if (!opens || !picture?.things.length || !scene.decision()) return;
  opens = false;
  touchOnce(SPOT, picture.canvas, moved);
}

function moved() {
  scene.moved();
  show();
}

function showHand() {
  if (!picture) return;
  const target = scene.target();
  light.follow(hand, target.region, scene.decision(), size);
  byId("region").hidden = scene.isWhole || Boolean(target.thing);
  byId("lit").setAttribute("points", hand.over || hand.pressed ? (target.thing?.points.join(" ") ?? "") : "");
  byId("lit").style.fill = hand.pressed && target.thing?.region.w < 1 ? "rgb(69 255 224 / .18)" : "none"; // a table has other things on it
  if (hand.pressed && !wasPressed && byId("stopped").textContent.startsWith("Stopped")) setText(byId("stopped"), ""); // it is felt again
  if (hand.pressed) saving.touch({ decision: scene.decision(), region: target.region, canvas: picture.canvas, isContact: !wasPressed, isSlide: speed() > 0 });
  wasPressed = hand.pressed;
  showMotion();
}

// Shows the hand's motion, and the card beside it while it is over the picture.
function showMotion() {
  const words = answer.showMotion(hand, speed(), level);
  if (!hand.over && !hand.pressed) return;
  const { offsetLeft: left, offsetTop: top } = byId("pane");
  card.show(words, { x: left + hand.x * size.width, y: top + hand.y * size.height });
}

offerSound();
saving.offerSave();
card.begin();
connect();
answer.begin(scene);
offerSources((next) => {
  picture = next;
  const { width, height } = next.canvas;
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
  byId("pane").style.setProperty("--ratio", width / height);
  byId("pane").dataset.picture = next.number;
  scene.show(next);
  if (!next.live) {
    card.show(null);
    answer.clear();
    saving.forget();
  }
  canvas.getContext("2d").drawImage(picture.canvas, 0, 0);
  show();
});
new ResizeObserver(([{ contentRect }]) => (size = contentRect)).observe(canvas);
offerHand(canvas, moved, startWithTouch);
byId("among").addEventListener("change", ({ target }) => scene.among(target.value === "four" ? FOUR : null));
byId("take").addEventListener("click", async () => {
  const reply = await scene.take();
  if (reply.type === "ok") scene.owner = true;
  else setText(byId("told"), reply.text ?? "The service did not answer.");
  showOwner();
});
byId("token-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const token = byId("token").value;
  sessionStorage.setItem(TOKEN_KEY, token);
  scene.link.offer(token);
  watching.offer(token);
});
