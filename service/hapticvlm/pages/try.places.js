// Chooses where a picture is recognised before anybody points, and the places that are shown. Pure.
//
// A picture of many things has no material as a whole, so it is recognised on a grid of regions.

const MAX_PLACES = 3;
const APART = 0.75; // of a region's side, least distance of two places

// Returns the centres ({x, y, size}, 0..1) of regions of this size that cover a picture, the most central first.
export function grid({ width, height }, size) {
  const side = size * Math.min(width, height);
  const centres = (length) => {
    const count = Math.max(1, Math.round(length / side));
    return Array.from({ length: count }, (_, index) => (index + 0.5) / count);
  };
  const all = centres(height).flatMap((y) => centres(width).map((x) => ({ x, y, size })));
  return all.sort((one, other) => fromMiddle(one) - fromMiddle(other));
}

const fromMiddle = ({ x, y }) => Math.hypot(x - 0.5, y - 0.5);

// Returns up to MAX_PLACES of [{region, decision}] that do not overlap much: the most certain of each material first.
// If no material is certain anywhere, they are the likeliest.
export function surest(answers) {
  const isSure = ({ decision }) => decision.material !== "unknown";
  const certain = answers.filter(isSure);
  const sorted = [...(certain.length ? certain : answers)].sort((one, other) => other.decision.confidence - one.decision.confidence);
  const places = [];
  for (const isRepeated of [false, true]) {
    for (const answer of sorted) {
      const isNew = !places.some(({ decision }) => decision.material === answer.decision.material);
      if (places.length < MAX_PLACES && isNew !== isRepeated && places.every((place) => areApart(place.region, answer.region))) places.push(answer);
    }
  }
  return places;
}

function areApart(one, other) {
  return Math.abs(one.x - other.x) >= APART * one.w || Math.abs(one.y - other.y) >= APART * one.h;
}

// Returns whether all certain places have the material of the whole picture, which may then be named.
export function agree(whole, answers) {
  const materials = answers.map(({ decision }) => decision.material).filter((material) => material !== "unknown");
  return whole.material !== "unknown" && materials.every((material) => material === whole.material);
}

// Returns the certain materials of these places, without repetition.
export function materialsOf(places) {
  return [...new Set(places.map(({ decision }) => decision.material).filter((material) => material !== "unknown"))];
}
