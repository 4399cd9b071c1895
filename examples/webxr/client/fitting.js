/** Makes objects fit the protocol's limits before they are sent, and names each part that did not. */
import {encode} from '@msgpack/msgpack';

const LONGEST_NAME = 256; // characters
const MOST = {stands_on: 16, surfaces: 64}; // entries of a list
const MOST_OBJECTS = 1024; // of one message; the protocol allows 4096
const MOST_BYTES = 1 << 20; // of one message; the protocol allows 4 MiB

/**
 * Returns an object as it is sent, and calls `say(path, text)` for each part that was changed. `materials` are those of
 * the service: an older one refuses the whole scene for another.
 */
export function fitted(object, materials, say) {
  const fits = {...object};
  const letters = typeof fits.name === 'string' ? [...(fits.name.toWellFormed?.() ?? fits.name)] : [];
  if (letters.length) fits.name = letters.slice(-LONGEST_NAME).join(''); // its end is the object's own name, the rest its parents'
  if (letters.length > LONGEST_NAME) say('name', `it has ${letters.length} characters and the limit is ${LONGEST_NAME}: cut; shorten it`);
  for (const [list, most] of Object.entries(MOST)) {
    if (!(fits[list]?.length > most)) continue;
    say(list, `it has ${fits[list].length} entries and the limit is ${most}: cut; shorten it`);
    fits[list] = fits[list].slice(0, most);
  }
  if (fits.material != null && fits.material !== 'unknown' && materials.length && !materials.includes(fits.material)) {
    say('material', `no material \`${fits.material}\`: left out; state one of ${materials.join(', ')}`);
    delete fits.material;
  }
  return fits;
}

/** Whether a value has fields. */
export const isObject = (value) => typeof value === 'object' && value !== null;

/** Returns a name or an id as a text; undefined: it is neither text nor number. */
export const textOf = (name) => (typeof name === 'string' || typeof name === 'number' ? `${name}` : undefined);

/** Whether a value is an object's id. */
export const isId = (value) => typeof value === 'string';

/** Returns the entries of a list of which `isFit` holds, or undefined if it is no list; `say(text)` gets what is left out. */
export function listed(list, isFit, say) {
  if (!isObject(list) || !list[Symbol.iterator]) return say('this is not a list: the call is refused');
  const all = [...list];
  const fit = all.filter(isFit);
  if (fit.length < all.length) say(`${all.length - fit.length} of ${all.length} entries are of a wrong type: left out`);
  return fit;
}

/** Splits objects into pieces that a message may have; there is at least one piece, which may be empty. `say(object, text)` gets what is left out. */
export function pieces(objects, say) {
  const all = [[]];
  let bytes = 0;
  for (const object of objects) {
    const size = encoded(object, (text) => say(object, text))?.length;
    if (!size) continue;
    if (all.at(-1).length >= MOST_OBJECTS || (bytes + size > MOST_BYTES && bytes)) {
      all.push([]);
      bytes = 0;
    }
    all.at(-1).push(object);
    bytes += size;
  }
  return all;
}

/** Returns a value as MessagePack, or undefined for one that cannot be sent, such as a node of the page's scene; `say(text)` gets why. */
export function encoded(value, say) {
  try {
    return encode(value, {ignoreUndefined: true});
  } catch ({message}) {
    say(`it cannot be sent (${message}): left out; state texts and numbers only`);
    return undefined;
  }
}
