/**
 * Links that open at a moment, such as `#kettle/strike` or `#glass/slide?speed=0.4&force=2`: what is touched, the gesture, and
 * its highest speed (m/s) and force (N) where they are not the usual ones. Independent of the page.
 *
 * Browsers allow neither sound nor vibration before a key or a tap, so a page that is opened by a link waits for one.
 */
const EVERY_MS = 30; // between two touches of a gesture
const LIMITS = {speed: [20, 'm/s'], force: [200, 'N']}; // of the protocol
/** Of each gesture: how long it lasts, s, its usual speed and force, and its touch at a time, s. */
const GESTURES = {
  tap: {lasts: 0.3, speed: 0.25, force: 1.5, touchAt: contact},
  strike: {lasts: 0.4, speed: 0.8, force: 4, touchAt: contact},
  press: {lasts: 1, speed: 0.1, force: 12, touchAt: (at, speed, force) => contact(at, speed, force * Math.min(1, 0.1 + 0.9 * at))},
  slide: {lasts: 1.4, speed: 0.3, force: 1.5, touchAt: stroke},
  carve: {lasts: 1.4, speed: 0.2, force: 6, touchAt: stroke},
  swing: {lasts: 1, speed: 5, force: 0, touchAt: (at, speed) => ({phase: 'approach', speed_mps: speed * Math.sin(Math.PI * Math.min(at, 1)), force_n: 0})},
};
export const KINDS = Object.keys(GESTURES);

/**
 * Returns the moment of an address's fragment: {target, kind, speed, force}; null without a fragment. Without a gesture
 * it is a strike. Throws Error, in a sentence for the reader, for what is not one of `targets` or not a gesture or number.
 */
export function readMoment(hash, targets) {
  if (hash.length < 2) return null;
  const [path, query] = decoded(hash.slice(1)).split('?');
  const [target, kind = 'strike', ...rest] = path.split('/');
  if (!targets.includes(target)) throw new Error(`The link opens at "${target}", which is not here. Choose one of ${listed(targets)}.`);
  if (!KINDS.includes(kind) || rest.length) throw new Error(`The link has the gesture "${[kind, ...rest].join('/')}". Choose one of ${listed(KINDS)}.`);
  const {speed, force} = GESTURES[kind];
  const moment = {target, kind, speed, force};
  for (const [name, value] of new URLSearchParams(query)) moment[name] = number(name, value);
  return moment;
}

/** Returns the fragment of a moment; it has speed and force where they are not the usual ones. */
export function writeMoment({target, kind, speed, force}) {
  const usual = GESTURES[kind];
  const parts = Object.entries({speed, force}).filter(([name, value]) => value !== usual[name]);
  const query = parts.map(([name, value]) => `${name}=${Number(value.toFixed(2))}`).join('&');
  return `#${encodeURIComponent(target)}/${kind}${query && `?${query}`}`;
}

/** Sends the touches of a moment until it is over, the release last, then calls `over`. Returns a function that ends it early. */
export function playMoment({kind, speed, force}, send, over) {
  const {lasts, touchAt} = GESTURES[kind];
  const from = performance.now();
  const end = () => {
    clearInterval(timer);
    send({phase: 'release', speed_mps: 0, force_n: 0});
    over();
  };
  const step = () => {
    const at = (performance.now() - from) / 1000;
    if (at > lasts) end();
    else send({interaction: kind, ...touchAt(at, speed, force)});
  };
  const timer = setInterval(step, EVERY_MS);
  step();
  return end;
}

function contact(_at, speed, force) {
  return {phase: 'contact', speed_mps: speed, force_n: force};
}

/** A hand that moves to and fro. */
function stroke(at, speed, force) {
  return {phase: at > 0.01 ? 'slide' : 'contact', speed_mps: speed * Math.abs(Math.sin(Math.PI * (at / 0.7))), force_n: force};
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    throw new Error(`The link ends with "${text}", which is not a name in an address.`);
  }
}

function number(name, text) {
  if (!(name in LIMITS)) throw new Error(`The link has "${name}". It can have speed and force.`);
  const [most, unit] = LIMITS[name];
  const value = text.trim() === '' ? NaN : Number(text);
  if (!(value >= 0 && value <= most)) throw new Error(`The link has the ${name} "${text}". It must be a number from 0 to ${most} (${unit}).`);
  return value;
}

const listed = (names) => `${names.slice(0, -1).join(', ')} or ${names.at(-1)}`;
