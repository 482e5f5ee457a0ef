// SPDX-License-Identifier: Apache-2.0
// How the scanned area is spread over the deviation, in the colours of the map.
import { colour_at, css_colour } from '../shared/colours.js';
import { h, svg } from '../shared/dom.js';
import { number, percent, signed } from '../shared/format.js';
import { ticks } from '../shared/legend.js';
import { default_deviation_map, tolerance_of } from './modes.js';

const kBox = { width: 720, height: 250, left: 46, right: 12, top: 24, bottom: 34 };

export function histogram(report) {
  const { low, high, over_area: counts, below, above } = report.histogram;
  const total = counts.reduce((sum, count) => sum + count, 0) + below + above;
  if (!total) return h('p', { class: 'soft' }, 'Nothing was scanned.');
  const most = Math.max(...counts) / total;
  const x = (value) => kBox.left + ((value - low) / (high - low)) * (kBox.width - kBox.left - kBox.right);
  const y = (share) => kBox.height - kBox.bottom - (share / most) * (kBox.height - kBox.top - kBox.bottom);
  const floor = y(0);
  const picture = svg('svg', { class: 'histogram', viewBox: `0 0 ${kBox.width} ${kBox.height}`, role: 'img', 'aria-label': 'Histogram of the deviation over the scanned area' });
  const tolerance = tolerance_of(report);
  if (tolerance) picture.append(...band(tolerance.map((limit) => Math.min(high, Math.max(low, limit))), x, floor));
  for (const share of ticks(0, most, 4)) {
    picture.append(svg('line', { class: 'grid', x1: kBox.left, x2: kBox.width - kBox.right, y1: y(share), y2: y(share) }),
      svg('text', { x: kBox.left - 6, y: y(share) + 4, 'text-anchor': 'end' }, percent(share, most < 0.05 ? 1 : 0)));
  }
  const { stops } = default_deviation_map(report);
  const width = (high - low) / counts.length;
  counts.forEach((count, i) => {
    if (!count) return;
    const from = low + i * width;
    const bar = svg('rect', { x: x(from) + 0.4, width: Math.max(0.5, x(from + width) - x(from) - 0.8), y: y(count / total), height: floor - y(count / total), fill: css_colour(colour_at(stops, from + width / 2)) });
    bar.append(svg('title', null, `${signed(from, report.decimals)} to ${signed(from + width, report.decimals)} mm: ${percent(count / total, 2)}`));
    picture.append(bar);
  });
  picture.append(svg('line', { class: 'axis', x1: kBox.left, x2: kBox.width - kBox.right, y1: floor, y2: floor }));
  const values = ticks(low, high, 9);
  const decimals = Math.max(...values.map((value) => (String(Number(value.toFixed(6))).split('.')[1] ?? '').length));
  for (const value of values) {
    picture.append(svg('line', { class: 'axis', x1: x(value), x2: x(value), y1: floor, y2: floor + 4 }),
      svg('text', { x: x(value), y: floor + 17, 'text-anchor': 'middle' }, signed(value, decimals)));
  }
  return h('figure', null, picture, h('figcaption', null, caption(below, above, low, high, total)));
}

function band([from, to], x, floor) {
  return [svg('rect', { class: 'tolerance', x: x(from), width: x(to) - x(from), y: kBox.top, height: floor - kBox.top }),
    ...[from, to].map((limit) => svg('line', { class: 'limit', x1: x(limit), x2: x(limit), y1: kBox.top - 4, y2: floor })),
    svg('text', { x: (x(from) + x(to)) / 2, y: kBox.top - 8, 'text-anchor': 'middle', class: 'band-name' }, 'tolerance')];
}

function caption(below, above, low, high, total) {
  const outside = below + above ? ` ${percent((below + above) / total, 2)} lies outside the picture (${number(below)} spots below ${signed(low, 2)}, ${number(above)} above ${signed(high, 2)}).` : '';
  return `Share of the scanned area by deviation in mm.${outside}`;
}
