// Says in words what is under the hand, and takes corrections.
import { byId, degrees, list, make, percent, setText } from "./dom.js";
import { materialColour, warmthColour, warmthWord } from "./feel.js";
import * as felt from "./felt.js";

const MAX_LIKELY = 3;
const BEFORE = { object: "Nothing touched yet", material: "Touch anything in this picture" };
const WHOLE = { picture: "The whole picture", thing: "The whole picture, and the thing outlined on its plain ground" };
const HAND = "Under the hand";
const STATED = { us: "labelled by us", you: "stated by you" };
const CANNOT = { living: "I do not feel people or animals", else: "I cannot tell" };
const AT_REST = "press to feel it";

let scene = null;
let chosen = null; // the material chosen by the user for a patch, which newer decisions do not change

export function begin(given) {
  scene = given;
  byId("correct").addEventListener("submit", correct);
  byId("correct-material").addEventListener("input", () => {
    chosen = { id: scene.decision()?.object_id, material: byId("correct-material").value };
  });
  byId("keep").addEventListener("click", keep);
  byId("undo").addEventListener("click", undo);
}

export function offerMaterials(materials) {
  const select = byId("correct-material");
  if (!select.options.length) select.append(...materials.map((name) => make("option", name, { value: name })));
}

// Leaves nothing of the picture before.
export function clear() {
  setText(byId("object"), "");
  setText(byId("material"), "—");
  for (const id of ["sure", "corrected"]) setText(byId(id), "");
  for (const id of ["feel-warmth", "feel-vibration", "keep", "undo"]) byId(id).hidden = true;
}

// Shows the decision about the patch under the hand; decisions about others are stored for later.
export function show() {
  const decision = scene.decision();
  byId("correct").hidden = byId("reasons").hidden = !decision?.object_id || isBefore();
  if (decision) {
    list(byId("because"), because(decision));
    offerCorrection(decision);
  }
  if (isBefore()) showBefore();
  else if (decision) showDecision(decision);
}

// Whether nobody has pointed at a picture of several things, which has no material as a whole.
const isBefore = () => scene.isWhole && !scene.thing && !scene.isStated;

function showBefore() {
  body(undefined);
  setText(byId("object"), BEFORE.object);
  setText(byId("material"), BEFORE.material);
  setText(byId("sure"), "");
  for (const id of ["feel-warmth", "feel-vibration"]) byId(id).hidden = true;
}

function showDecision(decision) {
  body(decision.felt ?? decision.material);
  setText(byId("object"), whereOf());
  setText(byId("material"), headline(decision));
  setText(byId("sure"), sureness(decision));
  for (const id of ["feel-warmth", "feel-vibration"]) byId(id).hidden = false;
  byId("feel-warmth").style.setProperty("--now", decision.thermal_cue ? warmthColour(decision.setpoint_c) : "var(--line)");
  setText(byId("feel-warmth-words"), warmth(decision));
}

const body = (material) => byId("answer").style.setProperty("--body", materialColour(material));
const whereOf = () => (scene.isWhole ? WHOLE[scene.thing ? "thing" : "picture"] : HAND);
const nextOf = ({ material, runner_up: next }) => (material !== "unknown" && next ? `; next ${next}` : "");
const headline = (decision) => (decision.material === "unknown" ? (CANNOT[decision.neutral_because] ?? CANNOT.else) : decision.material);

// Says how sure a material is, and what is felt where none is said.
function sureness(decision) {
  if (decision.source === "scene") return scene.target().thing && !scene.isCorrected ? STATED.us : STATED.you;
  if (decision.material !== "unknown") return `${percent(decision.confidence)} sure, ${felt.SOURCES[decision.source]}${nextOf(decision)}`;
  return decision.neutral_because ? "" : `it feels like ${felt.material(decision)}`;
}

// Says what the hand does and how strongly that is felt now. Returns the words of the card beside the finger.
export function showMotion(hand, speed, level) {
  const decision = scene.decision();
  const act = felt.gesture({ pressed: hand.pressed, touchedFor: performance.now() - hand.pressedAt, speed });
  const motion = act === null ? AT_REST : felt.motion(act, level);
  if (!decision) return { word: scene.target()?.thing?.material ?? "…", source: "", decision: null, motion };
  setText(byId("feel-pattern"), act === null ? motion : felt.sentence(decision, act, level));
  return { word: headline(decision), source: sureness({ ...decision, runner_up: null }), decision, motion };
}

function offerCorrection(decision) {
  const { material, runner_up: next, object_id: id } = decision;
  const likeliest = material === "unknown" ? (next ?? "wood") : material;
  byId("correct-material").value = chosen && chosen.id === id ? chosen.material : likeliest;
  showLikeliest(decision);
}

// Shows the three most likely materials as buttons: one press corrects the decision.
function showLikeliest({ material, runner_up: next, evidence }) {
  const seen = [...evidence].sort((one, other) => other.confidence - one.confidence).map((one) => one.material);
  const names = [...new Set([material, next, ...seen])].filter((name) => name && name !== "unknown").slice(0, MAX_LIKELY);
  const group = byId("likeliest");
  if ([...group.children].map((button) => button.textContent).join() === names.join()) return;
  group.replaceChildren(...names.map((name) => make("button", name, { type: "submit", value: name })));
}

function because(decision) {
  const looks = decision.evidence.map(({ rung, material, confidence }) => `${rung}: ${material} ${percent(confidence)}`);
  return [
    ["evidence", looks.join("; ") || "none"],
    ["felt as", felt.material(decision)],
    ["warmth", warmth(decision)],
    ["surface", `${degrees(decision.surface_c)} (${decision.surface_why || decision.surface_source})`],
  ];
}

const warmth = ({ thermal_cue: isNoticed, setpoint_c: setpoint, contact_c: contact }) =>
  isNoticed ? `${warmthWord(setpoint)}: ${degrees(contact)} under the hand` : "no noticeable warmth or cold";

async function correct(event) {
  event.preventDefault();
  const material = event.submitter?.value || byId("correct-material").value;
  byId("correct-material").value = material;
  const answer = await scene.state(material);
  setText(byId("corrected"), answer.type === "ok" ? `Corrected to ${material}. It feels like ${material} from now on.` : (answer.text ?? "The service did not answer."));
  byId("keep").hidden = byId("undo").hidden = answer.type !== "ok";
}

async function undo() {
  const answer = await scene.unstate();
  setText(byId("corrected"), answer.type === "ok" ? "Taken back: it is recognised again." : (answer.text ?? "The service did not answer."));
  if (answer.type !== "ok") return;
  chosen = null;
  byId("keep").hidden = byId("undo").hidden = true;
}

async function keep() {
  const answer = await scene.keep();
  const material = byId("correct-material").value;
  const lasting = `To keep it permanently, save a cut-out and run: hapticvlm gallery add my-${material} --like ${material} PICTURE`;
  setText(byId("corrected"), answer.type === "decision" ? `Kept for this session, where it helps to recognise similar objects. ${lasting}` : (answer.text ?? "The service did not answer."));
}
