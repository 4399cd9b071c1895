/** Holds the scene's codec against messages another implementation wrote; prints what it writes itself, one JSON line. */
import {deepStrictEqual} from 'node:assert';
import {readFileSync} from 'node:fs';

const {decode, encode} = await import(process.argv[2]);
const written = [];
for (const {name, msgpack, value} of JSON.parse(readFileSync(0, 'utf8'))) {
  const decoded = decode(new Uint8Array(Buffer.from(msgpack, 'hex')));
  deepStrictEqual(decoded, plain(value), `${name}: decoded`);
  written.push(Buffer.from(encode(decoded, {ignoreUndefined: true})).toString('hex'));
}
console.log(JSON.stringify(written));

/** What a document says in JSON, where {"$bin": "00ff"} is not JSON's own. */
function plain(value) {
  if (Array.isArray(value)) return value.map(plain);
  if (value === null || typeof value !== 'object') return value;
  if ('$bin' in value) return new Uint8Array(Buffer.from(value.$bin, 'hex'));
  return Object.fromEntries(Object.entries(value).map(([name, part]) => [name, plain(part)]));
}
