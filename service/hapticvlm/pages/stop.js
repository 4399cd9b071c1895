// The stop: one button and the Escape key. It shows the outcome, above all a failure.
import { byId, clock, setText } from "./dom.js";
import { sound } from "./hear.js";

const BY_HAND = "switch the devices off by hand";
const GO_ON = "Nothing vibrates and the plate is off. Let go and touch again to go on.";

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

// `held`: the outputs that a stop keeps at rest, for each hand, as the status names them. The banner
// stays until the first hand goes on, and where somebody else stopped it is shown only while a scene
// owns the outputs: without one there is nobody to let go. A status that was asked for before the
// newest stop was answered knows nothing of it and changes no words.
export function showHeld({ held, owner }, askedAt) {
  if (askedAt < answeredAt) return;
  const message = byId("stopped");
  if (message.textContent.startsWith("NOT ")) return;
  if (!isHeld(held)) setText(message, "");
  else if (!message.textContent && owner) setText(message, `Stopped. ${GO_ON}`);
}

const isHeld = (held) => Object.values(held).every((outputs) => outputs.length > 0);

function outcome(answer) {
  switch (answer.type) {
    case "ok":
      return `Stopped at ${clock()}. ${GO_ON}`;
    case "unsent":
      return `NOT STOPPED: no connection to the service; ${BY_HAND}.`;
    case "error":
      return `NOT STOPPED: ${answer.text}; ${BY_HAND}.`;
    default:
      return `NOT CONFIRMED: the service did not answer the stop; ${BY_HAND}.`;
  }
}
