// Colours and words for warmth and materials, for all pages; pure functions without access to the page.

export const NEUTRAL_C = 32; // the plate at rest, close to the skin of a palm
const SCALE = [
  [14, [24, 76, 176]],
  [20, [46, 132, 218]],
  [27, [128, 190, 230]],
  [NEUTRAL_C, [214, 200, 178]],
  [35, [246, 172, 92]],
  [38, [228, 98, 44]],
  [42, [184, 28, 26]],
];
const MATERIALS = {
  wood: "#b0733c", glass: "#58b6cf", fabric: "#8f6bc4", metal: "#8796a5", plastic: "#d8619a", stone: "#8a7f72",
  ceramic: "#d9a441", paper: "#c2b280", leather: "#8b4a2b", rubber: "#4d5560", foliage: "#5c9a4a",
};

// Returns red, green, blue (0..255) of a temperature in degC, linear between the steps of the scale.
export function warmthRgb(celsius) {
  const above = SCALE.findIndex(([at]) => at >= celsius);
  if (above === 0) return SCALE[0][1];
  if (above < 0) return SCALE.at(-1)[1];
  const [[low, from], [high, to]] = [SCALE[above - 1], SCALE[above]];
  const share = (celsius - low) / (high - low);
  return from.map((value, index) => Math.round(value + share * (to[index] - value)));
}

export const warmthColour = (celsius, alpha = 1) => `rgb(${warmthRgb(celsius).join(" ")} / ${alpha})`;

// Adds the scale from `low` to `high` degC to a canvas gradient whose end 0 is `low`.
export function addScale(gradient, low, high, alpha = 1) {
  for (let step = 0; step <= 16; step++) gradient.addColorStop(step / 16, warmthColour(low + (step / 16) * (high - low), alpha));
  return gradient;
}

export function warmthWord(celsius) {
  if (celsius == null) return "";
  if (celsius < 24) return "cold";
  if (celsius < 30.5) return "cool";
  if (celsius <= 33.5) return "neutral";
  return celsius < 37 ? "warm" : "hot";
}

export const materialColour = (material) => MATERIALS[material] ?? "#7d8892";
