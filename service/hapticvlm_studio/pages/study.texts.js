// Holds the texts of the study page in the participant's language. All of them come from the study.

let languages = {};
let language = null;

export const spoken = () => language;
export const known = () => Object.keys(languages);
export const nameOf = (code) => languages[code].language;

export function learn(texts) {
  languages = texts;
  language ??= Object.keys(texts)[0];
  fill();
}

export function speak(code) {
  if (!code || code === language) return;
  language = code;
  fill();
}

// Returns a text by its path in the language file, such as "buttons.stop", with {words} filled in.
export function text(path, words = {}) {
  const [table, key] = path.split(".");
  return filled(languages[language]?.[table]?.[key] ?? "", words);
}

// Returns the heading of a phase and the line below it; in a pilot by ear (`heard`) that of hearing.
export function phase(name, words = {}, heard = false) {
  const { phases = {}, heard: instead = {} } = languages[language] ?? {};
  return ((heard && instead[name]) || phases[name] || ["", ""]).map((each) => filled(each, words));
}

// Returns the name of a vibration or temperature: the study's own, else that of the language file.
export function word(name, form) {
  return form?.names?.[language]?.[name] ?? languages[language]?.names?.[name] ?? name;
}

// Returns one of the study's own texts, which are given by language.
export const own = (texts, words = {}) => filled(texts?.[language] ?? "", words);

function fill() {
  document.documentElement.lang = language;
  for (const element of document.querySelectorAll("[data-text]")) element.textContent = text(element.dataset.text);
}

function filled(template, words) {
  return template.replace(/\{(\w+)\}/g, (whole, name) => words[name] ?? whole);
}
