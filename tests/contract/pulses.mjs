/** What a motor is told of plans, picture by picture, on a clock of our own; as one JSON object. */
let now = 0;
Object.defineProperty(globalThis, 'performance', {value: {now: () => now}});
const {Pulses} = await import('../../examples/webxr/client/pulses.js');

const [period_ms, hand, handedness] = [12.5, 'left', 'left'];

/** Plays these plans one after the other, a picture each so many ms; what the motor was told. */
function play(pictures, plans, {gain = 1, gamepad} = {}) {
  const told = [];
  const motor = gamepad?.(told) ?? {hapticActuators: [{pulse: (amplitude) => told.push(amplitude)}]};
  const pulses = new Pulses();
  pulses.gain = gain;
  for (const amplitude of plans) pulses.receive({hand, period_ms, amplitude});
  for (const wait of pictures) {
    now += wait;
    pulses.play({handedness, gamepad: motor});
  }
  return told;
}

const rumble = (told) => ({vibrationActuator: {playEffect: (_, {strongMagnitude}) => told.push(strongMagnitude)}});
const refuses = () => ({vibrationActuator: {playEffect: () => Promise.reject(new Error('not supported'))}});
let escaped = 0;
process.on('unhandledRejection', () => escaped++);

/** Plays on a motor that refuses; how many rejections escaped, and the reason of the silence. */
async function refused() {
  const source = {handedness: 'left', gamepad: refuses()};
  const pulses = new Pulses();
  pulses.receive({hand, period_ms, amplitude: [0.5, 0.5]});
  now += 11;
  pulses.play(source);
  await new Promise((done) => setTimeout(done, 1));
  return [escaped, pulses.silence(source)];
}

/** Plays the plan of the left hand on a source of neither hand. */
function ofNoHand() {
  const told = [];
  const pulses = new Pulses();
  pulses.receive({hand, period_ms, amplitude: [0.5]});
  now += 11;
  pulses.play({handedness: 'none', gamepad: rumble(told)});
  return told;
}

/** Returns what a plan is worth after the service said who owns the outputs. */
function owned(owner) {
  const haptics = Object.assign(new EventTarget(), {feel() {}});
  const pulses = new Pulses();
  pulses.follow(haptics);
  for (const [type, detail] of Object.entries({vibration: {hand, period_ms, amplitude: [0.5]}, ownership: {owner}})) haptics.dispatchEvent(Object.assign(new Event(type), {detail}));
  return pulses.amplitude(hand);
}

console.log(JSON.stringify({
  'owned and lost': [owned(true), owned(false)],
  'a motor that refuses': await refused(),
  'of no hand': ofNoHand(),
  steady: play([11, 11, 11, 11], [[0.5, 0.5]]),
  'a strike between two pictures': play([50, 11], [[0.1, 0.8, 0.1]]),
  'an empty plan': play([11, 11], [[0.5, 0.5], undefined]),
  'a picture long after': play([1000, 11], [[0.5, 0.5]]),
  'too weak': play([11], [[0.01]]),
  'turned up': play([11], [[0.5]], {gain: 9}),
  'a gamepad': play([11], [[0.5]], {gamepad: rumble}),
}));
