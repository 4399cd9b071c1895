// Plays the stream in the browser's audio thread.
import { StreamPlayer } from "./sound.stream.js";

class StreamNode extends AudioWorkletProcessor {
  #player = new StreamPlayer(sampleRate, (report) => this.port.postMessage(report));

  constructor() {
    super();
    this.port.onmessage = ({ data }) => this.#player.receive(data);
  }

  process(_inputs, [[output, ...others]]) {
    this.#player.fill(output, currentTime);
    for (const other of others) other.set(output);
    return true;
  }
}

registerProcessor("stream-player", StreamNode);
