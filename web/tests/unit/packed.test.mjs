// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { unpack, unpack_positions } from '../../src/shared/packed.js';

const base64 = (...bytes) => Buffer.from(bytes).toString('base64');

test('numbers of all three types are read as little-endian', () => {
  assert.deepEqual([...unpack({ type: 'u16', count: 3, data: base64(1, 0, 0, 1, 255, 255) })], [1, 256, 65535]);
  assert.deepEqual([...unpack({ type: 'u32', count: 2, data: base64(1, 2, 3, 4, 255, 255, 255, 255) })], [0x04030201, 0xffffffff]);
  // 1.5 is 0x3fc00000, a quiet NaN 0x7fc00000 in IEEE 754.
  assert.deepEqual([...unpack({ type: 'f32', count: 2, data: base64(0, 0, 0xc0, 0x3f, 0, 0, 0xc0, 0x7f) })], [1.5, NaN]);
});

test('an empty array and a missing one are told apart', () => {
  assert.equal(unpack({ type: 'f32', count: 0, data: '' }).length, 0);
  assert.equal(unpack(undefined), null);
});

test('a wrong length and an unknown type are said by name', () => {
  assert.throws(() => unpack({ type: 'u16', count: 2, data: base64(1, 2) }, 'support'), /support holds 2 bytes, 2 numbers of type u16/);
  assert.throws(() => unpack({ type: 'f64', count: 1, data: '' }, 'sigma'), /sigma has the unknown type 'f64'/);
});

test('positions run from min to max on each axis', () => {
  const data = Buffer.from(Uint16Array.of(0, 65535, 0, 65535, 0, 32768).buffer).toString('base64');
  const positions = unpack_positions({ type: 'u16', count: 6, min: [-10, 5, 0], max: [10, 6, 2], data });
  const expected = [-10, 6, 0, 10, 5, (2 * 32768) / 65535];
  positions.forEach((value, i) => assert.ok(Math.abs(value - expected[i]) < 1e-6, `${i}: ${value}`));
});

test('a large array survives both ways', () => {
  const values = Float32Array.from({ length: 200001 }, (_, i) => Math.sin(i) * 1e3);
  const read = unpack({ type: 'f32', count: values.length, data: Buffer.from(values.buffer).toString('base64') });
  assert.deepEqual(read, values);
});
