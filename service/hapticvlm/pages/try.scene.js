// Acts as a scene of the service: sends pictures, touches the region under the hand, and stores the answers.
//
// A still picture is one object until the user points at it, and stays one if the user then states its
// material. Once pointed at, it is patches, each a separate object; on a picture that ships, it is the things that we have
// outlined and labelled. The decision about a patch is stored, so that a returning hand feels it at once, and a slide to the
// next patch is not felt as an impact. A part of an object carries less information than the whole. So a patch whose best
// guess is the material of the whole picture is also sent with the whole picture, and the service fuses both. A whole picture of a
// thing on a plain ground is sent with the thing's outline as a mask, too, and the service averages both. A live picture
// changes under the hand, so there the hand's region itself is touched, and every newer frame is sent.
import { Link } from "./link.js";
import { hand, region, speed } from "./try.hand.js";
import { pack } from "./try.packing.js";
import { thingAt } from "./try.things.js";

const TICK_MS = 50; // a lease lasts 250 ms
const WHOLE = { x: 0, y: 0, w: 1, h: 1 };
const CELLS = 2; // patches per side of the region: half a region away is another patch
const FORCE_N = { light: 1.5, most: 6 }; // a pen reports its pressure, a mouse does not

export class TryScene {
  #link;
  #picture = null;
  #target = null; // target of the last tick
  #pressed = false;
  #presses = 0; // of the hand, at the last tick
  #isLooking = false;
  #wanted = null;
  #among = null;
  #one = null; // id of the picture that was stated to be of one material
  #stated = null; // target of the last statement
  #known = new Set(); // ids of targets whose pictures have all been answered
  decisions = new Map(); // by object id; "" is a live region
  owner = false;
  isSimulated = false; // no real device is driven

