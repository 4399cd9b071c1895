/**
 * Types of TypeScript from schemas/asyncapi.yaml, made by AsyncAPI's own generator:
 * `node types.mjs asyncapi.yaml > messages.ts`.
 */
import {readFileSync, writeSync} from 'node:fs';
import {TS_DESCRIPTION_PRESET, TypeScriptGenerator, typeScriptDefaultModelNameConstraints} from '@asyncapi/modelina';

const HEAD = '// Made from schemas/asyncapi.yaml by tests/contract/types.mjs; not edited by hand.\n\n';
const isBytes = ({constrainedModel}) => constrainedModel.originalInput?.format === 'binary';

const generator = new TypeScriptGenerator({
  modelType: 'interface',
  enumType: 'union',
  mapType: 'record',
  rawPropertyNames: true, // speed_mps is its name on the wire
  presets: [TS_DESCRIPTION_PRESET],
  constraints: {modelName: typeScriptDefaultModelNameConstraints({NO_RESERVED_KEYWORDS: (name) => name})}, // Error, Set
  typeMapping: {String: (it) => (isBytes(it) ? 'Uint8Array' : 'string')},
  processorOptions: {interpreter: {ignoreAdditionalProperties: true}}, // newer fields, which a client does not know
});
const models = await generator.generate(readFileSync(process.argv[2], 'utf8'));
writeSync(1, HEAD + models.map(exported).join('\n\n') + '\n');

/** A type as it was made, with its comment before the word `export`. */
function exported({result}) {
  return result.replace(/^(interface|type) /m, 'export $1 ').replace(/ +$/gm, '');
}
