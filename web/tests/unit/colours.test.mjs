// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  age_stops, category_colour, colour_at, coverage_stops, deviation_steps, deviation_stops, even_steps, kNotScanned, lightness_of, lookup, uncertainty_stops,
} from '../../src/shared/colours.js';

const samples = (stops, from, to) => Array.from({ length: 401 }, (_, i) => lightness_of(colour_at(stops, from + ((to - from) * i) / 400)));
const falls = (values) => values.every((value, i) => i === 0 || value <= values[i - 1] + 1e-6);

test('lightness is that of CIE for white, black and the middle grey', () => {
  assert.ok(Math.abs(lightness_of([255, 255, 255]) - 100) < 0.01);
  assert.equal(lightness_of([0, 0, 0]), 0);
  assert.ok(Math.abs(lightness_of([119, 119, 119]) - 50) < 0.2);
});

test('maps of one kind of value are monotone in lightness', () => {
  for (const stops of [coverage_stops(0, 1), uncertainty_stops(0, 1)]) assert.ok(falls(samples(stops, 0, 1)));
  assert.ok(falls(samples(age_stops(0, 1), 0, 1).reverse()));
});

test('the deviation map gets darker from zero outwards on both sides, with a tolerance or without', () => {
  for (const tolerance of [null, [-0.3, 0.2], [-2, 2]]) {
    const stops = deviation_stops(-1, 0.8, tolerance);
    assert.ok(falls(samples(stops, 0, 0.8)), `above zero, ${tolerance}`);
    assert.ok(falls(samples(stops, 0, -1)), `below zero, ${tolerance}`);
  }
});

test('positive is red, negative blue, zero neither', () => {
  const stops = deviation_stops(-1, 1);
  const [over, under, zero] = [0.8, -0.8, 0].map((value) => colour_at(stops, value));
  assert.ok(over[0] > over[2] + 60 && under[2] > under[0] + 60);
  assert.ok(Math.max(...zero) - Math.min(...zero) < 2);
});

test('what is within tolerance is one step, and the steps touch and cover the range', () => {
  const steps = deviation_steps(deviation_stops(-1, 1, [-0.3, 0.2]), [-0.3, 0.2]);
  assert.equal(steps.filter((step) => step.from === -0.3 && step.to === 0.2).length, 1);
  assert.equal(steps[0].from, -1);
  assert.ok(Math.abs(steps.at(-1).to - 1) < 1e-12);
  steps.slice(1).forEach((step, i) => assert.ok(Math.abs(step.from - steps[i].to) < 1e-12));
});

test('a value in tolerance and one beyond never share a step', () => {
  const tolerance = [-0.3, 0.3];
  const steps = deviation_steps(deviation_stops(-1, 1, tolerance), tolerance);
  const texels = lookup(deviation_stops(-1, 1, tolerance), steps, 1000);
  const at = (value) => texels.slice(4 * Math.floor((value + 1) * 500), 4 * Math.floor((value + 1) * 500) + 3).join();
  assert.equal(at(0.29), at(-0.29));
  assert.notEqual(at(0.31), at(0.29));
  assert.notEqual(at(-0.31), at(-0.29));
});

test('nothing unscanned is green', () => {
  const [r, g, b] = kNotScanned;
  assert.ok(Math.max(r, g, b) - Math.min(r, g, b) < 12);
});

test('the first forty categories can be told apart', () => {
  const colours = Array.from({ length: 40 }, (_, i) => category_colour(i));
  for (let i = 0; i < 40; ++i) for (let j = 0; j < i; ++j) {
    const distance = Math.hypot(...colours[i].map((value, k) => value - colours[j][k]));
    assert.ok(distance > 12, `${i} and ${j} are ${distance.toFixed(1)} apart`);
  }
});

test('whole numbers each get the middle of their own step', () => {
  const steps = even_steps(coverage_stops(0.5, 4.5), 4);
  [1, 2, 3, 4].forEach((count, i) => assert.ok(steps[i].from < count && count < steps[i].to));
});
