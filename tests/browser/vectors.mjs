/** Holds the browser's codec against messages another implementation wrote; prints one JSON line. */
import {deepStrictEqual, strictEqual} from 'node:assert';
import {readFileSync} from 'node:fs';

const [codec, fuzzed] = process.argv.slice(2);
const {Float, MessagePackError, decode, encode} = await import(codec);
const {documents, seed} = JSON.parse(readFileSync(0, 'utf8'));

for (const {name, msgpack, value} of documents) {
  const bytes = new Uint8Array(Buffer.from(msgpack, 'hex'));
  strictEqual(hex(encode(typed(value))), msgpack, `${name}: encoded`);
  deepStrictEqual(decode(bytes, {keepFloats: true}), typed(value), `${name}: decoded`);
  deepStrictEqual(decode(bytes), plain(typed(value)), `${name}: decoded to plain numbers`);
}
for (const [number, written] of [[-0, 'cb8000000000000000'], [0.5, 'cb3fe0000000000000'], [7, '07']]) {
  strictEqual(hex(encode(number)), written, `${number}: a plain number`);
}
console.log(JSON.stringify({documents: documents.length, ...fuzz(Number(fuzzed))}));

/** What a document says in JSON: {"$float": "1.0"} and {"$bin": "00ff"} are not JSON's own. */
function typed(value) {
  if (Array.isArray(value)) return value.map(typed);
  if (value === null || typeof value !== 'object') return value;
  if ('$float' in value) return new Float(Number(value.$float));
  if ('$bin' in value) return new Uint8Array(Buffer.from(value.$bin, 'hex'));
  return Object.fromEntries(Object.entries(value).map(([name, part]) => [name, typed(part)]));
}

function plain(value) {
  if (value instanceof Float) return value.value;
  if (Array.isArray(value)) return value.map(plain);
  if (value === null || typeof value !== 'object' || value instanceof Uint8Array) return value;
  return Object.fromEntries(Object.entries(value).map(([name, part]) => [name, plain(part)]));
}

/** Damaged and random bytes: each is decoded, or refused with the codec's own error. */
function fuzz(count) {
  const random = sequence(seed);
  const found = {inputs: count, decoded: 0, refused: 0};
  for (let i = 0; i < count; i++) {
    const input = i % 4 ? damaged(documents, random) : noise(random);
    try {
      decode(input);
      found.decoded++;
    } catch (error) {
      if (!(error instanceof MessagePackError)) throw new Error(`${hex(input)}: ${error}`);
      found.refused++;
    }
  }
  return found;
}

function damaged(whole, random) {
  const bytes = Buffer.from(whole[below(random, whole.length)].msgpack, 'hex');
  for (let i = below(random, 4); i >= 0; i--) bytes[below(random, bytes.length)] = below(random, 256);
  return new Uint8Array(bytes.subarray(0, random() < 0.2 ? below(random, bytes.length) : bytes.length));
}

function noise(random) {
  return Uint8Array.from({length: below(random, 40)}, () => below(random, 256));
}

function hex(bytes) {
  return Buffer.from(bytes).toString('hex');
}

function below(random, end) {
  return Math.floor(random() * end);
}

/** Numbers 0..1 from a seed (mulberry32). */
function sequence(state) {
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}
