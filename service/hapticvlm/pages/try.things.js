// The things on the pictures that ship, outlined and labelled by us, the nearest first. Pure.
const SIZES = { table: [960, 446], carafe: [280, 200], cloth: [280, 200], kettle: [280, 200] }; // that the outlines count in
const OUTLINES = {
  table: [
    ["carafe", "glass", [140, 50, 165, 42, 218, 46, 210, 90, 240, 150, 238, 185, 215, 208, 165, 208, 150, 170, 152, 120, 158, 90]],
    ["kettle", "metal", [332, 195, 334, 150, 355, 110, 342, 90, 352, 65, 390, 52, 432, 58, 442, 85, 438, 108, 458, 135, 470, 100, 484, 86, 495, 95, 480, 115, 472, 140, 462, 148, 464, 190, 440, 222, 395, 230, 350, 222]],
    ["bottle", "glass", [592, 18, 612, 18, 613, 60, 622, 95, 622, 185, 612, 196, 575, 196, 567, 185, 573, 95, 590, 65]],
    ["copper bowl", "metal", [691, 122, 740, 106, 800, 108, 844, 130, 838, 165, 800, 200, 745, 202, 705, 170]],
    ["wooden bowl", "wood", [36, 295, 60, 258, 130, 237, 200, 238, 233, 262, 225, 310, 190, 350, 130, 362, 80, 355, 45, 330]],
    ["cushion", "fabric", [558, 225, 575, 212, 650, 208, 680, 232, 678, 250, 660, 260, 585, 265, 565, 248]],
    ["block", "wood", [549, 232, 562, 240, 585, 266, 688, 252, 684, 300, 572, 315, 553, 285]],
    ["hammer", "metal", [330, 352, 355, 345, 400, 400, 395, 420, 370, 424, 358, 412]],
    ["handle", "wood", [380, 365, 545, 305, 567, 308, 570, 322, 550, 328, 392, 378]],
    ["cloth", "fabric", [725, 250, 738, 235, 915, 247, 935, 300, 930, 372, 722, 348]],
    ["table", "wood", [60, 139, 912, 139, 960, 235, 960, 446, 0, 446, 0, 235]],
    ["panelling", "wood", [0, 0, 960, 0, 960, 446, 0, 446]],
  ],
  carafe: [
    ["carafe", "glass", [26, 15, 60, 40, 40, 110, 42, 150, 75, 180, 150, 188, 205, 178, 240, 140, 230, 100, 185, 70, 178, 45, 192, 18, 110, 12]],
    ["table", "wood", [0, 113, 280, 113, 280, 200, 0, 200]],
    ["panelling", "wood", [0, 0, 280, 0, 280, 200, 0, 200]],
  ],
  cloth: [
    ["cloth", "fabric", [42, 22, 236, 40, 257, 130, 248, 172, 28, 148, 26, 60]],
    ["table", "wood", [0, 0, 280, 0, 280, 200, 0, 200]],
  ],
  kettle: [
    ["kettle", "metal", [30, 165, 35, 120, 65, 80, 45, 70, 52, 40, 110, 18, 170, 22, 186, 40, 178, 80, 200, 108, 225, 65, 245, 52, 254, 62, 235, 80, 215, 108, 212, 165, 160, 185, 70, 185]],
    ["table", "wood", [0, 100, 280, 100, 280, 200, 0, 200]],
    ["panelling", "wood", [0, 0, 280, 0, 280, 200, 0, 200]],
  ],
};

// Returns the things of a sample: [{name, material, points: [[x, y]], region}], all 0..1 of the picture.
export function thingsOf(sample) {
  return (OUTLINES[sample] ?? []).map(([name, material, flat]) => {
    const [width, height] = SIZES[sample];
    const points = flat.flatMap((x, at) => (at % 2 ? [] : [[x / width, flat[at + 1] / height]]));
    const [across, down] = [0, 1].map((axis) => points.map((point) => point[axis]));
    const [x, y] = [Math.min(...across), Math.min(...down)];
    return { name, material, points, region: { x, y, w: Math.max(...across) - x, h: Math.max(...down) - y } };
  });
}

// Returns the nearest of the things that has this point within its outline, by the rule of odd crossings.
export function thingAt(things, { x, y }) {
  const isLeftOf = ([ax, ay], [bx, by]) => ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax);
  return things.find(({ points }) => points.filter((point, at) => isLeftOf(point, points.at(at - 1))).length % 2 === 1);
}