  constructor(url, token, { onDecision, onState, onMessage }) {
    this.onDecision = onDecision;
    this.#link = new Link(url, {
      token, role: "scene", name: "try page", onState,
      onMessage: (message) => this.#receive(message, onMessage),
    });
    this.#link.connect();
    setInterval(() => this.#tick(), TICK_MS);
  }

  get link() { return this.#link; }

  // Restricts the materials of the scene to a list; null allows all. Fewer are distinguished more reliably.
  among(materials) {
    this.#among = materials;
    this.#forget();
    this.#want();
  }

  // Returns the outline of a thing on a plain ground, a PNG; null if there is none.
  get thing() { return this.#picture?.thing ?? null; }

  #forget() {
    this.decisions.clear();
    this.#known.clear();
    this.#one = null;
    const among = this.#among ? { materials: this.#among } : {};
    const objects = (this.#picture?.things ?? []).map(({ name, material }) => ({ object_id: this.#idOf(name), name, material }));
    return this.#link.ask({ type: "scene", objects, replace: true, ...among });
  }

  // Shows another picture and drops all decisions about the old one.
  show(picture) {
    const isOther = !picture.live || !this.#picture?.live;
    this.#picture = picture;
    if (isOther) {
      hand.pointed = false;
      this.#forget();
    }
    this.#want();
  }

  #idOf(name) { return `picture ${this.#picture.number} ${name}`; }

  // Returns the region under the hand: {id, region, thing?}; id is null for a live picture, `thing` is one that we labelled.
  target() {
    if (!this.#picture) return null;
    if (this.#picture.live) return { id: null, region: hand.pointed ? region(this.#picture.canvas) : WHOLE };
    const whole = this.#whole();
    if (!hand.pointed || this.#one === whole.id) return whole;
    const thing = thingAt(this.#picture.things, hand);
    return thing ? { id: this.#idOf(thing.name), region: thing.region, thing } : this.#patch(hand);
  }

  #patch(place) {
    const spot = region(this.#picture.canvas, place);
    const column = Math.round((CELLS * place.x) / spot.w);
    const row = Math.round((CELLS * place.y) / spot.h);
    return { id: `patch ${this.#picture.number} ${column} ${row} ${spot.w.toFixed(2)}`, region: spot };
  }

  // Returns whether the user has stated what is under the hand, also against our label.
  get isCorrected() { return this.#stated?.id === this.target()?.id; }

  // Returns whether the whole picture has been stated to be of one material.
  get isStated() { return this.#one !== null; }

  #whole() { return { id: `picture ${this.#picture.number}`, region: WHOLE }; }

  get isWhole() { return this.target()?.region === WHOLE; }

  decision() {
    const target = this.target();
    return target ? (this.decisions.get(target.id ?? "") ?? null) : null;
  }

  take() { return this.#link.ask({ type: "set", ownership: "take" }); }

  // States the material under the hand; resolves with the service's answer.
  async state(material) {
    const target = this.target();
    const before = [this.#one, this.#stated];
    if (target.region === WHOLE) this.#one = target.id;
    this.#stated = target;
    const answer = await this.#declare({ object_id: target.id, material }, target);
    if (answer.type === "ok") this.#known.add(target.id);
    else [this.#one, this.#stated] = before;
    return answer;
  }

  // Takes the last statement back, so that its target is recognised again.
  async unstate() {
    const target = this.#stated;
    if (this.#one === target.id) this.#one = null;
    this.#stated = null;
    if (target.thing) return this.#declare({ object_id: target.id, material: target.thing.material }, target);
    this.#known.delete(target.id);
    return this.#declare({ object_id: target.id }, target);
  }

  // Declares an object. Nothing touches it at the moment, so sending its picture once more requests the new decision.
  async #declare(object, target) {
    const answer = await this.#link.ask({ type: "scene", objects: [object], replace: false });
    if (answer.type !== "ok") return answer;
    let looked = await this.#look(target);
    // A picture of another region may have superseded this one, which is then sent again.
    while (looked.type === "skipped" && looked.reason === "superseded") looked = await this.#look(target);
    if (looked.type === "decision") this.#decided(looked);
    return answer;
  }

  moved() { this.#want(); }

  // A stop holds each hand until its next release, also one that touches nothing: the next tick sends it.
  stopped() { this.#pressed = true; }

  #receive(message, onMessage) {
    if (message.type === "welcome") {
      this.owner = message.owner;
      this.isSimulated = message.devices.speaker.simulated && message.devices.peltier.simulated;
      this.#forget();
      this.stopped(); // a visitor before may have left while a stop held the hand
      this.#link.ask({ type: "set", feel: { right: "amplitude" } });
      this.#isLooking = false;
      this.#want();
    } else if (message.type === "ownership") this.owner = message.owner;
    else if (message.type === "decision" && message.evidence.length) this.#decided(message); // without, its picture is not recognised yet
    onMessage(message);
  }

  #decided(decision) {
    this.decisions.set(decision.object_id ?? "", decision);
    this.onDecision(decision);
  }

  // Requests a decision about the region under the hand if there is none; the newest request waits for the current one.
  #want() {
    const target = this.target();
    const isOn = hand.over || !hand.pointed;
    if (target && isOn && !this.#known.has(target.id)) this.#wanted = target;
    this.#pump();
  }

  async #pump() {
    if (this.#isLooking) return;
    if (!this.#wanted || this.#known.has(this.#wanted.id)) return; // a tick requests the target that is being looked at, too
    const target = this.#wanted;
    this.#wanted = null;
    this.#isLooking = true;
    let answer = null;
    for (const shown of this.#looks(target)) {
      answer = await this.#look(shown);
      if (answer.type === "decision") this.#decided(answer);
      else if (answer.reason !== "unchanged") break; // superseded: the target is requested again
    }
    const isAnswered = answer.type === "decision" || answer.reason === "unchanged";
    if (target.id && isAnswered) this.#known.add(target.id); // a live target is never known
    this.#isLooking = false;
    this.#pump();
  }

  // Yields the pictures needed for a target, one after the other, as the next depends on the last decision. The
  // whole picture comes before its patches.
  *#looks(target) {
    const isPatch = target.id && target.region !== WHOLE;
    const whole = this.#whole();
    if (isPatch && !this.decisions.has(whole.id)) yield* this.#views(whole);
    yield* this.#views(target);
    const guess = this.decisions.get(target.id);
    if (isPatch && guess?.material === "unknown" && guess.runner_up === this.decisions.get(whole.id)?.material) yield { ...target, region: WHOLE };
  }

  *#views(target) {
    yield target;
    if (target.region === WHOLE && this.thing) yield { ...target, mask: this.thing };
  }

  #look({ id, region: spot, mask }) {
    const { canvas, jpeg } = this.#picture;
    const shape = { format: "jpeg", width: canvas.width, height: canvas.height, origin: "top", purpose: "live" };
    const fields = { type: "frame", captured_at: performance.now() / 1000, image: jpeg, ...(mask ? { mask } : { region: spot }), ...shape };
    return this.#link.ask(id ? { ...fields, object_id: id } : fields, pack);
  }

  #tick() {
    const target = this.target();
    if (!target || this.#link.state !== "open") return;
    if (target.id || !this.decision()) this.#want(); // an earlier picture may have been superseded, and a screen stands still
    if (!this.owner || (hand.isShown && !this.isSimulated)) return;
    // A press or a release between two ticks is sent, too: a quick tap is felt, and a new press after a stop is a new touch.
    const isNew = hand.presses !== this.#presses;
    const isPressed = hand.pressed || isNew;
    const fields = {
      type: "touch", hand: "right", captured_at: performance.now() / 1000, speed_mps: Math.min(20, speed()),
      force_n: isPressed ? Math.max(FORCE_N.light, FORCE_N.most * hand.pressure) : 0,
      ...(target.id ? { object_id: target.id } : { region: target.region }),
    };
    const isOther = target.id !== this.#target?.id;
    if (isNew && this.#pressed) {
      this.#touch({ ...fields, force_n: 0 }, "release");
      this.#pressed = false;
    }
    if (isPressed) this.#touch(fields, this.#pressed ? (speed() || isOther ? "slide" : "contact") : "contact");
    else if (this.#pressed || (!hand.over && this.#target)) this.#touch({ ...fields, force_n: 0 }, "release");
    else if (hand.over) this.#touch({ ...fields, force_n: 0 }, "approach");
    this.#pressed = isPressed;
    this.#presses = hand.presses;
    this.#target = hand.over || isPressed ? target : null;
  }

  async #touch(fields, phase) {
    if (phase === "contact" && !this.#pressed) fields = { ...fields, speed_mps: Math.max(0.3, fields.speed_mps), interaction: "tap" };
    await this.#link.ask({ ...fields, phase });
  }
}
