export {Haptics} from './haptics.js';
export {Hands} from './hands.js';
export {Pulses} from './pulses.js';
export {surfaceAt, surfacesOf} from './surfaces.js';
export {Textures} from './textures.js';
export {FeelPlayer, openFeel} from './feel.js';
export {Bake} from './bake.js';
export {Felt} from './felt.js';
export {FeltSound} from './sound.js';
