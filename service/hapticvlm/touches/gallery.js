// Plays one touch at a time and downloads its files. All data are inside the page.
import { materialColour, warmthColour } from "hapticvlm/feel";
import { unwav } from "hapticvlm/felt.formats";
import { save } from "hapticvlm/felt.saved";
import { accompany } from "hapticvlm/try.rumble";

const touches = JSON.parse(document.getElementById("touches").textContent);
const voice = document.getElementById("voice");
let playing = null;

function end() {
  if (!playing) return;
  playing.sound.pause();
  playing.button.setAttribute("aria-pressed", "false");
  playing = null;
}

async function play(button) {
  const isSame = playing?.button === button;
  end();
  if (isSame) return;
  const touch = touches[button.dataset.touch];
  const sound = new Audio(`data:audio/wav;base64,${voice.value === "true" ? touch.wav : touch.heard}`);
  playing = { sound, button };
  button.setAttribute("aria-pressed", "true");
  sound.addEventListener("ended", () => playing?.sound === sound && end());
  try {
    await sound.play();
    if (playing?.sound === sound) accompany(sound, touch.plan);
  } catch (error) {
    if (playing?.sound !== sound) return; // another touch was started before this one began to play
    end();
    document.getElementById("told").textContent = `This browser cannot play it: ${error.message}`;
  }
}

// The JSON files are compressed (gzip), to a fifth of their size.
async function bytes(touch, kind) {
  const packed = await (await fetch(`data:application/octet-stream;base64,${touch[kind]}`)).blob();
  if (kind === "wav" || kind === "heard") return packed;
  return new Response(packed.stream().pipeThrough(new DecompressionStream("gzip"))).blob();
}

async function download({ dataset: { touch, kind } }) {
  const file = await bytes(touches[touch], kind);
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(file), download: `${touch}.${kind}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// Returns a touch to save, with the files of this page.
async function moment(touch) {
  const data = async (blob) => new Uint8Array(await (await blob).arrayBuffer());
  const [own, heard] = await Promise.all(["wav", "heard"].map(async (kind) => unwav(await data(bytes(touch, kind)))));
  const documents = {};
  for (const kind of ["haptic", "ahap"]) documents[kind] = await data(bytes(touch, kind));
  const { decision, interaction } = touch;
  return { decision, interaction, picture: null, samples: own.samples, rateHz: own.rateHz, heard: heard.samples, heardHz: heard.rateHz, documents, note: "" };
}

document.getElementById("main").addEventListener("click", ({ target }) => {
  const button = target.closest("button");
  if (button?.dataset.kind === "zip") save(document.getElementById("told"), () => moment(touches[button.dataset.touch]));
  else if (button?.dataset.kind) download(button);
  else if (button) play(button);
});

voice.addEventListener("change", end);
for (const section of document.querySelectorAll("section")) {
  section.style.setProperty("--body", materialColour(section.dataset.material));
  const bar = section.querySelector(".bar");
  bar.style.background = `linear-gradient(to right, ${bar.dataset.skin.split(" ").map((celsius) => warmthColour(Number(celsius))).join(", ")})`;
}
