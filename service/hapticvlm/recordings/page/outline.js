// Draws frames of a session, the touched object outlined by its mask, and finds where in the frame it is.
const OUTLINE_PX = 2;
const pictures = new Map();

// Returns {picture, centre}: a frame with the object outlined, if it is touched, and the object's middle (0..1). Drawn once each.
export function outlined(frame, isTouched, colour) {
  const key = `${frame.t_s} ${isTouched} ${colour}`;
  if (!pictures.has(key)) pictures.set(key, paint(frame, isTouched, colour));
  return pictures.get(key);
}

async function paint({ image, mask, region }, isTouched, colour) {
  const picture = await loaded(image);
  const canvas = new OffscreenCanvas(picture.naturalWidth, picture.naturalHeight);
  const context = canvas.getContext("2d");
  context.drawImage(picture, 0, 0);
  if (mask && isTouched) {
    const { rim, centre } = edge(await loaded(mask), canvas.width, canvas.height, colour);
    context.drawImage(rim, 0, 0, canvas.width, canvas.height);
    return { picture: canvas, centre };
  }
  const { x, y, w, h } = region ?? { x: 0, y: 0, w: 1, h: 1 };
  return { picture: canvas, centre: { x: x + w / 2, y: y + h / 2 } };
}

// Draws the rim of a mask in a colour: the pixels that shifted copies of the mask add to it. Its centre is that of its pixels.
function edge(mask, width, height, colour) {
  const rim = new OffscreenCanvas(width, height);
  const context = rim.getContext("2d");
  const solid = new OffscreenCanvas(width, height);
  const inside = solid.getContext("2d");
  inside.drawImage(mask, 0, 0, width, height);
  const pixels = inside.getImageData(0, 0, width, height);
  const sum = { x: 0, y: 0, count: 0 };
  for (let at = 0; at < width * height; at++) {
    const isInside = pixels.data[4 * at] > 0;
    pixels.data[4 * at + 3] = isInside ? 255 : 0;
    if (!isInside) continue;
    sum.x += at % width;
    sum.y += Math.floor(at / width);
    sum.count++;
  }
  inside.putImageData(pixels, 0, 0);
  for (const [x, y] of [[1, 0], [-1, 0], [0, 1], [0, -1], [0.7, 0.7], [-0.7, 0.7], [0.7, -0.7], [-0.7, -0.7]]) {
    context.drawImage(solid, x * OUTLINE_PX, y * OUTLINE_PX);
  }
  context.globalCompositeOperation = "source-in";
  context.fillStyle = colour;
  context.fillRect(0, 0, width, height);
  context.globalCompositeOperation = "destination-out";
  context.drawImage(solid, 0, 0);
  const centre = sum.count ? { x: sum.x / sum.count / width, y: sum.y / sum.count / height } : { x: 0.5, y: 0.5 };
  return { rim, centre };
}

function loaded(source) {
  const image = new Image();
  image.src = source;
  return image.decode().then(() => image);
}
