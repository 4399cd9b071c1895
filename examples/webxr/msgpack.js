/**
 * MessagePack as HapticVLM's protocol uses it: null, booleans, numbers, text, bytes, lists and maps
 * with text keys. No extension types. Written against https://github.com/msgpack/msgpack/blob/master/spec.md
 *
 * JavaScript has one kind of number. `encode` writes whole numbers as integers in the shortest form;
 * a `Float` is written as a float whatever its value, so a message can be repeated byte for byte.
 */

const DEEPEST = 64; // a message has at most 4 levels; hostile nesting must not overflow the stack
const SMALLEST_ROOM = 1024; // bytes

/** The only thing this codec throws: what is wrong with the bytes or the value. */
export class MessagePackError extends Error {}

/** A number that is written as a float even when it is whole. */
export class Float {
  constructor(value) {
    this.value = value;
  }
}

/** Bytes of a value. A field whose value is undefined is left out. Throws MessagePackError. */
export function encode(value) {
  const writer = new Writer();
  writer.value(value, DEEPEST);
  return writer.bytes();
}

/**
 * The one value these bytes (Uint8Array) hold; bytes inside it are views of them. With `keepFloats` each
 * float arrives as a Float. Throws MessagePackError.
 */
export function decode(bytes, {keepFloats = false} = {}) {
  const reader = new Reader(bytes, keepFloats);
  const value = reader.value(DEEPEST);
  if (reader.left) throw new MessagePackError(`${reader.left} bytes after the value`);
  return value;
}

class Writer {
  #room = new Uint8Array(SMALLEST_ROOM);
  #view = new DataView(this.#room.buffer);
  #end = 0;

  bytes() {
    return this.#room.slice(0, this.#end);
  }

  value(value, depth) {
    if (depth === 0) throw new MessagePackError(`nested deeper than ${DEEPEST}`);
    if (value === null) this.#put(1, 0xc0);
    else if (typeof value === 'boolean') this.#put(1, value ? 0xc3 : 0xc2);
    else if (typeof value === 'number') this.#number(value);
    else if (typeof value === 'string') this.#text(value);
    else if (value instanceof Float) this.#float(value.value);
    else if (value instanceof Uint8Array) this.#binary(value);
    else if (Array.isArray(value)) this.#list(value, depth);
    else if (typeof value === 'object') this.#map(value, depth);
    else throw new MessagePackError(`no MessagePack for ${typeof value}`);
  }

