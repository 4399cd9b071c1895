export {Haptics} from './haptics.js';
export {Pulses} from './pulses.js';
