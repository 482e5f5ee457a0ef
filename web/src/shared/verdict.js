// SPDX-License-Identifier: Apache-2.0
// The verdicts of the report, each with a colour and a shape of its own.
import { h, svg } from './dom.js';

const shapes = {
  pass: () => [svg('circle', { cx: 12, cy: 12, r: 11 }), svg('path', { d: 'M6.8 12.4l3.6 3.6 6.8-7.6' })],
  fail: () => [svg('path', { class: 'body', d: 'M7.4 1h9.2L23 7.4v9.2L16.6 23H7.4L1 16.6V7.4z' }), svg('path', { d: 'M8 8l8 8M16 8l-8 8' })],
  'not enough data': () => [svg('path', { class: 'body', d: 'M12 1.5L23.2 21.5H.8z' }), svg('path', { d: 'M12 8.6v6M12 17.6v.9' })],
  'not scanned': () => [svg('circle', { class: 'hollow', cx: 12, cy: 12, r: 9.7 }), svg('path', { class: 'dash', d: 'M7.5 12h9' })],
  none: () => [svg('rect', { class: 'body', x: 1.5, y: 1.5, width: 21, height: 21, rx: 4 }), svg('path', { d: 'M7 12h10' })],
};

export const verdict_colours = { pass: [86, 160, 122], fail: [192, 57, 43], 'not enough data': [240, 190, 90], 'not scanned': null };

export const verdict_class = (verdict) => `verdict-${(verdict ?? 'none').replaceAll(' ', '-')}`;

export const verdict_icon = (verdict) =>
  svg('svg', { class: `icon ${verdict_class(verdict)}`, viewBox: '0 0 24 24', 'aria-hidden': 'true' }, (shapes[verdict] ?? shapes.none)());

export const verdict_badge = (verdict) =>
  verdict ? h('span', { class: `badge ${verdict_class(verdict)}` }, verdict_icon(verdict), verdict) : h('span', { class: 'badge none' }, '\u2013');
