/** Random numbers from a seed: the same seed draws the same room (mulberry32). */
export class Dice {
  #state;

  constructor(seed) {
    this.#state = seed >>> 0;
  }

  next() {
    this.#state = (this.#state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(this.#state ^ (this.#state >>> 15), this.#state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  }

  uniform = (low = 0, high = 1) => low + (high - low) * this.next();

  /** Uniform in the logarithm: 0.1 to 1 is as likely as 1 to 10. */
  spread = (low, high) => low * (high / low) ** this.next();

  chance = (share) => this.next() < share;
  integer = (low, high) => low + Math.floor(this.next() * (high - low + 1));
  pick = (list) => list[Math.floor(this.next() * list.length)];

  /** Another dice, so that what it decides does not shift what comes after. */
  fork = () => new Dice(Math.floor(this.next() * 4294967296));
}
