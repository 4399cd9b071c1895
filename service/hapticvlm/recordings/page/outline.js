// Draws frames of a session, the touched object outlined by its mask.
const OUTLINE_PX = 2;
const pictures = new Map();

// The picture of a frame with the object outlined, if it is touched; drawn once each.
export function outlined(frame, isTouched, colour) {
  const key = `${frame.t_s} ${isTouched} ${colour}`;
  if (!pictures.has(key)) pictures.set(key, paint(frame, isTouched, colour));
  return pictures.get(key);
}

async function paint({ image, mask }, isTouched, colour) {
  const picture = await loaded(image);
  const canvas = new OffscreenCanvas(picture.naturalWidth, picture.naturalHeight);
  const context = canvas.getContext("2d");
  context.drawImage(picture, 0, 0);
  if (mask && isTouched) {
    const rim = edge(await loaded(mask), canvas.width, canvas.height, colour);
    context.drawImage(rim, 0, 0, canvas.width, canvas.height);
  }
  return canvas;
}

// Draws the rim of a mask in a colour: the pixels that shifted copies of the mask add to it.
function edge(mask, width, height, colour) {
  const rim = new OffscreenCanvas(width, height);
  const context = rim.getContext("2d");
  const solid = new OffscreenCanvas(width, height);
  const inside = solid.getContext("2d");
  inside.drawImage(mask, 0, 0, width, height);
  const pixels = inside.getImageData(0, 0, width, height);
  for (let at = 0; at < pixels.data.length; at += 4) pixels.data[at + 3] = pixels.data[at] ? 255 : 0;
  inside.putImageData(pixels, 0, 0);
  for (const [x, y] of [[1, 0], [-1, 0], [0, 1], [0, -1], [0.7, 0.7], [-0.7, 0.7], [0.7, -0.7], [-0.7, -0.7]]) {
    context.drawImage(solid, x * OUTLINE_PX, y * OUTLINE_PX);
  }
  context.globalCompositeOperation = "source-in";
  context.fillStyle = colour;
  context.fillRect(0, 0, width, height);
  context.globalCompositeOperation = "destination-out";
  context.drawImage(solid, 0, 0);
  return rim;
}

function loaded(source) {
  const image = new Image();
  image.src = source;
  return image.decode().then(() => image);
}
