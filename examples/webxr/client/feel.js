/**
 * Opens a feel file of `hapticvlm bake`: checks it by its schema. A foreign or damaged file is refused with the field that is
 * wrong. The limits of the schema leave no figure that could make a player loop for ever or a motor too strong.
 */
import SCHEMA from './feel.schema.js';
import {IMPACTS, TEXTURES} from './voices.js';

const TYPES = {object: (value) => value !== null && typeof value === 'object' && !Array.isArray(value), array: Array.isArray, integer: Number.isInteger};
const BASE64 = /^(?:[A-Za-z0-9+/]{4})*(?:[A-Za-z0-9+/]{2}==|[A-Za-z0-9+/]{3}=)?$/;

/** Opens the parsed contents of `feel.true.json` or `feel.sound.json`. Throws an Error that names the first field that is wrong. */
export function openFeel(file) {
  checkFile(file, SCHEMA);
  for (const [name, axis] of [['speeds_mps', file.speeds_mps], ['forces_n', file.forces_n], ['rules.pad.hum_hz', file.rules.pad.hum_hz]]) {
    if (axis.some((value, at) => value <= axis[at - 1])) refuse(name, 'does not rise');
  }
  if (!['left', 'right'].every((name) => file.words.hand.includes(name))) refuse('words.hand', 'lacks left or right');
  for (const [name, facts] of Object.entries(file.materials)) checkNames(file, name, facts);
  for (const [name, {wave, hz, drive, felt, body}] of Object.entries(file.clips)) checkBase64(`clips.${name}`, {wave, hz, 'drive.bytes': drive.bytes, 'felt.bytes': felt.bytes, 'body.bytes': body?.bytes});
  for (const [name, {wave, drive}] of Object.entries(file.loops)) checkBase64(`loops.${name}`, {wave, 'drive.bytes': drive.bytes});
  const [materials, levels, clips, loops] = ['materials', 'levels', 'clips', 'loops'].map((part) => new Map(Object.entries(file[part])));
  return {...file, materials, levels, clips, loops};
}

/** Throws an Error that names the first field in which a file is not as its schema has it. */
export function checkFile(file, schema) {
  const fault = faultOf(file, schema, schema.$defs);
  if (fault) refuse(fault.path.join('.') || 'the file', fault.problem);
}

/** Returns what is wrong with a value or with what it contains, as {path, problem}; null: it is as the schema has it. */
function faultOf(value, part, defs) {
  if (value === null && part.anyOf) return null;
  let schema = part.anyOf?.find(({type}) => type !== 'null') ?? part;
  if (schema.$ref) schema = defs[schema.$ref.split('/').at(-1)];
  const problem = problemOf(value, schema);
  if (problem) return {path: [], problem};
  const {type, properties, prefixItems, items, additionalProperties: others, required = []} = schema;
  if (type !== 'object' && type !== 'array') return null;
  for (const key of type === 'array' ? value.keys() : properties ? Object.keys(properties) : [...required, ...Object.keys(value)]) {
    const isThere = type === 'array' || Object.hasOwn(value, key);
    const absent = required.includes(key) ? {path: [], problem: 'is missing'} : null;
    const fault = isThere ? faultOf(value[key], type === 'array' ? (prefixItems?.[key] ?? items) : (properties?.[key] ?? others), defs) : absent;
    if (fault) return {path: [key, ...fault.path], problem: fault.problem};
  }
  return null;
}

/** Returns what is wrong with a value itself. */
function problemOf(value, schema) {
  const {type, minimum = -1e9, maximum = 1e9} = schema;
  if (!(TYPES[type]?.(value) ?? typeof value === type)) return `is not of type ${type}`;
  if (typeof value === 'number') return value >= minimum && value <= maximum ? '' : `${value} is not ${minimum} to ${maximum}`;
  const {pattern, minLength = 0, minItems = minLength, maxItems = 1e9} = schema;
  if (type !== 'object' && !(value.length >= minItems && value.length <= maxItems)) return `has ${value.length} entries, not ${minItems} or more`;
  return pattern && !new RegExp(pattern).test(value) ? `"${value}" does not match ${pattern}` : '';
}

function checkNames(file, material, facts) {
  if (facts.swing.thickness_m == null) refuse(`materials.${material}.swing.thickness_m`, 'is null');
  const textures = TEXTURES.map((kind) => facts[kind]);
  const layers = textures.flatMap((texture) => texture.layers);
  const named = {
    clips: [facts.grain, facts.again, ...IMPACTS.flatMap((kind) => facts[kind].clips)],
    loops: layers.map(({loop}) => loop),
    levels: [...layers, ...textures.flatMap(({breaks}) => breaks ?? [])].map(({level}) => level),
  };
  for (const [part, names] of Object.entries(named)) {
    for (const name of names) if (!Object.hasOwn(file[part], name)) refuse(`materials.${material}`, `${part} has no "${name}"`);
  }
  const mixed = IMPACTS.find((kind) => new Set(facts[kind].clips.map((clip) => file.clips[clip].rate_hz)).size > 1);
  if (mixed) refuse(`materials.${material}.${mixed}.clips`, 'have several rates');
}

function checkBase64(name, fields) {
  for (const [field, text] of Object.entries(fields)) if (text && !BASE64.test(text)) refuse(`${name}.${field}`, 'is not base64');
}

function refuse(field, problem) {
  throw new Error(`${field}: ${problem}; bake it again`);
}
