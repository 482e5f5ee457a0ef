// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { area_of, coarser_triangles } from '../../src/shared/coarse.js';
import { box_of, vertex_normals } from '../../src/shared/surface.js';
import { bent_plate } from '../support/example-surface.mjs';

const mesh = bent_plate(60000);
const positions = Float32Array.from(mesh.positions);
const triangles = Uint32Array.from(mesh.triangles);
const surface = { positions, triangles, normals: vertex_normals(positions, triangles), box: box_of(positions) };

test('a surface of a tenth of the triangles keeps its area', () => {
  const coarse = coarser_triangles(surface, 6000);
  assert.ok(coarse.length / 3 > 2000 && coarse.length / 3 < 12000, `${coarse.length / 3} triangles`);
  const kept = area_of(positions, coarse) / area_of(positions, triangles);
  assert.ok(kept > 0.93 && kept < 1.03, `area ${kept}`);
});

test('the two sides of a thin wall are not joined, though cells are wider than it is thick', () => {
  const coarse = coarser_triangles(surface, 1500);
  for (let t = 0; t < coarse.length; t += 3) {
    const sides = new Set([0, 1, 2].map((k) => mesh.vertices[coarse[t + k]].side));
    assert.ok(!(sides.has(0) && sides.has(1)), `triangle ${t / 3} joins both sides`);
  }
});

test('what is small enough stays as it is', () => {
  assert.equal(coarser_triangles(surface, 1e6), triangles);
});
