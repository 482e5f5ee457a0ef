// SPDX-License-Identifier: Apache-2.0
// Numbers as print wants them: a true minus, narrow spaces that do not break, no more digits than mean something.

export const kMinus = '\u2212';
export const kSpace = '\u202f';
export const kNone = '\u2013';

const known = (value) => typeof value === 'number' && Number.isFinite(value);

/** 12 345.68 with a true minus; an en dash for what is unknown. */
export function number(value, decimals = 0) {
  if (!known(value)) return kNone;
  const [whole, fraction] = Math.abs(value).toFixed(decimals).split('.');
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, kSpace) : whole;
  const text = fraction === undefined ? grouped : `${grouped}.${fraction}`;
  return value < 0 && /[1-9]/.test(text) ? kMinus + text : text;
}

/** The same with a plus before positive numbers. */
export function signed(value, decimals) {
  const text = number(value, decimals);
  return known(value) && value > 0 && /[1-9]/.test(text) ? `+${text}` : text;
}

export const mm = (value, decimals) => (known(value) ? `${number(value, decimals)}${kSpace}mm` : kNone);
export const signed_mm = (value, decimals) => (known(value) ? `${signed(value, decimals)}${kSpace}mm` : kNone);

/** A share as percent. It is rounded to 100 % or 0 % only if it is that. */
export function percent(share, decimals = 1) {
  if (!known(share)) return kNone;
  let value = share * 100;
  const unit = 10 ** -decimals;
  if (value < 100 && value > 100 - unit / 2) value = 100 - unit;
  if (value > 0 && value < unit / 2) return `<${kSpace}${number(unit, decimals)}${kSpace}%`;
  return `${number(value, decimals)}${kSpace}%`;
}

/** Decimals that show two digits of `scale`, which is the size of the noise or of the spread. */
export function decimals_for(scale, most = 4) {
  if (!known(scale) || scale <= 0) return Math.min(3, most);
  return Math.min(most, Math.max(0, 1 - Math.floor(Math.log10(scale))));
}

/** Three digits that mean something, for lengths and areas of any size. */
export function short(value) {
  if (!known(value)) return kNone;
  const size = Math.abs(value);
  if (size === 0) return '0';
  return number(value, Math.min(6, Math.max(0, 2 - Math.floor(Math.log10(size)))));
}

/** A place, as three lengths. */
export const place = (point, decimals = 1) =>
  point ? point.map((value) => number(value, decimals)).join(`,\u2002`) : kNone;

export const plural = (count, one, many = `${one}s`) => `${number(count)}${'\u00a0'}${count === 1 ? one : many}`;

/** A sentence of the program as print wants it: a true minus before axes and numbers, units beside their numbers. */
export const typeset = (text) => (text ?? '').replace(/(^|[\s(,])-(?=[xyz\d])/g, `$1${kMinus}`).replace(/(\d) (?=(mm|cm\u00b2|%)(?![a-z]))/g, '$1\u00a0');

/** The last part of a path, whatever the system it was written on. */
export const file_name = (path) => (path ? path.split(/[\\/]/).pop() : kNone);
