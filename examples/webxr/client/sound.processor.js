/** Renders the touches of `FeltSound` in the browser's audio thread. */
import {Heard} from './sound.heard.js';

class Felt extends AudioWorkletProcessor {
  #heard;
  #isOpen = true;

  constructor({processorOptions: {feel, voice}}) {
    super();
    this.#heard = new Heard(feel, sampleRate, voice);
    this.port.onmessage = ({data}) => {
      if (data.touch) this.#heard.touch(data.touch, currentTime);
      else if (data.voice) this.#heard.setVoice(data.voice, currentTime);
      else if (data.stop) this.#heard.stop();
      else this.#isOpen = false;
    };
  }

  process(_inputs, [[channel]]) {
    channel.set(this.#heard.render(channel.length, currentTime));
    return this.#isOpen;
  }
}

registerProcessor('hapticvlm-felt', Felt);
