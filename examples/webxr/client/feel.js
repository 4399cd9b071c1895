/**
 * Opens a feel file of `hapticvlm bake`: checks it by its schema. A foreign or damaged file is refused with the field that is
 * wrong. The limits of the schema leave no figure that could make a player loop for ever or a motor too strong.
 */
import SCHEMA from './feel.schema.js';
import {IMPACTS} from './voices.js';

const TYPES = {object: (value) => value !== null && typeof value === 'object' && !Array.isArray(value), array: Array.isArray, integer: Number.isInteger};
const BASE64 = /^(?:[A-Za-z0-9+/]{4})*(?:[A-Za-z0-9+/]{2}==|[A-Za-z0-9+/]{3}=)?$/;

/** Opens the parsed contents of `feel.true.json` or `feel.sound.json`. Throws an Error that names the first field that is wrong. */
export function openFeel(file) {
  checkFile(file, SCHEMA);
  if (!['left', 'right'].every((name) => file.words.hand.includes(name))) refuse('words.hand', 'lacks left or right');
  for (const [name, facts] of Object.entries(file.materials)) {
    const mixed = IMPACTS.find((kind) => new Set(facts[kind].clips.map((clip) => file.clips[clip].rate_hz)).size > 1);
    if (mixed) refuse(`materials.${name}.${mixed}.clips`, 'have several rates');
  }
  const [materials, levels, clips, loops] = ['materials', 'levels', 'clips', 'loops'].map((part) => new Map(Object.entries(file[part])));
  return {...file, materials, levels, clips, loops};
}

/** Throws an Error that names the first field in which a file is not as its schema has it. */
export function checkFile(file, schema) {
  const fault = faultOf(file, schema, schema.$defs, file);
  if (fault) refuse(fault.path.join('.') || 'the file', fault.problem);
}

/** Returns what is wrong with a value or with what it contains, as {path, problem}; null: it is as the schema has it. */
function faultOf(value, part, defs, file) {
  if (value === null && part.anyOf) return null;
  let schema = part.anyOf?.find(({type}) => type !== 'null') ?? part;
  if (schema.$ref) schema = defs[schema.$ref.split('/').at(-1)];
  const problem = problemOf(value, schema, file);
  if (problem) return {path: [], problem};
  const {type, properties, prefixItems, items, additionalProperties: others, required = []} = schema;
  if (type !== 'object' && type !== 'array') return null;
  for (const key of type === 'array' ? value.keys() : properties ? Object.keys(properties) : [...required, ...Object.keys(value)]) {
    const isThere = type === 'array' || Object.hasOwn(value, key);
    const absent = required.includes(key) ? {path: [], problem: 'is missing'} : null;
    const fault = isThere ? faultOf(value[key], type === 'array' ? (prefixItems?.[key] ?? items) : (properties?.[key] ?? others), defs, file) : absent;
    if (fault) return {path: [key, ...fault.path], problem: fault.problem};
  }
  return schema.rises && value.some((each, at) => each <= value[at - 1]) ? {path: [], problem: 'does not rise'} : null;
}

/** Returns what is wrong with a value itself. */
function problemOf(value, schema, file) {
  const {type, minimum = -1e9, maximum = 1e9} = schema;
  if (!(TYPES[type]?.(value) ?? typeof value === type)) return `is not of type ${type}`;
  if (typeof value === 'number') return value >= minimum && value <= maximum ? '' : `${value} is not ${minimum} to ${maximum}`;
  const {pattern, minLength = 0, minItems = minLength, maxItems = 1e9} = schema;
  if (type !== 'object' && !(value.length >= minItems && value.length <= maxItems)) return `has ${value.length} entries, not ${minItems} or more`;
  if (schema.in && !Object.hasOwn(file[schema.in], value)) return `${schema.in} has no "${value}"`;
  if (schema.contentEncoding && !BASE64.test(value)) return 'is not base64';
  return pattern && !new RegExp(pattern).test(value) ? `"${value}" does not match ${pattern}` : '';
}

function refuse(field, problem) {
  throw new Error(`${field}: ${problem}; bake it again`);
}
