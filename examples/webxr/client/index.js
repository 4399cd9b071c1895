export {Haptics} from './haptics.js';
export {Hands} from './hands.js';
export {Pulses} from './pulses.js';
export {surfaceAt, surfacesOf} from './surfaces.js';
export {Textures} from './textures.js';
