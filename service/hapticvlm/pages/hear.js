// The sound switch of a page: click to hear the vibration here, its level, and how far it lags.
import { byId, setText } from "./dom.js";
import { Sound } from "./sound.js";

const KEY = "hapticvlm-sound"; // "off" once it was switched off by hand
export const sound = new Sound();
let isReal = false; // a palm speaker plays it too

// The page needs #hear (button), #hear-level (range, 0..1) and #hear-lag.
export function offerSound() {
  byId("hear").addEventListener("click", toggle);
  byId("hear-level").addEventListener("input", (event) => (sound.level = Number(event.target.value)));
  sound.level = Number(byId("hear-level").value);
  sound.addEventListener("change", show);
  sound.addEventListener("report", show);
  show();
}

// `speaker`: the welcome's device. Where a real one plays, sound begins only by its own button.
export function speakerIs({ simulated }) {
  isReal = !simulated;
  show();
}

// For a click on something else that makes sound: begins, unless a speaker plays or it was switched off.
export function startWithTouch() {
  if (!sound.isOn && !isReal && localStorage.getItem(KEY) !== "off") start();
}

async function toggle() {
  localStorage.setItem(KEY, sound.isOn ? "off" : "on");
  if (sound.isOn) sound.stop();
  else await start();
}

async function start() {
  try {
    await sound.start();
  } catch (error) {
    setText(byId("hear-lag"), `no sound: ${error.message}`);
  }
}

function show() {
  const button = byId("hear");
  const words = sound.isOn ? "Sound on" : "Hear it";
  setText(button, words);
  button.ariaPressed = String(sound.isOn);
  const lag = sound.lagMs;
  const idle = isReal ? "the palm speaker plays" : "sound is off";
  setText(byId("hear-lag"), sound.isOn ? (lag === null ? "waiting" : `${Math.round(lag / 5) * 5} ms behind`) : idle);
}
