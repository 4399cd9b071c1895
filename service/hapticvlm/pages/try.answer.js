// Says in words what is under the hand, and takes corrections.
import { byId, degrees, list, make, percent, setText } from "./dom.js";
import { materialColour } from "./feel.js";
import * as felt from "./felt.js";

const LIKELY = 4; // materials offered as buttons where the one said is not right
const COMMON = ["wood", "metal", "glass", "fabric", "plastic"]; // offered where nothing is more likely
const SEEN = { picture: "the whole picture", thing: "the whole picture, and the thing outlined on its plain ground", part: "the part under the hand" };
const CANNOT = { living: "I do not feel people or animals", unseen: "Not recognised here", else: "I cannot tell" }; // "unseen" comes from a bake alone

let scene = null;

export function begin(given) {
  scene = given;
  byId("likeliest").addEventListener("click", ({ target }) => target.value && correct(target.value));
  byId("correct-material").addEventListener("change", ({ target }) => target.value && correct(target.value));
  byId("undo").addEventListener("click", undo);
}

export function offerMaterials(materials) {
  byId("correct-material").replaceChildren(make("option", "something else", { value: "" }), ...materials.map((name) => make("option", name, { value: name })));
}

// Leaves nothing of the picture before.
export function clear() {
  setText(byId("corrected"), "");
  byId("undo").hidden = true;
}

// Shows the decision about the patch under the hand; decisions about others are stored for later.
export function show() {
  const decision = isBefore() ? null : scene.decision();
  byId("correct").hidden = byId("reasons").hidden = !decision?.object_id;
  byId("answer").style.setProperty("--body", materialColour(decision?.felt ?? decision?.material));
  setText(byId("material"), decision ? headline(decision) : isBefore() ? "Nothing touched yet" : "…");
  setText(byId("sure"), decision ? remark(decision) : "");
  if (!decision) return;
  list(byId("because"), because(decision));
  offerLikeliest(decision);
}

// Whether nobody has pointed at a picture of several things, which has no material as a whole.
const isBefore = () => scene.isWhole && !scene.thing && !scene.isStated;
const headline = (decision) => (decision.material === "unknown" ? (CANNOT[decision.neutral_because] ?? CANNOT.else) : decision.material);

// Says who stated a material, and what is felt where none is said.
function remark(decision) {
  if (decision.source === "scene") return scene.target().thing && !scene.isCorrected ? "labelled by us" : "stated by you";
  return decision.material !== "unknown" || decision.neutral_because ? "" : `it feels like ${felt.material(decision)}`;
}

// Says what the hand does and how strongly that is felt now. Returns the words of the card beside the finger; null before a
// picture has been pointed at.
export function showMotion(hand, speed, level) {
  const decision = isBefore() ? null : scene.decision();
  const act = felt.gesture({ pressed: hand.pressed, touchedFor: performance.now() - hand.pressedAt, speed });
  const motion = decision?.neutral_because ? "nothing to feel here" : act === null ? "press to feel it" : felt.motion(act, level);
  setText(byId("feels"), decision ? felt.feels(decision) : "");
  setText(byId("motion"), motion);
  if (isBefore()) return null;
  if (!decision) return { word: scene.target()?.thing?.material ?? "…", source: "", decision: null, motion };
  return { word: headline(decision), source: remark(decision), decision, motion };
}

// Shows the most likely materials, but the one said, as buttons: one press corrects the decision.
function offerLikeliest({ material, felt: rendered, runner_up: next, evidence }) {
  const seen = [...evidence].sort((one, other) => other.confidence - one.confidence).map((one) => one.material);
  const known = [...byId("correct-material").options].map(({ value }) => value);
  const names = [...new Set([next, rendered, ...seen, ...COMMON])].filter((name) => name !== material && known.includes(name)).slice(0, LIKELY);
  const group = byId("likeliest");
  if ([...group.children].map(({ value }) => value).join() === names.join()) return;
  group.replaceChildren(...names.map((name) => make("button", name, { type: "button", value: name })));
}

function because(decision) {
  const { material, confidence, source, runner_up: next, evidence, surface_c: surface, contact_c: contact } = decision;
  const living = decision.neutral_because === "living" && evidence.find((one) => one.material === "living");
  const looks = evidence.map((one) => `${one.rung}: ${one.material} ${percent(one.confidence)}`);
  return [
    ["sure", living ? `${percent(living.confidence)}, a person or an animal` : `${percent(confidence)}, ${felt.SOURCES[source] ?? "as stated"}${material !== "unknown" && next ? `; next ${next}` : ""}`],
    ["seen", scene.isWhole ? SEEN[scene.thing ? "thing" : "picture"] : SEEN.part],
    ["evidence", looks.join("; ") || "none"],
    ["felt as", felt.material(decision)],
    ["warmth", decision.thermal_cue ? `${degrees(contact)} under the hand` : "no noticeable warmth or cold"],
    ["surface", `${degrees(surface)} (${decision.surface_why || decision.surface_source})`],
  ];
}

async function correct(material) {
  const answer = await scene.state(material);
  tell(answer, `Corrected to ${material}.`);
  byId("undo").hidden = answer.type !== "ok";
  byId("correct-material").value = "";
}

async function undo() {
  const answer = await scene.unstate();
  tell(answer, "Taken back: it is recognised again.");
  byId("undo").hidden = answer.type === "ok";
}

const tell = ({ type, text }, words) => setText(byId("corrected"), type === "ok" ? words : (text ?? "The service did not answer."));
