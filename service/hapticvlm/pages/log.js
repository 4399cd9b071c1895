// Shows the newest lines of the service's log.
import { byId, clock, eachFrame, make } from "./dom.js";

const MAX_LINES = 200;
const MAX_CHARACTERS = 500;
const waiting = [];
const paintSoon = eachFrame(paint);

export function take({ text }) {
  waiting.push(`${clock()} ${text.slice(0, MAX_CHARACTERS)}`);
  if (waiting.length > MAX_LINES) waiting.shift();
  paintSoon();
}

function paint() {
  const log = byId("log");
  log.append(...waiting.splice(0).map((line) => make("div", line)));
  while (log.children.length > MAX_LINES) log.firstElementChild.remove();
  if (byId("follow-log").checked) log.scrollTop = log.scrollHeight;
}