  #number(value) {
    if (!Number.isSafeInteger(value) || Object.is(value, -0)) this.#float(value);
    else if (value >= 0) this.#natural(value);
    else this.#negative(value);
  }

  #natural(value) {
    if (value < 0x80) this.#put(1, value);
    else if (value < 2 ** 32) this.#sized(value, [0xcc, 0xcd, 0xce]);
    else this.#wide(0xcf, BigInt(value));
  }

  #negative(value) {
    if (value >= -0x20) this.#put(1, value + 0x100);
    else if (value >= -0x80) this.#put(1, 0xd0, 1, value + 0x100);
    else if (value >= -0x8000) this.#put(1, 0xd1, 2, value + 0x10000);
    else if (value >= -0x80000000) this.#put(1, 0xd2, 4, value + 2 ** 32);
    else this.#wide(0xd3, BigInt.asUintN(64, BigInt(value)));
  }

  #wide(tag, value) {
    this.#put(1, tag);
    this.#make(8);
    this.#view.setBigUint64(this.#end, value);
    this.#end += 8;
  }

  #float(value) {
    this.#put(1, 0xcb);
    this.#make(8);
    this.#view.setFloat64(this.#end, value);
    this.#end += 8;
  }

  #text(value) {
    if (!value.isWellFormed()) throw new MessagePackError('a text with half a surrogate pair');
    const bytes = new TextEncoder().encode(value);
    if (bytes.length < 32) this.#put(1, 0xa0 | bytes.length);
    else this.#sized(bytes.length, [0xd9, 0xda, 0xdb]);
    this.#copy(bytes);
  }

  #binary(bytes) {
    this.#sized(bytes.length, [0xc4, 0xc5, 0xc6]);
    this.#copy(bytes);
  }

  #list(items, depth) {
    if (items.length < 16) this.#put(1, 0x90 | items.length);
    else this.#sized(items.length, [null, 0xdc, 0xdd]);
    for (const item of items) this.value(item, depth - 1);
  }

  #map(map, depth) {
    const fields = Object.entries(map).filter(([, value]) => value !== undefined);
    if (fields.length < 16) this.#put(1, 0x80 | fields.length);
    else this.#sized(fields.length, [null, 0xde, 0xdf]);
    for (const [key, value] of fields) {
      this.#text(key);
      this.value(value, depth - 1);
    }
  }

  /** A number below 2^32 behind the tag of its width: `tags` for 1, 2 and 4 bytes. */
  #sized(number, [one, two, four]) {
    if (number < 0x100 && one) this.#put(1, one, 1, number);
    else if (number < 0x10000) this.#put(1, two, 2, number);
    else this.#put(1, four, 4, number);
  }

  /** Unsigned numbers in pairs of width and value. */
  #put(...parts) {
    this.#make(8);
    for (let i = 0; i < parts.length; i += 2) {
      const [width, value] = [parts[i], parts[i + 1]];
      if (width === 1) this.#view.setUint8(this.#end, value);
      else if (width === 2) this.#view.setUint16(this.#end, value);
      else this.#view.setUint32(this.#end, value);
      this.#end += width;
    }
  }

  #copy(bytes) {
    this.#make(bytes.length);
    this.#room.set(bytes, this.#end);
    this.#end += bytes.length;
  }

  #make(bytes) {
    if (this.#end + bytes <= this.#room.length) return;
    const wider = new Uint8Array(Math.max(this.#room.length * 2, this.#end + bytes));
    wider.set(this.#room);
    this.#room = wider;
    this.#view = new DataView(wider.buffer);
  }
}

class Reader {
  #bytes;
  #view;
  #keepFloats;
  #at = 0;
  #text = new TextDecoder('utf-8', {fatal: true, ignoreBOM: true});

  constructor(bytes, keepFloats) {
    if (!(bytes instanceof Uint8Array)) throw new MessagePackError('not a Uint8Array');
    this.#bytes = bytes;
    this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.#keepFloats = keepFloats;
  }

  get left() {
    return this.#bytes.length - this.#at;
  }

  value(depth) {
    if (depth === 0) throw new MessagePackError(`nested deeper than ${DEEPEST}`);
    const tag = this.#unsigned(1);
    if (tag < 0x80) return tag;
    if (tag < 0x90) return this.#map(tag & 0x0f, depth);
    if (tag < 0xa0) return this.#list(tag & 0x0f, depth);
    if (tag < 0xc0) return this.#string(tag & 0x1f);
    if (tag >= 0xe0) return tag - 0x100;
    return this.#tagged(tag, depth);
  }

  #tagged(tag, depth) {
    if (tag === 0xc0) return null;
    if (tag === 0xc2 || tag === 0xc3) return tag === 0xc3;
    if (tag >= 0xc4 && tag <= 0xc6) return this.#take(this.#unsigned(1 << (tag - 0xc4)));
    if (tag === 0xca || tag === 0xcb) return this.#float(tag === 0xca ? 4 : 8);
    if (tag >= 0xcc && tag <= 0xcf) return this.#unsigned(1 << (tag - 0xcc));
    if (tag >= 0xd0 && tag <= 0xd3) return this.#signed(1 << (tag - 0xd0));
    if (tag >= 0xd9 && tag <= 0xdb) return this.#string(this.#unsigned(1 << (tag - 0xd9)));
    if (tag === 0xdc || tag === 0xdd) return this.#list(this.#unsigned(tag === 0xdc ? 2 : 4), depth);
    if (tag === 0xde || tag === 0xdf) return this.#map(this.#unsigned(tag === 0xde ? 2 : 4), depth);
    throw new MessagePackError(`tag 0x${tag.toString(16)} is not used here`);
  }

  #list(count, depth) {
    this.#expect(count);
    return Array.from({length: count}, () => this.value(depth - 1));
  }

  #map(count, depth) {
    this.#expect(2 * count);
    const fields = [];
    for (let i = 0; i < count; i++) fields.push([this.#key(), this.value(depth - 1)]);
    return Object.fromEntries(fields);
  }

  #key() {
    const key = this.value(1);
    if (typeof key !== 'string') throw new MessagePackError('a key that is not a text');
    return key;
  }

  #string(length) {
    try {
      return this.#text.decode(this.#take(length));
    } catch (error) {
      if (error instanceof MessagePackError) throw error;
      throw new MessagePackError('a text that is not UTF-8');
    }
  }

  #float(width) {
    this.#expect(width);
    const value = width === 4 ? this.#view.getFloat32(this.#at) : this.#view.getFloat64(this.#at);
    this.#at += width;
    return this.#keepFloats ? new Float(value) : value;
  }

  #unsigned(width) {
    this.#expect(width);
    const at = this.#at;
    this.#at += width;
    if (width === 1) return this.#view.getUint8(at);
    if (width === 2) return this.#view.getUint16(at);
    if (width === 4) return this.#view.getUint32(at);
    return exact(this.#view.getBigUint64(at));
  }

  #signed(width) {
    this.#expect(width);
    const at = this.#at;
    this.#at += width;
    if (width === 1) return this.#view.getInt8(at);
    if (width === 2) return this.#view.getInt16(at);
    if (width === 4) return this.#view.getInt32(at);
    return exact(this.#view.getBigInt64(at));
  }

  #take(length) {
    this.#expect(length);
    this.#at += length;
    return this.#bytes.subarray(this.#at - length, this.#at);
  }

  /** A declared length is checked against what is there before anything is made for it. */
  #expect(bytes) {
    if (bytes > this.left) throw new MessagePackError('ends too early');
  }
}

function exact(wide) {
  const value = Number(wide);
  if (!Number.isSafeInteger(value)) throw new MessagePackError('a whole number beyond 2^53');
  return value;
}
