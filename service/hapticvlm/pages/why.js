// Explains one decision: the material, the evidence of each rung of the ladder, and the effect on the plate.
import { byId, degrees, list, make, percent, setText } from "./dom.js";
import { NEUTRAL_C, materialColour, warmthColour, warmthWord } from "./feel.js";
import * as gesture from "./gesture.js";
import { OBJECT as TEST_TOUCH } from "./trial.js";

const RUNGS = ["scene", "name", "shader", "texture", "encoder", "vlm"];
const RUNG_WORDS = {
  scene: "stated by the scene",
  name: "from its name",
  shader: "from its shader parameters",
  texture: "read off its texture map",
  encoder: "recognised by the encoder",
  vlm: "from the vision-language model",
  unknown: "no rung is sure",
};
const LIMIT_WORDS = {
  setpoint: "the band of setpoints",
  slew: "the slew rate",
  current: "the driver's current",
  sink: "the heat sink",
  dose: "the thermal dose",
};
const AMBIENT_WORDS = {
  scene: "the scene",
  vlm: "the vision-language model",
  estimate: "an estimate",
  default: "the default",
};
const SURFACE_WORDS = { scene: "the scene", name: "its name", sun: "the sun", ambient: "the ambient" };

const BASIS_WORDS = {
  least_error: "the material that errs least on average, because none is sure enough",
  expectation: "the expected value over possible materials",
  neutral: "neutral, because the material is unknown",
};
const MIN_DIFFERENCE_C = 0.05;

export function explain(decision, title) {
  setText(byId("material"), decision.material);
  setText(byId("object"), title);
  setText(byId("verdict"), verdict(decision));
  byId("decision-card").style.setProperty("--body", materialColour(decision.material));
  byId("decision-card").classList.toggle("unknown", decision.material === "unknown");
  fillFeel(decision);
  RUNGS.forEach((rung, index) => fillRung(rungRow(index), rung, decision));
  list(byId("because"), because(decision));
}

export function verdict({ object_id, confidence, source, runner_up, cached, basis, felt }) {
  if (object_id === TEST_TOUCH) return "You chose it above.";
  const next = runner_up ? `; next ${runner_up}` : "";
  const guess = basis === "least_error" ? `; felt as ${felt}` : "";
  const origin = cached ? "; from the cache" : "";
  return `${percent(confidence)} sure: ${RUNG_WORDS[source]}${next}${guess}${origin}`;
}

// Fills the two chips that say how it feels: warmth and vibration.
function fillFeel(decision) {
  const { contact_c, setpoint_c, thermal_cue, surface_c } = decision;
  const limited = contact_c != null && Math.abs(setpoint_c - contact_c) > MIN_DIFFERENCE_C ? `, the plate goes to ${degrees(setpoint_c)}` : "";
  const words = thermal_cue ? `feels ${warmthWord(setpoint_c)}: ${degrees(contact_c)} under the hand${limited}` : "no noticeable warmth or cold";
  byId("feel-warmth").style.setProperty("--now", warmthColour(thermal_cue ? setpoint_c : NEUTRAL_C));
  setText(byId("feel-warmth-words"), words);
  setText(byId("feel-surface"), `its surface is at ${degrees(surface_c)}`);
  gesture.about(decision);
}

function rungRow(index) {
  const rungs = byId("rungs");
  if (rungs.rows[index]) return rungs.rows[index];
  const row = rungs.insertRow();
  row.append(make("th", RUNGS[index], { scope: "row" }));
  row.insertCell();
  row.insertCell();
  return row;
}

// Rungs after the first that was sure enough are not needed.
const isNeeded = (rung, source) => RUNGS.indexOf(rung) < RUNGS.indexOf(source) || !RUNGS.includes(source);

function fillRung(row, rung, { source, evidence = [] }) {
  const items = evidence.filter((item) => item.rung === rung);
  row.className = rung === source ? "source" : "";
  const silence = isNeeded(rung, source) ? "none" : "not needed";
  const key = JSON.stringify([silence, ...items.map(({ material, confidence }) => [material, percent(confidence)])]);
  if (row.dataset.shown === key) return;
  row.dataset.shown = key;
  setText(row.cells[1], items.length ? items.map((item) => item.material).join(", ") : silence);
  row.cells[2].replaceChildren(...items.flatMap((item) => bar(item)));
}

function bar({ rung, material, confidence }) {
  const meter = make("meter", percent(confidence), { min: 0, max: 1, value: confidence });
  meter.ariaLabel = `${rung}: ${material}`;
  return [meter, ` ${percent(confidence)} `];
}

function because(decision) {
  return [
    ...(decision.sub_material ? [["made of", decision.sub_material]] : []),
    ...(decision.thickness_m ? [["thickness", `${Number((1e3 * decision.thickness_m).toPrecision(2))} mm`]] : []),
    ["ambient", within(decision, "ambient", AMBIENT_WORDS)],
    ["surface", within(decision, "surface", SURFACE_WORDS)],
    ["surface, reason", decision.surface_why || "not stated"],
    ["contact", decision.contact_c == null ? "no contact temperature" : degrees(decision.contact_c)],
    ["setpoint", setpoint(decision)],
    ["thermal cue", decision.thermal_cue ? "noticeable" : "none: too small to feel"],
    ["vibration, at the first touch", decision.pattern ?? "none"],
    ...(decision.felt ? [["felt as", decision.felt]] : []),
    ...(BASIS_WORDS[decision.basis] ? [["basis", BASIS_WORDS[decision.basis]]] : []),
    ["age of the frame", decision.frame_age_ms == null ? "no frame" : `${decision.frame_age_ms.toFixed(0)} ms`],
  ];
}

function within(decision, quantity, words) {
  const [low, high] = [decision[`${quantity}_low_c`], decision[`${quantity}_high_c`]];
  const range = `${low.toFixed(1)} to ${high.toFixed(1)}`;
  const source = decision[`${quantity}_source`];
  return `${degrees(decision[`${quantity}_c`])} (${range}), from ${words[source] ?? source}`;
}

function setpoint({ setpoint_c, unlimited_c, limited_by }) {
  if (!limited_by) return degrees(setpoint_c);
  return `${degrees(setpoint_c)}, limited by ${LIMIT_WORDS[limited_by] ?? limited_by}; without limits ${degrees(unlimited_c)}`;
}
