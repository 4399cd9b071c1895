// Keeps the last touch of /try, to be saved.
import { byId } from "./dom.js";
import { MOST_S, save } from "./felt.saved.js";
import { OUT_HZ, SoundVoice } from "./sound.voice.js";

let moment = null; // {decision, region, canvas, samples, rateHz, isSlid, isCut}

// A hand touches `region` of a picture now. A contact begins a new moment.
export function touch({ decision, region, canvas, isContact, isSlide }) {
  if (isContact || !moment) moment = { samples: [], rateHz: 0, isSlid: false, isCut: false };
  Object.assign(moment, { decision: decision ?? moment.decision, region, canvas, isSlid: moment.isSlid || isSlide });
}

// Takes a piece of the vibration while a hand touches, or while it fades.
export function take({ samples, rate_hz: rateHz }) {
  if (!moment) return;
  moment.rateHz = rateHz;
  const isSilent = samples.every((sample) => sample === 0);
  if (isSilent && !moment.samples.length) return;
  moment.samples.push(...samples);
  const surplus = Math.max(0, moment.samples.length - MOST_S * rateHz);
  moment.samples.splice(0, surplus);
  moment.isCut ||= surplus > 0;
  byId("save").hidden = !moment.decision;
}

// Forgets it, as with another picture.
export function forget() {
  moment = null;
  byId("save").hidden = true;
}

export function offerSave() {
  byId("save").addEventListener("click", () => save(byId("saved"), last));
}

function last() {
  const { decision, region, canvas, samples, rateHz, isSlid, isCut } = moment;
  return {
    decision, samples, rateHz,
    interaction: isSlid ? "slide" : "tap",
    picture: { canvas, region },
    heard: new SoundVoice().render(samples), heardHz: OUT_HZ,
    note: isCut ? `It has the last ${MOST_S} s.` : "",
  };
}
