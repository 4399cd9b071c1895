// Draws pictures of patterns: a body of the material, and the motion of the hand.
const SVG = "http://www.w3.org/2000/svg";

const BODIES = {
  wood: [["path", { class: "body", d: "M10 58h76v26H10z" }], ["path", { d: "M10 66c20 5 28-5 44 0s20 3 32-1M10 76c14-4 30 5 46 0s20-2 30 1" }], ["ellipse", { cx: 60, cy: 71, rx: 6, ry: 3 }]],
  glass: [["path", { class: "body", d: "M30 44h36l-5 40H35z" }], ["path", { d: "M32 58h32M40 64l-1 13" }]],
  fabric: [["path", { class: "body", d: "M10 62c12-8 24 6 38 0s26-6 38 0v22c-12-6-24 6-38 0s-26-6-38 0z" }], ["path", { "stroke-dasharray": "3 5", d: "M12 70c12-6 22 5 36 0s26-6 36 0M12 78c12-6 22 5 36 0s26-6 36 0" }]],
  metal: [["path", { class: "body", d: "M14 82 74 34l8-2-3 8-59 48z" }], ["path", { d: "m26 70 12 12M22 80l50-40" }]],
};
const SOLID = [["rect", { class: "body", x: 14, y: 58, width: 68, height: 26, rx: 4 }], ["path", { d: "M22 76l10-10M40 76l10-10M58 76l10-10" }]];

const MOTIONS = {
  tap: [["path", { d: "M58 20v14M50 36a11 11 0 0 1 16 0M45 31a18 18 0 0 1 26 0" }]],
  strike: [["path", { d: "M48 8v34M39 32l9 10 9-10M24 46l-7-7M72 46l7-7" }]],
  press: [["path", { d: "M48 14v26M40 33l8 8 8-8M28 48h40" }]],
  slide: [["path", { d: "M16 38h64M26 28 16 38l10 10M70 28l10 10-10 10" }]],
  carve: [["path", { d: "M64 8 46 34l-6 16 12-12L72 14zM14 50l8-6 6 6 8-6" }]],
  swing: [["path", { d: "M12 40C18 18 44 6 70 14M14 54c4-16 18-28 36-30M60 6l11 8-9 10" }]],
};
const WARMTH = {
  hot: [["path", { d: "M12 2c2 5 7 7 7 13a7 7 0 0 1-14 0c0-4 3-5 3-9 2 1 3 2 4 4 1-2 1-5 0-8z" }]],
  cold: [["path", { d: "M12 1v22M2.500 6.500l19 11M2.500 17.500l19-11M9 3l3 3 3-3M9 21l3-3 3 3" }]],
};

function drawing(shapes, box) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", box);
  svg.setAttribute("aria-hidden", "true");
  for (const [shape, attributes] of shapes) {
    const element = document.createElementNS(SVG, shape);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    svg.append(element);
  }
  return svg;
}

export function glyph(pattern) {
  const motion = (MOTIONS[pattern.interaction] ?? []).map(([shape, rest]) => [shape, { ...rest, class: "motion" }]);
  return drawing([...(BODIES[pattern.material] ?? SOLID), ...motion], "0 0 96 92");
}

export function warmth(pattern, name) {
  const label = document.createElement("span");
  label.className = `warmth ${pattern.temperature}`;
  const shapes = WARMTH[pattern.temperature];
  if (shapes) label.append(drawing(shapes, "0 0 24 24"));
  label.append(name);
  return label;
}
