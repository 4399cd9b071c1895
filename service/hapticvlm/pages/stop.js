// The stop: one button and the Escape key. It shows the outcome, above all a failure.
import { byId, clock, setText } from "./dom.js";
import { sound } from "./hear.js";

const BY_HAND = "switch the devices off by hand";

let answeredAt = -Infinity; // of the newest stop, on performance.now()'s clock

// `whenDone` is called after the service has answered.
export function offerStop(link, whenDone) {
  const stop = async () => {
    sound.silence();
    setText(byId("stopped"), "Stopping.");
    const answer = await link.ask({ type: "stop", scope: "all" });
    answeredAt = performance.now();
    setText(byId("stopped"), outcome(answer));
    whenDone();
  };
  byId("stop").addEventListener("click", stop);
  const onKey = (event) => {
    if (event.key === "Escape" && !event.repeat) stop();
  };
  document.addEventListener("keydown", onKey, { capture: true });
}

// `held`: the outputs that a stop keeps at rest, for each hand, as the status names them. A status
// that was asked for before the newest stop was answered knows nothing of it and changes no words.
export function showHeld(held, askedAt) {
  if (askedAt < answeredAt) return;
  const message = byId("stopped");
  const hands = Object.keys(held).filter((hand) => held[hand].length);
  const isStopped = message.textContent.startsWith("Stopped") && hands.length === Object.keys(held).length;
  const isTrouble = message.textContent && !/^(Stopped|Held)/.test(message.textContent);
  if (isStopped || isTrouble) return;
  setText(message, hands.length ? sentence(hands, held) : "");
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
