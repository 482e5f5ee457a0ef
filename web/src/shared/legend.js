// SPDX-License-Identifier: Apache-2.0
// The colour scale beside a 3D view: a bar with ticks, or named colours.
import { css_colour } from './colours.js';
import { h, svg } from './dom.js';
import { number, signed } from './format.js';

const kHeight = 264;

/** Round numbers from low to high, at most `most` of them. */
export function ticks(low, high, most = 7) {
  if (!(high > low)) return [low];
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((factor) => factor * power).find((value) => value >= rough * 0.999);
  const result = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-6; ++i) result.push(i === 0 ? 0 : i * step);
  return result;
}

const decimals_of = (values) => {
  const step = values.length > 1 ? Math.min(...values.slice(1).map((value, i) => value - values[i])) : Math.abs(values[0]) || 1;
  for (let decimals = 0; decimals < 6; ++decimals) {
    if (Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) < 1e-6 * 10 ** decimals) return decimals;
  }
  return 6;
};

/** The bar. `map`: {stops, steps | null, tolerance: [low, high] | null, signed}. */
export function scale_bar({ stops, steps, tolerance, signs, whole_numbers }) {
  const low = stops[0].value;
  const high = stops[stops.length - 1].value;
  const y = (value) => kHeight * (1 - (value - low) / (high - low));
  const bar = svg('svg', { class: 'scale', viewBox: `0 -9 118 ${kHeight + 18}`, width: 118, height: kHeight + 18, role: 'img', 'aria-label': `Colour scale from ${low} to ${high}` });
  if (steps) {
    for (const { from, to, rgb } of steps) bar.append(svg('rect', { x: 0, width: 26, y: y(to), height: Math.max(0.5, y(from) - y(to)), fill: css_colour(rgb) }));
  } else {
    const id = `scale-${Math.random().toString(36).slice(2)}`;
    bar.append(svg('defs', null, svg('linearGradient', { id, x1: 0, x2: 0, y1: 1, y2: 0 },
      stops.map(({ value, rgb }) => svg('stop', { offset: (value - low) / (high - low), 'stop-color': css_colour(rgb) })))));
    bar.append(svg('rect', { x: 0, y: 0, width: 26, height: kHeight, fill: `url(#${id})` }));
  }
  bar.append(svg('rect', { x: 0.5, y: 0.5, width: 25, height: kHeight - 1, class: 'frame' }));
  const values = steps && whole_numbers ? steps.map((step) => (step.from + step.to) / 2) : ticks(low, high);
  const decimals = whole_numbers ? 0 : decimals_of(values);
  for (const value of values) {
    const crowded = tolerance?.some((limit) => Math.abs(y(limit) - y(value)) < 13 && Math.abs(limit - value) > (high - low) * 1e-6);
    bar.append(svg('line', { x1: 26, x2: 31, y1: y(value), y2: y(value), class: 'tick' }));
    if (!crowded) bar.append(svg('text', { x: 35, y: y(value) + 4.2 }, signs ? signed(value, decimals) : number(value, decimals)));
  }
  if (tolerance) bar.append(...tolerance_marks(tolerance, low, high, y, decimals));
  return bar;
}

function tolerance_marks(tolerance, low, high, y, decimals) {
  const [from, to] = tolerance.map((limit) => Math.min(high, Math.max(low, limit)));
  const marks = [svg('path', { d: `M86 ${y(from)}h6V${y(to)}h-6`, class: 'band' })];
  marks.push(svg('text', { x: 100, y: (y(from) + y(to)) / 2, class: 'band-name', transform: `rotate(90 100 ${(y(from) + y(to)) / 2})` }, 'tolerance'));
  for (const limit of tolerance) {
    if (limit < low || limit > high) continue;
    marks.push(svg('line', { x1: 0, x2: 31, y1: y(limit), y2: y(limit), class: 'limit' }));
    marks.push(svg('text', { x: 35, y: y(limit) + 4.2, class: 'limit-value' }, signed(limit, Math.max(decimals, digits(limit)))));
  }
  return marks;
}

const digits = (value) => (String(Number(value.toFixed(4))).split('.')[1] ?? '').length;

/** Named colours: [{name, rgb, hatched}]. */
export const swatches = (entries) =>
  h('ul', { class: 'swatches' }, entries.map(({ name, rgb, other }) => h('li', null, swatch(rgb, other), h('span', null, name))));

export function swatch(rgb, other) {
  const [a, b] = [css_colour(rgb), css_colour(other ?? rgb)];
  return h('i', { class: 'swatch', style: `background: repeating-linear-gradient(135deg, ${a} 0 3.2px, ${b} 3.2px 6.4px)` });
}
