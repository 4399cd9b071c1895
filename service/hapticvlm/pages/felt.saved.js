// Saves a felt moment as a ZIP: a picture with its word and wave, a sound, haptic formats, and a page of one file.
//
// A moment is {decision, interaction, picture, samples, rateHz, heard, heardHz, documents, note}: `picture` is {canvas,
// region} or null, `samples` the true voice and `heard` the sound voice (-1..1), `documents` the bytes of each haptic
// format ({haptic, ahap, ...}; without them they are written here), and `note` a sentence for the user, or "".
import { make, setText } from "./dom.js";
import { materialColour, warmthColour, warmthWord } from "./feel.js";
import * as felt from "./felt.js";
import { ahap, haptic, wav, zip } from "./felt.formats.js";

export const MOST_S = 8; // of one touch
const STRIP = 190; // px below the picture
const WIDE = 960; // px, least width of the saved picture
const URL_LIFETIME_MS = 30_000;

// Saves the moment that `moment()` returns, and says in the element `said` what was saved, or why nothing was.
export async function save(said, moment) {
  try {
    const what = await moment();
    const files = await written(what);
    const [first] = Object.keys(files);
    const name = first.slice(0, first.lastIndexOf("."));
    const href = URL.createObjectURL(zip(files));
    make("a", "", { href, download: `${name}.zip` }).click();
    setTimeout(() => URL.revokeObjectURL(href), URL_LIFETIME_MS); // the browser reads it after the click
    const formats = Object.keys(files).filter((file) => !/\.(png|wav|html)$/.test(file)).map((file) => file.slice(file.lastIndexOf(".")));
    setText(said, [`Saved ${name}.zip: picture, sound, ${formats.join(", ")} and a page to send.`, what.note].filter(Boolean).join(" "));
  } catch (error) {
    setText(said, `Not saved: ${error.message}`);
  }
}

async function written(moment) {
  const { decision, interaction, samples, rateHz, heard, heardHz } = moment;
  const material = decision.felt ?? decision.material;
  const name = `felt-${material}-${interaction}`.replace(/[^\p{L}\p{N}-]+/gu, "-"); // a recording of others has any name
  const own = { material, interaction, samples, rateHz };
  const documents = moment.documents ?? { haptic: bytes(haptic(own)), ahap: bytes(ahap(own)) };
  const picture = await drawn(moment);
  const sound = wav([...heard], heardHz);
  const title = `${felt.headline(decision)}: ${interaction}`;
  const content = page(escaped(title), await dataUrl(picture, "image/png"), await dataUrl(sound, "audio/wav"));
  return {
    [`${name}.png`]: picture,
    [`${name}.wav`]: sound,
    ...Object.fromEntries(Object.entries(documents).map(([kind, document]) => [`${name}.${kind}`, document])),
    [`${name}.html`]: new TextEncoder().encode(content),
  };
}

const bytes = (document) => new TextEncoder().encode(`${JSON.stringify(document, null, 1)}\n`);

async function drawn({ decision, picture, samples }) {
  const scale = picture ? Math.max(1, WIDE / picture.canvas.width) : 0;
  const high = picture ? Math.round(scale * picture.canvas.height) : 0;
  const width = picture ? Math.round(scale * picture.canvas.width) : WIDE;
  const whole = make("canvas", "", { width, height: high + STRIP });
  const pen = whole.getContext("2d");
  if (picture) pen.drawImage(picture.canvas, 0, 0, width, high);
  if (picture?.region) {
    const { x, y, w, h } = picture.region;
    pen.lineWidth = 4;
    pen.strokeStyle = "#45ffe0";
    pen.strokeRect(x * width, y * high, w * width, h * high);
  }
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
    pen.fillText(words, 62, top, width - 86);
  };
  const celsius = decision.thermal_cue ? decision.setpoint_c : null;
  dot(high + 46, materialColour(decision.felt ?? decision.material));
  text(felt.headline(decision), high + 60, "700 44px");
  dot(high + 96, celsius == null ? "#55636d" : warmthColour(celsius));
  text(celsius == null ? "no noticeable warmth or cold" : `${warmthWord(celsius)}, ${celsius.toFixed(1)} °C`, high + 104, "500 24px");
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

const escaped = (words) => words.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);

function dataUrl(data, type) {
  return new Promise((resolve) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result);
    reader.readAsDataURL(new Blob([data], { type }));
  });
}
