// The stop button and the Escape key. Shows the outcome, above all a failure.
import { byId, clock, setText } from "./dom.js";
import { sound } from "./hear.js";

const BY_HAND = "switch the devices off by hand";
const CONTINUE = "Vibration and plate are off. Release and touch again to continue.";

let answeredAt = -Infinity; // time of the answer to the newest stop, by performance.now()

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

// `held`: the outputs of each hand that a stop holds, from the status. The banner
// stays until the first hand continues. After a stop by another client it is shown only while a scene
// owns the outputs, since otherwise no hand can release. A status requested before the
// answer to the newest stop does not include that stop and is ignored.
export function showHeld({ held, owner }, askedAt) {
  if (askedAt < answeredAt) return;
  const message = byId("stopped");
  if (message.textContent.startsWith("NOT ")) return;
  if (!isHeld(held)) setText(message, "");
  else if (!message.textContent && owner) setText(message, `Stopped. ${CONTINUE}`);
}

const isHeld = (held) => Object.values(held).every((outputs) => outputs.length > 0);

function outcome(answer) {
  switch (answer.type) {
    case "ok":
      return `Stopped at ${clock()}. ${CONTINUE}`;
    case "unsent":
      return `NOT STOPPED: no connection to the service; ${BY_HAND}.`;
    case "error":
      return `NOT STOPPED: ${answer.text}; ${BY_HAND}.`;
    default:
      return `NOT CONFIRMED: the service did not answer the stop; ${BY_HAND}.`;
  }
}
