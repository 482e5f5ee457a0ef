// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { convex_hull, layout, main_axes } from '../../src/shared/graph.js';
import { ticks } from '../../src/shared/legend.js';

test('the picture looks along the axis of least spread', () => {
  const points = Array.from({ length: 40 }, (_, i) => [10 * Math.cos(i), 7 * Math.sin(i), 0.1 * Math.sin(3 * i)]);
  const [right, up] = main_axes(points);
  assert.ok(Math.abs(right[0]) > 0.99 && Math.abs(up[1]) > 0.99, `${right} ${up}`);
});

test('sixty sensors, some in one place, do not hide each other', () => {
  const nodes = Array.from({ length: 60 }, (_, i) => ({ at: i % 10 === 0 ? [100, 0, 0] : [100 * Math.cos(i), 100 * Math.sin(i), 20 * Math.sin(2 * i)] }));
  const { places } = layout(nodes);
  for (let i = 0; i < 60; ++i) for (let j = 0; j < i; ++j) assert.ok(Math.hypot(places[i][0] - places[j][0], places[i][1] - places[j][1]) > 20, `${i} and ${j}`);
});

test('sensors without a known place and a single one are laid out, too', () => {
  for (const nodes of [[{ at: null }, { at: null }], [{ at: [0, 0, 0] }], [{ at: [1, 2, 3] }, { at: null }]]) {
    for (const [x, y] of layout(nodes).places) assert.ok(Number.isFinite(x) && Number.isFinite(y));
  }
});

test('the hull of a grid is its four corners', () => {
  const grid = Array.from({ length: 25 }, (_, i) => [i % 5, Math.floor(i / 5)]);
  assert.deepEqual(convex_hull(grid).map(String).sort(), ['0,0', '0,4', '4,0', '4,4']);
});

test('ticks are round numbers within the range', () => {
  assert.deepEqual(ticks(-0.6, 0.6, 7).map((value) => Number(value.toFixed(6))), [-0.6, -0.4, -0.2, 0, 0.2, 0.4, 0.6]);
  assert.ok(ticks(0, 0.0137, 7).length >= 4);
});
