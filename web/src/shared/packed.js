// SPDX-License-Identifier: Apache-2.0
// Arrays as they come inside JSON: {type, count, data: base64 of little-endian numbers}.

const kinds = { u16: Uint16Array, u32: Uint32Array, f32: Float32Array };

function bytes_of(base64) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64);
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** The typed array of a packed field; null if the field is absent. Throws an Error that says what is wrong. */
export function unpack(packed, name = 'array') {
  if (packed === undefined || packed === null) return null;
  const Kind = kinds[packed.type];
  if (!Kind) throw new Error(`${name} has the unknown type '${packed.type}'`);
  const bytes = bytes_of(packed.data);
  if (bytes.length !== packed.count * Kind.BYTES_PER_ELEMENT) {
    throw new Error(`${name} holds ${bytes.length} bytes, ${packed.count} numbers of type ${packed.type} were announced`);
  }
  if (new Uint8Array(new Uint16Array([1]).buffer)[0] !== 1) reverse_each(bytes, Kind.BYTES_PER_ELEMENT);
  return new Kind(bytes.buffer, bytes.byteOffset, packed.count);
}

function reverse_each(bytes, size) {
  for (let i = 0; i < bytes.length; i += size) bytes.subarray(i, i + size).reverse();
}

/** Positions (3 numbers a vertex, mm) from 16 bits an axis between `min` and `max`. */
export function unpack_positions(packed) {
  const steps = unpack(packed, 'vertices');
  const positions = new Float32Array(steps.length);
  for (let axis = 0; axis < 3; ++axis) {
    const low = packed.min[axis];
    const step = (packed.max[axis] - low) / 65535;
    for (let i = axis; i < steps.length; i += 3) positions[i] = low + step * steps[i];
  }
  return positions;
}
