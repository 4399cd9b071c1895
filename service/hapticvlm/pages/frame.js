// The last frame the recogniser looked at, with the region it was asked about.
import { byId, clock, say } from "./dom.js";
import { palette } from "./chart.js";

const MOST_SIDE = 640;
let isDrawing = false; // a frame that comes meanwhile is left out: the next is never far

export async function show(view) {
  if (isDrawing) return;
  isDrawing = true;
  try {
    draw(await decode(view), view);
    tell(view);
  } catch {
    say(byId("frame-said"), "The last frame could not be shown.");
  } finally {
    isDrawing = false;
  }
}

function decode({ image, format }) {
  const bytes = Uint8Array.from(atob(image), (character) => character.charCodeAt(0));
  return createImageBitmap(new Blob([bytes], { type: `image/${format}` }));
}

function draw(bitmap, { region }) {
  const canvas = byId("frame");
  const scale = Math.min(1, MOST_SIDE / Math.max(bitmap.width, bitmap.height));
  const [width, height] = [Math.round(bitmap.width * scale), Math.round(bitmap.height * scale)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d");
  context.drawImage(bitmap, 0, 0, width, height);
  bitmap.close();
  if (region) outline(context, region, width, height);
}

// Dark under bright, so that it is seen on any picture.
function outline(context, { x, y, w, h }, width, height) {
  for (const [colour, line] of [["#000", 6], [palette().stop, 4], ["#fff", 2]]) {
    context.strokeStyle = colour;
    context.lineWidth = line;
    context.strokeRect(x * width, y * height, w * width, h * height);
  }
}

function tell({ object_id, region }) {
  const what = object_id ? `of ${object_id}` : region ? "of the touched region" : "of the whole view";
  const where = region ? "; the box is the region" : "";
  say(byId("frame-said"), `Frame ${what} at ${clock()}${where}.`);
  byId("frame").ariaLabel = `The last frame looked at, ${what}${where}`;
}
