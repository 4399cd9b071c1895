// Saves the last touch: a picture with its word and wave, a sound, two haptic formats, and a page of one file, in a ZIP.
import { byId, make, setText } from "./dom.js";
import { materialColour, warmthColour, warmthWord } from "./feel.js";
import * as felt from "./felt.js";
import { OUT_HZ, SoundVoice } from "./sound.voice.js";
import { ahap, haptic, wav, zip } from "./try.formats.js";

const MOST_S = 8; // of a touch, its newest
const STRIP = 190; // px below the picture
const WIDE = 960; // px, least width of the saved picture
const URL_LIFETIME_MS = 30_000;

let moment = null; // {decision, region, canvas, samples, rateHz, isSlid}

// A hand touches `region` of a picture now. A contact begins a new moment.
export function touch({ decision, region, canvas, isContact, isSlide }) {
  if (isContact || !moment) moment = { samples: [], rateHz: 0, isSlid: false };
  Object.assign(moment, { decision: decision ?? moment.decision, region, canvas, isSlid: moment.isSlid || isSlide });
}

// Takes a piece of the vibration while a hand touches, or while it fades.
export function take({ samples, rate_hz: rateHz }) {
  if (!moment) return;
  moment.rateHz = rateHz;
  const isSilent = samples.every((sample) => sample === 0);
  if (isSilent && !moment.samples.length) return;
  moment.samples.push(...samples);
  moment.samples.splice(0, moment.samples.length - MOST_S * rateHz);
  byId("save").hidden = !moment.decision;
}

// Forgets it, as with another picture.
export function forget() {
  moment = null;
  byId("save").hidden = true;
}

export function offerSave() {
  byId("save").addEventListener("click", async () => {
    const files = await written(moment);
    const name = Object.keys(files)[0].split(".")[0];
    const href = URL.createObjectURL(zip(files));
    make("a", "", { href, download: `${name}.zip` }).click();
    setTimeout(() => URL.revokeObjectURL(href), URL_LIFETIME_MS); // the browser reads it after the click
    setText(byId("saved"), `Saved ${name}.zip: picture, sound, .haptic, .ahap and a page to send.`);
  });
}

async function written({ decision, region, canvas, samples, rateHz, isSlid }) {
  const material = decision.felt ?? decision.material;
  const interaction = isSlid ? "slide" : "tap";
  const name = `felt-${material}-${interaction}`;
  const heard = new SoundVoice().render(samples);
  const picture = await drawn({ decision, region, canvas, samples });
  const sound = wav([...heard], OUT_HZ);
  const own = { material, interaction, samples, rateHz };
  const text = (value) => new TextEncoder().encode(value);
  return {
    [`${name}.png`]: picture,
    [`${name}.wav`]: sound,
    [`${name}.haptic`]: text(`${JSON.stringify(haptic(own), null, 1)}\n`),
    [`${name}.ahap`]: text(`${JSON.stringify(ahap(own), null, 1)}\n`),
    [`${name}.html`]: text(page(`${felt.headline(decision)}: ${interaction}`, await dataUrl(picture, "image/png"), await dataUrl(sound, "audio/wav"))),
  };
}

async function drawn({ decision, region: { x, y, w, h }, canvas, samples }) {
  const scale = Math.max(1, WIDE / canvas.width);
  const whole = make("canvas", "", { width: Math.round(scale * canvas.width), height: Math.round(scale * canvas.height) + STRIP });
  const [width, high] = [whole.width, whole.height - STRIP];
  const pen = whole.getContext("2d");
  pen.drawImage(canvas, 0, 0, width, high);
  pen.lineWidth = 4;
  pen.strokeStyle = "#45ffe0";
  pen.strokeRect(x * width, y * high, w * width, h * high);
  pen.fillStyle = "#0e1419";
  pen.fillRect(0, high, width, STRIP);
  const dot = (top, colour) => {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(36, top, 12, 0, 7);
    pen.fill();
  };
  const text = (words, top, font) => {
    pen.fillStyle = "#fff";
    pen.font = `${font} system-ui, sans-serif`;
    pen.fillText(words, 62, top);
  };
  dot(high + 46, materialColour(decision.felt ?? decision.material));
  text(felt.headline(decision), high + 60, "700 44px");
  dot(high + 96, decision.thermal_cue ? warmthColour(decision.setpoint_c) : "#55636d");
  text(decision.thermal_cue ? `${warmthWord(decision.setpoint_c)}, ${decision.setpoint_c.toFixed(1)} °C` : "no noticeable warmth or cold", high + 104, "500 24px");
  pen.fillStyle = "#45d3bf";
  const most = samples.reduce((peak, sample) => Math.max(peak, Math.abs(sample)), 1e-3);
  for (let column = 0; column < width - 48; column += 2) {
    const from = Math.floor((column / (width - 48)) * samples.length);
    const to = Math.max(from + 1, Math.floor(((column + 2) / (width - 48)) * samples.length));
    let peak = 0;
    for (let index = from; index < to; index++) peak = Math.max(peak, Math.abs(samples[index] ?? 0));
    const half = Math.max(0.5, (30 * peak) / most);
    pen.fillRect(24 + column, high + 150 - half, 1.5, 2 * half);
  }
  const blob = await new Promise((resolve) => whole.toBlob(resolve, "image/png"));
  return new Uint8Array(await blob.arrayBuffer());
}

const page = (title, picture, sound) => `<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>${title}</title>
<style>body{margin:0;background:#0e1419;color:#fff;font:1.1rem system-ui,sans-serif;text-align:center}img{display:block;max-width:100%;max-height:85vh;margin:auto}audio{margin:1rem}</style>
<img src="${picture}" alt="${title}"><audio controls src="${sound}"></audio><p>What HapticVLM lets a hand feel here, made audible.</p></html>
`;

function dataUrl(bytes, type) {
  return new Promise((resolve) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result);
    reader.readAsDataURL(new Blob([bytes], { type }));
  });
}
