// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decimals_for, file_name, kNone, mm, number, percent, plural, short, signed, typeset } from '../../src/shared/format.js';

test('minus is the true sign, thousands are set apart, and a rounded zero has no sign', () => {
  assert.equal(number(-1234567.891, 2), '\u22121\u202f234\u202f567.89');
  assert.equal(number(1234), '1234');
  assert.equal(number(-0.0004, 3), '0.000');
  assert.equal(signed(0.0004, 3), '0.000');
  assert.equal(signed(0.25, 2), '+0.25');
});

test('what is unknown is a dash, never NaN or null', () => {
  for (const value of [null, undefined, NaN, Infinity]) {
    for (const text of [number(value, 2), signed(value, 2), percent(value), mm(value, 2), short(value)]) assert.equal(text, kNone);
  }
});

test('nearly all is not said to be all, nearly nothing not nothing', () => {
  assert.equal(percent(1), '100.0\u202f%');
  assert.equal(percent(0.99999), '99.9\u202f%');
  assert.equal(percent(0), '0.0\u202f%');
  assert.equal(percent(0.0001), '<\u202f0.1\u202f%');
});

test('a sentence keeps minus and unit beside what they belong to, and names as they are', () => {
  assert.equal(typeset('from between +y and -x, 787 mm away: 8.7 % new'), 'from between +y and \u2212x, 787\u00a0mm away: 8.7\u00a0% new');
  assert.equal(typeset('near (12, -80, 30) of scan-xy_07.ply, 3 mmx'), 'near (12, \u221280, 30) of scan-xy_07.ply, 3 mmx');
  assert.equal(typeset(undefined), '');
});

test('decimals show two digits of the spread', () => {
  assert.equal(decimals_for(0.08), 3);
  assert.equal(decimals_for(0.5), 2);
  assert.equal(decimals_for(3), 1);
  assert.equal(decimals_for(40), 0);
  assert.equal(decimals_for(1e-9), 4);
  assert.equal(decimals_for(null), 3);
});

test('names, plurals, short numbers', () => {
  assert.equal(file_name('C:\\parts\\a.step'), 'a.step');
  assert.equal(file_name('/x/y.ply'), 'y.ply');
  assert.equal(plural(1, 'scan'), '1\u00a0scan');
  assert.equal(plural(3, 'scan'), '3\u00a0scans');
  assert.equal(short(1234.5), '1235');
  assert.equal(short(0.01234), '0.0123');
});
