// Draws the forms of a study: consent and language, questions, ratings. Knows nothing of the connection.
import { make } from "./dom.js";
import { known, nameOf, own, speak, spoken, text } from "./study.texts.js";

const MAX_NUMBER = 1e12; // of an answer, as in design/form.py

// Draws the form of a phase into `form`; calls `send` with the command once it is submitted.
export function draw(form, phase, view, study, send) {
  const parts = { consent: agreement, questions, rating: ratings }[phase](view, study, form);
  form.replaceChildren(...parts.shown, submit(phase));
  form.onsubmit = (event) => {
    event.preventDefault();
    if (form.reportValidity()) send(parts.request());
  };
}

function agreement(view, study, form) {
  const shown = [];
  if (known().length > 1) shown.push(choiceOf("language", text("page.language"), known().map((code) => ({ value: code, text: nameOf(code), lang: code })), spoken(), true));
  if (own(study.consent)) {
    const words = make(view.hear ? "details" : "div", "", { className: "prose" });
    words.append(...(view.hear ? [make("summary", text("page.study"))] : []), ...paragraphs(own(study.consent, view)));
    shown.push(words);
    const label = make("label", "", { className: "agree" });
    label.append(make("input", "", { type: "checkbox", name: "agreed", required: true }), " ", text("page.i_agree"));
    shown.push(label);
  }
  form.onchange = ({ target }) => {
    if (target.name !== "language") return;
    speak(target.value);
    form.dispatchEvent(new Event("language"));
  };
  return { shown, request: () => ({ do: "agree", language: spoken() }) };
}

function questions(view, study, form) {
  form.onchange = null;
  const open = study.question.filter((question) => question.when === view.questions);
  const request = () => ({ do: "tell", answers: Object.fromEntries(open.map((question) => [question.name, answerOf(form, question)])) });
  return { shown: open.map(field), request };
}

function ratings(view, study, form) {
  form.onchange = null;
  const request = () => ({ do: "rate", trial: view.to_rate, ratings: Object.fromEntries(study.rating.map(({ name }) => [name, Number(form.elements[name].value)])) });
  return { shown: study.rating.map(scale), request };
}

function field(question) {
  const needed = question.needed ? ` ${text("page.needed")}` : "";
  if (question.kind === "choice") {
    const none = question.needed ? [] : [{ value: "", text: text("page.no_answer") }];
    const choices = question.choice.map((each) => ({ value: each.value, text: own(each.text) }));
    return choiceOf(question.name, own(question.text) + needed, [...choices, ...none], question.needed ? null : "", question.needed);
  }
  const label = make("label", own(question.text) + needed, { className: "field" });
  const fields = { name: question.name, required: question.needed };
  if (question.kind === "number") {
    label.append(...numberField(question, fields));
  } else {
    label.append(make("textarea", "", { ...fields, maxLength: 2000, rows: 4 }));
  }
  return label;
}

// Returns a text field for a number, and the number that was understood beside it. A field of type number
// drops the comma in some browsers: 70,5 becomes 705.
function numberField({ low, high }, fields) {
  const input = make("input", "", { ...fields, type: "text", inputMode: "decimal", autocomplete: "off" });
  const understood = make("output");
  input.addEventListener("input", () => {
    const number = numberOf(input.value);
    const isFine = number !== null && number >= (low ?? -MAX_NUMBER) && number <= (high ?? MAX_NUMBER);
    const refusal = text("page.number", { low: low ?? -MAX_NUMBER, high: high ?? MAX_NUMBER });
    input.setCustomValidity(input.value.trim() === "" || isFine ? "" : refusal);
    understood.value = isFine ? `= ${number.toLocaleString(spoken(), { maximumFractionDigits: 20, useGrouping: false })}` : "";
  });
  return [input, understood];
}

// Reads a decimal number, with a comma or a point; null for anything else.
function numberOf(written) {
  const number = written.trim().replace(/^\u2212/, "-");
  return /^[+-]?(\d+([.,]\d*)?|[.,]\d+)$/.test(number) ? Number(number.replace(",", ".")) : null;
}

function answerOf(form, { name, kind }) {
  const value = form.elements[name].value.trim();
  if (value === "") return null;
  return kind === "number" ? numberOf(value) : value;
}

function scale(rating) {
  const steps = Array.from({ length: rating.steps }, (_, index) => ({ value: String(index + 1), text: String(index + 1) }));
  const set = choiceOf(rating.name, own(rating.text), steps, null, true);
  set.classList.add("scale");
  const ends = make("p", "", { className: "ends" });
  ends.append(make("span", own(rating.low)), make("span", own(rating.high)));
  set.append(ends);
  return set;
}

function choiceOf(name, legend, choices, chosen, required) {
  const set = make("fieldset");
  const row = make("div", "", { className: "choices" });
  set.append(make("legend", legend), row);
  for (const choice of choices) {
    const label = make("label", "", choice.lang ? { lang: choice.lang } : {});
    label.append(make("input", "", { type: "radio", name, value: choice.value, checked: choice.value === chosen, required }), make("span", choice.text));
    row.append(label);
  }
  return set;
}

export function paragraphs(whole) {
  return whole.trim().split(/\n\s*\n/).filter(Boolean).map((each) => make("p", each));
}

function submit(phase) {
  return make("button", text(phase === "consent" ? "buttons.agree" : "buttons.send"), { type: "submit", className: "main" });
}
