// SPDX-License-Identifier: Apache-2.0
// The pose graph on paper: the part's outline in the middle, the sensors where they stood round it, links as wide as the
// overlap. Seen along the direction in which the sensors are spread least.
import { svg } from './dom.js';
import { percent } from './format.js';

const kSize = 520, kRing = 205, kNode = 15;

/** The two axes in which points are spread most (power iteration on the 3x3 covariance), as [right, up]. */
export function main_axes(points) {
  const covariance = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  for (const p of points) for (let i = 0; i < 3; ++i) for (let j = 0; j < 3; ++j) covariance[i][j] += p[i] * p[j];
  const times = (v) => covariance.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
  const unit = (v) => { const length = Math.hypot(...v); return length > 0 ? v.map((x) => x / length) : v; };
  const without = (v, axis) => { const d = axis ? v.reduce((sum, x, i) => sum + x * axis[i], 0) : 0; return axis ? v.map((x, i) => x - d * axis[i]) : v; };
  const strongest = (axis, start) => {
    let v = unit(without(start, axis));
    for (let i = 0; i < 60; ++i) { const next = without(times(v), axis); if (Math.hypot(...next) < 1e-12) break; v = unit(next); }
    return v;
  };
  const first = strongest(null, [1, 0.31, 0.17]);
  const second = strongest(first, Math.abs(first[2]) < 0.9 ? [0.13, 0.29, 1] : [0.2, 1, 0.1]);
  return [first, second];
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Places of the nodes in the picture, pushed apart where they would hide each other. nodes: [{at: [x, y, z] from the middle | null}]. */
export function layout(nodes) {
  const known = nodes.filter((node) => node.at);
  const [right, up] = main_axes(known.map((node) => node.at));
  const farthest = Math.max(1e-9, ...known.map(({ at }) => Math.hypot(dot(at, right), dot(at, up))));
  const places = nodes.map(({ at }, i) => {
    if (!at) return [kRing * Math.cos(i * 2.4), kRing * Math.sin(i * 2.4)];
    const [x, y] = [dot(at, right), dot(at, up)];
    // Sensors above the part's middle are moved out of its picture.
    const length = Math.hypot(x, y);
    const wanted = kRing * Math.max(0.52, length / farthest);
    return length > 1e-9 * farthest ? [(x / length) * wanted, -(y / length) * wanted] : [wanted * Math.cos(i), wanted * Math.sin(i)];
  });
  const apart = Math.min(2.5 * kNode, (2.2 * kRing) / Math.sqrt(nodes.length));
  for (let round = 0; round < 200; ++round) {
    let moved = 0;
    for (let i = 0; i < places.length; ++i) for (let j = 0; j < i; ++j) {
      const dx = places[i][0] - places[j][0] || 1e-3 * (i - j), dy = places[i][1] - places[j][1] || 1e-3;
      const distance = Math.hypot(dx, dy);
      if (distance >= apart) continue;
      const push = ((apart - distance) / distance) * 0.25;
      places[i][0] += dx * push; places[i][1] += dy * push; places[j][0] -= dx * push; places[j][1] -= dy * push;
      moved += push;
    }
    if (moved < 1e-3) break;
  }
  return { places, right, up };
}

/** Convex outline of points in the plane (Andrew's monotone chain). */
export function convex_hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1) {
        const [a, b] = chain.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

function silhouette({ positions, box }, right, up) {
  const step = Math.max(1, Math.floor(positions.length / 3 / 4000));
  const points = [];
  for (let v = 0; v < positions.length / 3; v += step) {
    const p = [0, 1, 2].map((axis) => positions[3 * v + axis] - box.centre[axis]);
    points.push([dot(p, right), -dot(p, up)]);
  }
  const hull = convex_hull(points);
  const reach = Math.max(...hull.map(([x, y]) => Math.hypot(x, y)), 1e-9);
  return hull.map(([x, y]) => `${((x / reach) * kRing * 0.4).toFixed(1)},${((y / reach) * kRing * 0.4).toFixed(1)}`).join(' ');
}

/** nodes: [{id, label, title, at | null, colour, kind}]; links: [{from, to, overlap, linked, title}]; surface may be null. */
export function graph_picture({ nodes, links, surface }) {
  const { places, right, up } = layout(nodes);
  const where = new Map(nodes.map((node, i) => [node.id, places[i]]));
  // No higher than it is wide, and no emptier than what stands in it.
  const part = 0.45 * kRing, margin = 2 * kNode;
  const reach = Math.max(kRing, ...places.map(([x]) => Math.abs(x))) + margin;
  const top = Math.min(-part, ...places.map(([, y]) => y)) - margin, bottom = Math.max(part, ...places.map(([, y]) => y)) + margin;
  const picture = svg('svg', { class: 'graph', viewBox: `${-reach} ${top} ${2 * reach} ${bottom - top}`, width: kSize, role: 'img', 'aria-label': `Pose graph of ${nodes.length} scans` });
  if (surface) picture.append(svg('polygon', { class: 'part', points: silhouette(surface, right, up) }));
  for (const link of [...links].sort((a, b) => a.linked - b.linked || a.overlap - b.overlap)) {
    const [a, b] = [where.get(link.from), where.get(link.to)];
    if (!a || !b) continue;
    picture.append(svg('line', { class: link.linked ? 'link' : 'link unused', x1: a[0], y1: a[1], x2: b[0], y2: b[1], 'stroke-width': link.linked ? (1 + 7 * link.overlap).toFixed(2) : 1.2 },
      svg('title', null, `${link.title}: ${percent(link.overlap, 0)} overlap${link.linked ? '' : ', not linked'}`)));
  }
  nodes.forEach((node, i) => {
    picture.append(svg('g', { class: `node ${node.kind ?? ''}`, transform: `translate(${places[i].map((x) => x.toFixed(1)).join(' ')})` },
      svg('circle', { r: kNode, fill: node.colour }), svg('text', { y: 4.6, 'text-anchor': 'middle' }, node.label), svg('title', null, node.title)));
  });
  return picture;
}
