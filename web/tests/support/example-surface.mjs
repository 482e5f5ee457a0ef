// SPDX-License-Identifier: Apache-2.0
// A bent plate for the tests of the pages: 120 mm wide, two flat legs and a bend, ten CAD faces, known everywhere.

const kRadius = 20, kThickness = 4, kWidth = 120, kLegA = 80, kLegB = 60;
const kBend = (Math.PI / 2) * (kRadius + kThickness);
export const kLength = kLegA + kBend + kLegB;

/** Point and outward normal of the outer (side 1) or inner (side 0) skin at arc length s along the outer profile. */
function profile(s, side) {
  const r = side ? kRadius + kThickness : kRadius;
  if (s <= kLegA) return { x: s - kLegA, z: -r, nx: 0, nz: -1 };
  if (s >= kLegA + kBend) return { x: r, z: s - kLegA - kBend, nx: 1, nz: 0 };
  const angle = ((s - kLegA) / kBend) * (Math.PI / 2);
  return { x: r * Math.sin(angle), z: -r * Math.cos(angle), nx: Math.sin(angle), nz: -Math.cos(angle) };
}

const zone = (s) => (s < kLegA ? 0 : s < kLegA + kBend ? 1 : 2);

/** {positions, triangles, faces, vertices: [{s, y, side, normal}]} with about `wanted` triangles. */
export function bent_plate(wanted = 6000) {
  const step = Math.sqrt((2 * 2 * kLength * kWidth) / wanted);
  const along = [0];
  for (const [from, length] of [[0, kLegA], [kLegA, kBend], [kLegA + kBend, kLegB]]) {
    const count = Math.max(2, Math.round(length / step));
    for (let i = 1; i <= count; ++i) along.push(from + (length * i) / count);
  }
  const across = Array.from({ length: Math.round(kWidth / step) + 1 }, (_, i) => (kWidth * i) / Math.round(kWidth / step));
  const layers = Math.max(2, Math.round(kThickness / step));
  const depth = Array.from({ length: layers + 1 }, (_, i) => i / layers);
  const mesh = { positions: [], triangles: [], faces: [], vertices: [] };
  const grid = (us, vs, at, face, flip) => {
    const first = mesh.vertices.length;
    for (const u of us) for (const v of vs) {
      const vertex = at(u, v);
      mesh.positions.push(...vertex.point);
      mesh.vertices.push(vertex);
    }
    for (let i = 0; i + 1 < us.length; ++i) for (let j = 0; j + 1 < vs.length; ++j) {
      const a = first + i * vs.length + j, b = a + vs.length;
      const quads = [[a, b, b + 1], [a, b + 1, a + 1]];
      for (const t of quads) mesh.triangles.push(...(flip ? [t[0], t[2], t[1]] : t));
      mesh.faces.push(...[0, 1].map(() => face((us[i] + us[i + 1]) / 2)));
    }
  };
  const skin = (side) => (s, y) => {
    const p = profile(s, side);
    const sign = side ? 1 : -1;
    return { point: [p.x, y, p.z], normal: [sign * p.nx, 0, sign * p.nz], s, y, side };
  };
  const wall = (y, ny) => (s, d) => {
    const [a, b] = [profile(s, 0), profile(s, 1)];
    return { point: [a.x + d * (b.x - a.x), y, a.z + d * (b.z - a.z)], normal: [0, ny, 0], s, y, side: 2 };
  };
  const end = (s, n) => (y, d) => {
    const [a, b] = [profile(s, 0), profile(s, 1)];
    return { point: [a.x + d * (b.x - a.x), y, a.z + d * (b.z - a.z)], normal: n, s, y, side: 3 };
  };
  grid(along, across, skin(1), (s) => zone(s), true);
  grid(along, across, skin(0), (s) => 3 + zone(s), false);
  grid(along, depth, wall(0, -1), () => 6, true);
  grid(along, depth, wall(kWidth, 1), () => 7, false);
  grid(across, depth, end(0, [-1, 0, 0]), () => 8, false);
  grid(across, depth, end(kLength, [0, 0, 1]), () => 9, true);
  return mesh;
}

const encode = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString('base64');

export const packed = (type, array) => ({ type, count: array.length, data: encode(array) });

export function packed_positions(positions) {
  const min = [0, 1, 2].map((axis) => positions.reduce((low, value, i) => (i % 3 === axis ? Math.min(low, value) : low), Infinity));
  const max = [0, 1, 2].map((axis) => positions.reduce((high, value, i) => (i % 3 === axis ? Math.max(high, value) : high), -Infinity));
  const steps = Uint16Array.from(positions, (value, i) => Math.round(((value - min[i % 3]) / (max[i % 3] - min[i % 3])) * 65535));
  return { type: 'u16', count: steps.length, min, max, data: encode(steps) };
}

/** Numbers in [0, 1) that are the same in each run. */
export function randoms(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 4294967296;
  };
}
