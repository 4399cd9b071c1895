// The words of the study page, in the language of the participant. They come from the study, none is here.

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

// `path` as in the language's file: "buttons.stop"; {words} are filled in.
export function text(path, words = {}) {
  const [table, key] = path.split(".");
  return filled(languages[language]?.[table]?.[key] ?? "", words);
}

// The heading of a phase and the line under it.
export function phase(name, words = {}) {
  return (languages[language]?.phases[name] ?? ["", ""]).map((each) => filled(each, words));
}

// A word of a pattern, as the study or else the language calls it.
export function word(name, form) {
  return form?.names?.[language]?.[name] ?? languages[language]?.names?.[name] ?? name;
}

// One of a study's own texts, which stand by language.
export const own = (texts) => texts?.[language] ?? "";

function fill() {
  document.documentElement.lang = language;
  for (const element of document.querySelectorAll("[data-text]")) element.textContent = text(element.dataset.text);
}

function filled(template, words) {
  return template.replace(/\{(\w+)\}/g, (whole, name) => words[name] ?? whole);
}
