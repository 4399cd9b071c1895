// The sound switch of a page: plays the vibration in the browser, and shows its level, voice and delay.
import { byId, make, setText } from "./dom.js";
import { Sound } from "./sound.js";

const KEY = "hapticvlm-sound"; // "off" once the user has switched it off
const VOICE_KEY = "hapticvlm-voice";
const VOICES = { sound: "as sound", true: "true voice" };
const ABOUT = "as sound: the vibration moved to where ears and small speakers hear it. true: what the palm speaker gets; needs headphones.";
const WAIT_MS = 600;
export const sound = new Sound();
let isReal = false; // a palm speaker also plays

// The page needs #hear (button), #hear-level (range, 0..1) and #hear-lag.
export function offerSound() {
  byId("hear").addEventListener("click", toggle);
  byId("hear-level").addEventListener("input", (event) => (sound.level = Number(event.target.value)));
  sound.level = Number(byId("hear-level").value);
  byId("hear-level").after(voices());
  sound.addEventListener("change", show);
  sound.addEventListener("report", show);
  show();
}

function voices() {
  const select = make("select", "", { id: "hear-voice", title: ABOUT, ariaLabel: "Voice" });
  select.append(...Object.entries(VOICES).map(([value, words]) => make("option", words, { value })));
  const kept = localStorage.getItem(VOICE_KEY);
  sound.voice = select.value = kept in VOICES ? kept : "sound";
  select.addEventListener("change", () => {
    localStorage.setItem(VOICE_KEY, select.value);
    sound.voice = select.value;
  });
  return select;
}

// `speaker`: the device in the welcome. If it is real, only the button starts the sound.
export function speakerIs({ simulated }) {
  isReal = !simulated;
  show();
}

// Starts the sound with a touch, unless a real speaker plays or the user has switched it off. Resolves when it plays,
// or after WAIT_MS where the browser has no output.
export async function startWithTouch() {
  if (sound.isOn || isReal || localStorage.getItem(KEY) === "off") return;
  await Promise.race([start(), new Promise((done) => setTimeout(done, WAIT_MS))]);
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
