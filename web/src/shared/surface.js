// SPDX-License-Identifier: Apache-2.0
// The part's surface as typed arrays: positions (3 a vertex, mm, model frame), triangles (3 vertices each).
import { unpack, unpack_positions } from './packed.js';

/** {positions, triangles, faces | null, normals, edges, box} of a scene or of the live server's surface. */
export function read_surface(scene) {
  const positions = unpack_positions(scene.vertices);
  const triangles = unpack(scene.triangles, 'triangles');
  const faces = unpack(scene.faces, 'faces');
  for (const vertex of triangles) {
    if (vertex * 3 >= positions.length) throw new Error(`a triangle names vertex ${vertex}, there are ${positions.length / 3}`);
  }
  return { positions, triangles, faces, normals: vertex_normals(positions, triangles), edges: long_edges(positions, open_edges(triangles), box_of(positions).diameter), box: box_of(positions) };
}

export function box_of(positions) {
  const min = [Infinity, Infinity, Infinity];
  const max = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; ++i) {
    const axis = i % 3;
    if (positions[i] < min[axis]) min[axis] = positions[i];
    if (positions[i] > max[axis]) max[axis] = positions[i];
  }
  const centre = min.map((low, axis) => (low + max[axis]) / 2);
  return { min, max, centre, diameter: Math.hypot(...min.map((low, axis) => max[axis] - low)) };
}

/** Area-weighted normals as signed bytes (a graphics card normalises them). Vertices are split at sharp edges already. */
export function vertex_normals(positions, triangles) {
  const sums = new Float32Array(positions.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [triangles[t] * 3, triangles[t + 1] * 3, triangles[t + 2] * 3];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (let k = t; k < t + 3; ++k) {
      const v = triangles[k] * 3;
      sums[v] += nx; sums[v + 1] += ny; sums[v + 2] += nz;
    }
  }
  const normals = new Int8Array((positions.length / 3) * 4);
  for (let v = 0; v < positions.length / 3; ++v) {
    const length = Math.hypot(sums[3 * v], sums[3 * v + 1], sums[3 * v + 2]) || 1;
    for (let k = 0; k < 3; ++k) normals[4 * v + k] = Math.round((127 * sums[3 * v + k]) / length);
  }
  return normals;
}

/** Edges that one triangle alone uses: as vertices are split at sharp edges, these draw the part's outline. */
export function open_edges(triangles) {
  const keys = new Float64Array(triangles.length);
  for (let t = 0; t < triangles.length; t += 3) {
    for (let k = 0; k < 3; ++k) {
      const [a, b] = [triangles[t + k], triangles[t + ((k + 1) % 3)]];
      keys[t + k] = Math.min(a, b) * 4194304 + Math.max(a, b);
    }
  }
  keys.sort();
  const edges = [];
  for (let i = 0; i < keys.length;) {
    let end = i + 1;
    while (end < keys.length && keys[end] === keys[i]) ++end;
    if (end === i + 1) edges.push(Math.floor(keys[i] / 4194304), keys[i] % 4194304);
    i = end;
  }
  // A surface in crumbs has no outline worth drawing.
  return edges.length > Math.max(5000, triangles.length / 5) ? new Uint32Array(0) : new Uint32Array(edges);
}

/**
 * The edges without dashes and spurs: chains that end in nothing and are shorter than 4 % of the diameter. They come from
 * slivers, and from fillets whose facets differ by about the angle at which vertices are split.
 */
