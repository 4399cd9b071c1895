// Encodes a value as MessagePack, which frames need because JSON cannot contain a picture. Pure.
//
// Supports maps, lists, strings, bytes (Uint8Array), numbers, true, false and null, as the format specifies.

export function pack(value) {
  const parts = [];
  write(value, parts);
  const bytes = new Uint8Array(parts.reduce((size, part) => size + part.length, 0));
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}

function write(value, parts) {
  if (value === null) parts.push([0xc0]);
  else if (typeof value === "boolean") parts.push([value ? 0xc3 : 0xc2]);
  else if (typeof value === "number") parts.push(number(value));
  else if (typeof value === "string") {
    const bytes = new TextEncoder().encode(value);
    parts.push(sized(0xdb, bytes.length), bytes);
  } else if (value instanceof Uint8Array) parts.push(sized(0xc6, value.length), value);
  else if (Array.isArray(value)) {
    parts.push(sized(0xdd, value.length));
    for (const item of value) write(item, parts);
  } else {
    const entries = Object.entries(value).filter(([, item]) => item !== undefined);
    parts.push(sized(0xdf, entries.length));
    for (const [key, item] of entries) {
      write(key, parts);
      write(item, parts);
    }
  }
}

// Encodes whole numbers below 2^32 as integers and all others as doubles.
function number(value) {
  if (Number.isInteger(value) && value >= 0 && value < 2 ** 32) return sized(0xce, value);
  const bytes = new Uint8Array(9);
  bytes[0] = 0xcb;
  new DataView(bytes.buffer).setFloat64(1, value);
  return bytes;
}

function sized(type, size) {
  const bytes = new Uint8Array(5);
  bytes[0] = type;
  new DataView(bytes.buffer).setUint32(1, size);
  return bytes;
}
