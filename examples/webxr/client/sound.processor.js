/** Renders the touches of `FeltSound` in the browser's audio thread. */
import {FeelPlayer} from './player.js';

class Felt extends AudioWorkletProcessor {
  #player;
  #isOpen = true;

  constructor({processorOptions: {feel}}) {
    super();
    this.#player = new FeelPlayer(feel, ({felt}) => felt, {soundHz: sampleRate});
    this.port.onmessage = ({data}) => {
      if (data.touch) this.#player.touch(data.touch, currentTime);
      else if (data.stop) this.#player.stop();
      else this.#isOpen = false;
    };
  }

  process(_inputs, [[channel]]) {
    channel.set(this.#player.render(channel.length, currentTime));
    return this.#isOpen;
  }
}

registerProcessor('hapticvlm-felt', Felt);
