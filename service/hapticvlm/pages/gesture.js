// Says what the hand does at this moment with the object that is explained, and how strongly that is felt.
import { inStep } from "./chart.js";
import { byId, setText } from "./dom.js";
import * as felt from "./felt.js";
import { OBJECT, isSwinging } from "./trial.js";

const STEP_MS = 100;
const LEVEL_FALL = 0.7; // of the level, per piece of the vibration

let explained = null; // decision
let touch = null; // {object, since, speed}, or null while no hand touches
let level = 0; // of the vibration, of full scale

// Takes a piece of the vibration, with the object that is touched and the hand's speed (m/s; null: no hand touches).
export function take({ object_id: object = null, speed_mps: speed = null, samples }) {
  level = samples.reduce((most, sample) => Math.max(most, Math.abs(sample)), LEVEL_FALL * level);
  const isSame = touch !== null && touch.object === object;
  touch = speed === null ? null : { object, speed, since: isSame ? touch.since : performance.now() };
  showSoon();
}

export function about(decision) {
  explained = decision;
  show();
}

// Forgets the hand while the service is not connected.
export function gap() {
  touch = null;
  show();
}

const showSoon = inStep(show, STEP_MS);

function show() {
  if (explained) setText(byId("feel-pattern"), words());
}

function words() {
  if (touch && touch.object === (explained.object_id ?? null)) {
    const act = felt.gesture({ pressed: true, touchedFor: performance.now() - touch.since, speed: touch.speed });
    return felt.sentence(explained, act, level);
  }
  if (isSwinging() && explained.object_id === OBJECT) return felt.swing(level);
  return explained.pattern ? `vibrates like ${felt.material(explained)}` : "not touched yet";
}
