// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { long_edges, open_edges, pick, read_surface, value_at, vertex_normals } from '../../src/shared/surface.js';
import { bent_plate, packed, packed_positions } from '../support/example-surface.mjs';

// A square of 2 mm in z = 1, facing +z.
const square = { positions: Float32Array.of(0, 0, 1, 2, 0, 1, 2, 2, 1, 0, 2, 1), triangles: Uint32Array.of(0, 1, 2, 0, 2, 3) };

test('a ray meets the nearest triangle at the right place', () => {
  const two = { positions: Float32Array.of(...square.positions, 0, 0, -1, 2, 0, -1, 2, 2, -1), triangles: Uint32Array.of(4, 5, 6, ...square.triangles) };
  const hit = pick(two, [1.5, 0.5, 10], [0, 0, -1]);
  assert.equal(hit.triangle, 1);
  assert.deepEqual(hit.point.map((value) => Math.round(value * 1e6) / 1e6), [1.5, 0.5, 1]);
  assert.equal(pick(two, [3, 0.5, 10], [0, 0, -1]), null);
  assert.equal(pick(two, [1.5, 0.5, 10], [0, 0, 1]), null);
});

test('a value between corners is interpolated, and unknown corners do not count', () => {
  const hit = pick(square, [1.5, 0.5, 10], [0, 0, -1]);  // in the triangle 0 1 2; f(x, y) = 3x - y is linear
  const linear = Float32Array.of(0, 6, 4, -2);
  assert.ok(Math.abs(value_at(square, hit, linear) - 4) < 1e-5);
  assert.ok(Math.abs(value_at(square, hit, Float32Array.of(NaN, 7, 7, NaN)) - 7) < 1e-5);
  assert.ok(Number.isNaN(value_at(square, hit, Float32Array.of(NaN, NaN, NaN, 1))));
});

test('normals point out of the bent plate as they were made', () => {
  const mesh = bent_plate(2000);
  const positions = Float32Array.from(mesh.positions);
  const normals = vertex_normals(positions, Uint32Array.from(mesh.triangles));
  mesh.vertices.forEach(({ normal }, v) => {
    const cosine = normal.reduce((sum, value, k) => sum + (value * normals[4 * v + k]) / 127, 0);
    assert.ok(cosine > 0.95, `vertex ${v}: ${cosine}`);
  });
});

test('only edges of one triangle are outline: of a square its four sides', () => {
  const edges = open_edges(square.triangles);
  const pairs = Array.from({ length: edges.length / 2 }, (_, i) => `${edges[2 * i]}-${edges[2 * i + 1]}`).sort();
  assert.deepEqual(pairs, ['0-1', '0-3', '1-2', '2-3']);
});

test('short dashes and spurs are no outline; loops, long dashes and what holds them together are', () => {
  // A square of 10 with a spur of 2 at one corner, itself forked, a dash of 3 and one of 30; the diameter is 100.
  const points = [[0, 0], [10, 0], [10, 10], [0, 10], [12, 0], [13, 1], [13, -1], [50, 0], [53, 0], [60, 0], [75, 0], [90, 0]];
  // The other side of the square's first edge has vertices of its own.
  points.push([0, 0], [10, 0]);
  const positions = Float32Array.from(points.flatMap(([x, y]) => [x, y, 0]));
  const edges = Uint32Array.of(0, 1, 1, 2, 2, 3, 3, 0, 12, 13, 1, 4, 4, 5, 4, 6, 7, 8, 9, 10, 10, 11);
  assert.deepEqual([...long_edges(positions, edges, 100)], [0, 1, 1, 2, 2, 3, 3, 0, 12, 13, 9, 10, 10, 11]);
});

test('a triangle that names a missing vertex is refused', () => {
  const scene = { vertices: packed_positions([0, 0, 0, 1, 0, 0, 0, 1, 1]), triangles: packed('u32', Uint32Array.of(0, 1, 3)) };
  assert.throws(() => read_surface(scene), /vertex 3, there are 3/);
});
