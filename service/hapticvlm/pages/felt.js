// Says what a touch feels like now, from its decision, the hand and the vibration. Pure.
//
// What is felt is one material in full (`felt`), also where no material is certain enough to be named. A decision is
// sent once, at the first touch, so its pattern is no description of the hand's motion now.

import { warmthWord } from "./feel.js";

const TAP_MS = 180; // after a contact, during which it is a tap
const SILENT = 1e-4; // of full scale
const STRENGTHS = [[0.05, "gentle", "gently"], [0.2, "clear", "clearly"], [Infinity, "strong", "strongly"]]; // our choice: a stroke over wood is gentle, over stone clear, and a strike is strong

// Words for the source of a decision; a page adds its own for "scene", which is the user or a scene.
export const SOURCES = {
  name: "by its name", shader: "by its shader", texture: "by its texture", encoder: "by how it looks",
  vlm: "by the vision-language model", unknown: "too uncertain to name",
};

// Returns the name of what is touched: what is felt is always in it.
export function headline({ material, runner_up: next, felt, basis, neutral_because: because }) {
  if (material !== "unknown") return material;
  if (because === "living") return "a person or an animal";
  if (basis === "expectation") return next ? `between ${next} and others` : "a mean of materials";
  if (!felt) return next ? `perhaps ${next}` : "not known";
  return next && next !== felt ? `between ${next} and ${felt}` : `perhaps ${felt}`;
}

// Returns the material of the vibration in words; `pattern` names the one nearest to a mean.
export function material({ felt, basis, pattern, material: named }) {
  const nearest = pattern?.slice(0, pattern.lastIndexOf(" "));
  if (basis === "expectation") return nearest ? `a mean of materials, nearest to ${nearest}` : "a mean of materials";
  return felt ?? nearest ?? (named === "unknown" ? "nothing in particular" : named);
}

// Returns how it feels in plain words, such as "cold, smooth, rings".
export const feels = ({ thermal_cue: isNoticed, setpoint_c: setpoint, feels: words = [] }) => [isNoticed ? warmthWord(setpoint) : "neutral", ...words].filter((word) => word !== "neutral").join(", ");

// Returns the gesture of this moment; `touchedFor` is the time since the contact, ms, and `speed` is in m/s.
export function gesture({ pressed, touchedFor, speed }) {
  if (!pressed) return null;
  if (touchedFor < TAP_MS) return "tap";
  return speed > 0 ? "slide" : "held still";
}

// Returns how strong a vibration of this level (of full scale) is: "silent", "gentle", "clear" or "strong".
export const strength = (level) => (level < SILENT ? "silent" : STRENGTHS.find(([below]) => level < below)[1]);

// Returns the same as an adverb, or null for silence.
export const strongly = (level) => (level < SILENT ? null : STRENGTHS.find(([below]) => level < below)[2]);

// Returns the gesture of this moment with the material and the strength: "feels like metal: slide, gently".
export function sentence(decision, act, level) {
  return `feels like ${material(decision)}: ${motion(act, level)}`;
}

// Returns the same without the material; `act` is of `gesture`.
export const motion = (act, level) => [act, strongly(level)].filter(Boolean).join(", ");

// Returns a swing at this level in words: its vibration is of the air and not of a material.
export const swing = (level) => motion("a swing through the air", level);
