// Provides the picture: from a file, the clipboard, a drop, a sample, a camera or a shared screen.
//
// `onPicture` receives each new picture: {number, canvas, jpeg, live, thing}; `thing` is the outline of what lies on a
// plain ground in a still picture, or null; `things` are those that we labelled on a sample. A live source is read ten times a second, and an unchanged picture is not passed on.
import { byId, make, setText } from "./dom.js";
import { contentBox } from "./try.bars.js";
import { outlined } from "./try.outline.js";
import { thingsOf } from "./try.things.js";

const LONGEST_PX = 1024; // longest side of a sent picture; more would not help the encoder
const QUALITY = 0.9;
const LOOK_MS = 100;
const SMALL = 24; // px per side of the copy for comparison
const CHANGED = 5; // mean difference in grey levels above which a picture is new, above camera noise
const GROUND = "rgb(127 127 127)"; // behind what is transparent
const OPAQUE = 128; // alpha
const SHOWN = 0.01; // least share of opaque pixels; with fewer the alpha does not count
const SAMPLES = { table: "a table with eight objects", carafe: "a glass carafe", cloth: "folded cloth", kettle: "a steel kettle" };

const OPENING = "table";

let onPicture = () => {};
let number = 0;
let wanted = 0; // counts what was opened; only the last of them is shown
let stream = null;
let timer = null;
let before = null;
const video = make("video", "", { muted: true, playsInline: true });
const small = make("canvas", "", { width: SMALL, height: SMALL });

export function offerSources(listener) {
  onPicture = listener;
  byId("file").addEventListener("change", ({ target }) => open(target.files[0]));
  addEventListener("paste", ({ clipboardData, target }) => target.matches?.("input") || take(clipboardData));
  offerDrop(byId("stage"));
  for (const [name, words] of Object.entries(SAMPLES)) byId("samples").append(sample(name, words));
  offerLive("camera", () => navigator.mediaDevices.getUserMedia({ video: { facingMode: "environment" } }));
  offerLive("screen", () => navigator.mediaDevices.getDisplayMedia({ video: true }));
  openSample(OPENING);
}

async function openSample(name) {
  const asked = ++wanted;
  const blob = await (await fetch(`try.${name}.jpg`)).blob();
  if (asked === wanted) open(blob, thingsOf(name));
}

function sample(name, words) {
  const button = make("button", "", { type: "button", title: words });
  const image = make("img", "", { src: `try.${name}.jpg`, alt: words });
  button.append(image);
  button.addEventListener("click", () => openSample(name));
  return button;
}

function offerDrop(stage) {
  const over = (event, isOver) => {
    event.preventDefault();
    stage.classList.toggle("over", isOver);
  };
  addEventListener("dragover", (event) => over(event, true));
  addEventListener("dragleave", (event) => over(event, false));
  addEventListener("drop", (event) => {
    over(event, false);
    take(event.dataTransfer);
  });
}

// Opens what was dropped or pasted. Another page gives the address of its picture, which this page may not load.
function take({ files, types }) {
  if (files.length) open(files[0]);
  else if (types.length) setText(byId("told"), "That is text or an address, not a picture: save the picture and drop its file, or copy the picture itself.");
}

// Shows a picture from a file or the clipboard; reports an error for other files.
export async function open(file, things = []) {
  if (!file) return;
  wanted++;
  end();
  try {
    give(await decoded(file), false, things);
    setText(byId("told"), "");
  } catch {
    setText(byId("told"), `${file.name || "The file"} is not a picture that this browser can read: use a JPEG, PNG or WebP. The one before stays.`);
  }
}

function offerLive(id, ask) {
  byId(id).addEventListener("click", async () => {
    const isOn = byId(id).ariaPressed === "true";
    wanted++;
    end();
    if (isOn) return;
    if (!navigator.mediaDevices) {
      setText(byId("told"), "Browsers allow camera and screen only for pages on this machine or over https.");
      return;
    }
    try {
      stream = await ask();
    } catch (error) {
      setText(byId("told"), `No picture: ${error.message}.`);
      return;
    }
    byId(id).ariaPressed = "true";
    const [track] = stream.getVideoTracks();
    track.addEventListener("ended", end);
    track.addEventListener("mute", () => setText(byId("told"), "No picture comes: the shared window is minimised, or the camera is covered or in use. The last one stays."));
    track.addEventListener("unmute", () => setText(byId("told"), ""));
    video.srcObject = stream;
    await video.play();
    timer = setInterval(look, LOOK_MS);
  });
}