export function long_edges(positions, edges, diameter) {
  const least = 0.04 * diameter;
  // Both sides of a sharp edge have vertices of their own at the same place.
  const places = new Map();
  const place_of = (v) => {
    const key = `${positions[3 * v]},${positions[3 * v + 1]},${positions[3 * v + 2]}`;
    if (!places.has(key)) places.set(key, places.size);
    return places.get(key);
  };
  const ends = Array.from(edges, place_of);
  const neighbours = Array.from({ length: places.size }, () => new Map());  // place -> length of the edge
  for (let i = 0; i < edges.length; i += 2) {
    if (ends[i] === ends[i + 1]) continue;
    const length = Math.hypot(...[0, 1, 2].map((k) => positions[3 * edges[i] + k] - positions[3 * edges[i + 1] + k]));
    neighbours[ends[i]].set(ends[i + 1], length);
    neighbours[ends[i + 1]].set(ends[i], length);
  }
  // A spur may bear spurs.
  for (let round = 0, cut = true; cut && round < 4; ++round) {
    cut = false;
    for (let tip = 0; tip < neighbours.length; ++tip) {
      if (neighbours[tip].size !== 1) continue;
      const chain = [tip];
      let length = 0;
      for (let at = tip, from = -1; length < least;) {
        const next = [...neighbours[at].keys()].find((place) => place !== from);
        length += neighbours[at].get(next);
        [from, at] = [at, next];
        chain.push(at);
        if (neighbours[at].size !== 2) break;
      }
      if (length >= least) continue;
      for (let i = 1; i < chain.length; ++i) {
        neighbours[chain[i - 1]].delete(chain[i]);
        neighbours[chain[i]].delete(chain[i - 1]);
      }
      cut = true;
    }
  }
  const kept = [];
  for (let i = 0; i < edges.length; i += 2) if (neighbours[ends[i]].has(ends[i + 1])) kept.push(edges[i], edges[i + 1]);
  return new Uint32Array(kept);
}

/** The nearest hit of a ray from the side it comes from: {triangle, point, weights} or null. Möller and Trumbore. */
export function pick({ positions, triangles }, origin, direction) {
  let nearest = Infinity;
  let hit = null;
  const [ox, oy, oz] = origin, [dx, dy, dz] = direction;
  for (let t = 0; t < triangles.length; t += 3) {
    const a = triangles[t] * 3, b = triangles[t + 1] * 3, c = triangles[t + 2] * 3;
    const ax = positions[a], ay = positions[a + 1], az = positions[a + 2];
    const ux = positions[b] - ax, uy = positions[b + 1] - ay, uz = positions[b + 2] - az;
    const vx = positions[c] - ax, vy = positions[c + 1] - ay, vz = positions[c + 2] - az;
    const px = dy * vz - dz * vy, py = dz * vx - dx * vz, pz = dx * vy - dy * vx;
    const determinant = ux * px + uy * py + uz * pz;
    if (Math.abs(determinant) < 1e-20) continue;
    const sx = ox - ax, sy = oy - ay, sz = oz - az;
    const u = (sx * px + sy * py + sz * pz) / determinant;
    if (u < 0 || u > 1) continue;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const v = (dx * qx + dy * qy + dz * qz) / determinant;
    if (v < 0 || u + v > 1) continue;
    const distance = (vx * qx + vy * qy + vz * qz) / determinant;
    if (distance <= 0 || distance >= nearest) continue;
    nearest = distance;
    hit = { triangle: t / 3, weights: [1 - u - v, u, v] };
  }
  if (hit) hit.point = [ox + nearest * dx, oy + nearest * dy, oz + nearest * dz];
  return hit;
}

/** A value at a hit, from the corners where it is known; NaN if it is known at none that weigh a third together. */
export function value_at({ triangles }, hit, values) {
  let sum = 0;
  let weight = 0;
  hit.weights.forEach((w, k) => {
    const value = values[triangles[3 * hit.triangle + k]];
    if (Number.isFinite(value)) { sum += w * value; weight += w; }
  });
  return weight >= 0.5 ? sum / weight : NaN;
}

/** The corner that a hit is nearest to. */
export function corner_at({ triangles }, hit) {
  const [a, b, c] = hit.weights;
  return triangles[3 * hit.triangle + (a >= b && a >= c ? 0 : b >= c ? 1 : 2)];
}
