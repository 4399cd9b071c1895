/** Compiles the published JSON Schema in Ajv's default, strict mode; prints what it says of messages, as one JSON object. */
import {readFileSync} from 'node:fs';
import {Ajv} from 'ajv';

const check = new Ajv({logger: false}).compile(JSON.parse(readFileSync(process.argv[2])));
const touch = {type: 'touch', id: 3, phase: 'contact', object_id: 'a', hand: 'right', speed_mps: 0.3, force_n: 1.5, captured_at: 0};
console.log(JSON.stringify({touch: check(touch), typo: check({...touch, sped: 1})}));
