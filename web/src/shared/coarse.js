// SPDX-License-Identifier: Apache-2.0
// A surface with fewer triangles on the same vertices, to show while it moves where no graphics card helps.

/** Indices of about `wanted` triangles: vertices of one cell that face alike are drawn at the first of them. */
export function coarser_triangles({ positions, triangles, normals, box }, wanted) {
  if (triangles.length / 3 <= wanted) return triangles;
  const edge = Math.sqrt((2 * area_of(positions, triangles)) / wanted) || 1;
  const first = new Map();
  const stands_for = new Uint32Array(positions.length / 3);
  for (let v = 0; v < stands_for.length; ++v) {
    let key = facing(normals, 4 * v);
    for (let axis = 0; axis < 3; ++axis) key = key * 4096 + Math.min(4095, Math.floor((positions[3 * v + axis] - box.min[axis]) / edge));
    const known = first.get(key);
    if (known === undefined) first.set(key, v);
    stands_for[v] = known ?? v;
  }
  const kept = new Uint32Array(triangles.length);
  let count = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const a = stands_for[triangles[t]], b = stands_for[triangles[t + 1]], c = stands_for[triangles[t + 2]];
    if (a === b || b === c || c === a) continue;
    kept[count++] = a;
    kept[count++] = b;
    kept[count++] = c;
  }
  return kept.slice(0, count);
}

/** 0 to 5: the axis that a normal is nearest to, so that the two sides of a thin wall stay apart. */
function facing(normals, at) {
  const [x, y, z] = [Math.abs(normals[at]), Math.abs(normals[at + 1]), Math.abs(normals[at + 2])];
  const axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  return 2 * axis + (normals[at + axis] < 0 ? 1 : 0);
}

export function area_of(positions, triangles) {
  let sum = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    sum += Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx) / 2;
  }
  return sum;
}