function end() {
  clearInterval(timer);
  for (const track of stream?.getTracks() ?? []) track.stop();
  stream = before = null;
  for (const id of ["camera", "screen"]) byId(id).ariaPressed = "false";
}

function look() {
  if (!video.videoWidth || !hasChanged()) return;
  give(video, true);
}

function hasChanged() {
  const context = small.getContext("2d", { willReadFrequently: true });
  context.drawImage(video, 0, 0, SMALL, SMALL);
  const { data } = context.getImageData(0, 0, SMALL, SMALL);
  let sum = 0;
  for (let at = 0; before && at < data.length; at++) sum += Math.abs(data[at] - before[at]);
  const isOther = !before || sum / (3 * SMALL * SMALL) > CHANGED;
  if (isOther) before = data;
  return isOther;
}

// Returns a file's picture with the colours of its profile, by the rule of vision/files.py for alpha.
async function decoded(file) {
  const picture = await createImageBitmap(file);
  return isShown(picture) ? picture : ((await withoutAlpha(file, picture)) ?? picture);
}

// Returns the colours of an engine's screenshot, whose alpha is not what is seen; null without WebGL. A 2D canvas keeps
// no colour where the alpha is 0, a texture does.
async function withoutAlpha(file, { width, height }) {
  const { width: resizeWidth, height: resizeHeight } = scaledSize(width, height);
  const gl = new OffscreenCanvas(1, 1).getContext("webgl");
  if (!gl) return null;
  const source = await createImageBitmap(file, { premultiplyAlpha: "none", resizeWidth, resizeHeight });
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, source);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, gl.getParameter(gl.TEXTURE_BINDING_2D), 0);
  const pixels = new ImageData(resizeWidth, resizeHeight);
  gl.readPixels(0, 0, resizeWidth, resizeHeight, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(pixels.data.buffer));
  for (let at = 3; at < pixels.data.length; at += 4) pixels.data[at] = 255;
  return createImageBitmap(pixels);
}

function scaledSize(width, height) {
  const scale = Math.min(1, LONGEST_PX / Math.max(width, height));
  return { width: Math.max(1, Math.round(width * scale)), height: Math.max(1, Math.round(height * scale)) };
}

function isShown(picture) {
  const { data } = pixelsOf(scaled(picture));
  let opaque = 0;
  for (let at = 3; at < data.length; at += 4) opaque += data[at] >= OPAQUE;
  return opaque >= SHOWN * (data.length / 4);
}

function scaled(image, ground = null) {
  const canvas = make("canvas", "", scaledSize(image.videoWidth ?? image.width, image.videoHeight ?? image.height));
  const context = canvas.getContext("2d");
  if (ground) {
    context.fillStyle = ground;
    context.fillRect(0, 0, canvas.width, canvas.height);
  }
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return canvas;
}

function pixelsOf(canvas) {
  return canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
}

// Returns a canvas without its bars, or the canvas itself.
function withoutBars(canvas) {
  const box = contentBox(pixelsOf(canvas).data, canvas.width, canvas.height);
  if (!box) return canvas;
  const content = make("canvas", "", { width: box.right - box.left, height: box.bottom - box.top });
  content.getContext("2d").drawImage(canvas, -box.left, -box.top);
  return content;
}

async function give(image, live, things = []) {
  const whole = scaled(image, GROUND);
  const canvas = live ? whole : withoutBars(whole);
  const mine = ++number;
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/jpeg", QUALITY));
  const jpeg = new Uint8Array(await blob.arrayBuffer());
  const thing = live || things.length ? null : await outlined(canvas);
  if (mine === number) onPicture({ number: mine, canvas, jpeg, live, thing, things });
}
