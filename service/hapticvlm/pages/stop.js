// The stop: one button and the Escape key. It says what became of it, above all when nothing did.
import { byId, clock, say } from "./dom.js";
import { sound } from "./hear.js";

const BY_HAND = "switch the devices off by hand";

// `whenDone` is called after the service has answered.
export function offerStop(link, whenDone) {
  const stop = async () => {
    sound.silence();
    say(byId("stopped"), "Stopping.");
    const answer = await link.ask({ type: "stop", scope: "all" });
    say(byId("stopped"), outcome(answer));
    whenDone();
  };
  byId("stop").addEventListener("click", stop);
  const onKey = (event) => {
    if (event.key === "Escape" && !event.repeat) stop();
  };
  document.addEventListener("keydown", onKey, { capture: true });
}

// `held`: the outputs that a stop keeps at rest, for each hand, as the status names them.
export function showHeld(held) {
  const said = byId("stopped");
  const hands = Object.keys(held).filter((hand) => held[hand].length);
  const isStopped = said.textContent.startsWith("Stopped") && hands.length === Object.keys(held).length;
  const isTrouble = said.textContent && !/^(Stopped|Held)/.test(said.textContent);
  if (isStopped || isTrouble) return;
  say(said, hands.length ? sentence(hands, held) : "");
}

function sentence(hands, held) {
  const names = hands.map((hand) => `${hand} hand (${held[hand].join(", ")})`);
  return `Held at rest: ${names.join(", ")}; until the scene releases and touches anew.`;
}

function outcome(answer) {
  switch (answer.type) {
    case "ok":
      return `Stopped at ${clock()}. The vibration has ended and the plate is off until the scene releases and touches anew.`;
    case "unsent":
      return `NOT STOPPED: no connection to the service; ${BY_HAND}.`;
    case "error":
      return `NOT STOPPED: ${answer.text}; ${BY_HAND}.`;
    default:
      return `NOT CONFIRMED: the service did not answer the stop; ${BY_HAND}.`;
  }
}
