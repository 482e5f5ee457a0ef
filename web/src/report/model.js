// SPDX-License-Identifier: Apache-2.0
// The report's data as the panels want them, read from the two script elements of the page.
import { decimals_for } from '../shared/format.js';
import { unpack } from '../shared/packed.js';
import { read_surface } from '../shared/surface.js';

const kNone = 65535;

function json_of(id) {
  const element = document.getElementById(id);
  return element ? JSON.parse(element.textContent) : null;
}

/** report.json, and the number of decimals that mean something in it. */
export function read_report() {
  const report = json_of('asbuilt-report');
  if (!report) return null;
  const scale = Math.min(...[report.over_area?.sigma, report.measured?.noise_sigma].filter((value) => value > 0));
  return { ...report, decimals: Math.max(1, decimals_for(Number.isFinite(scale) ? scale : null)) };
}

/** Categories with 65535 for none, as numbers with NaN for none. */
const with_nan = (values) => values && Float32Array.from(values, (value) => (value === kNone ? NaN : value));

/** The scene with unpacked arrays; null without one. Missing arrays are null. */
export function read_scene() {
  const scene = json_of('asbuilt-scene');
  if (!scene) return null;
  const surface = read_surface(scene);
  const count = surface.positions.length / 3;
  const values = {};
  for (const name of ['deviation', 'sigma', 'support', 'scan', 'region']) {
    values[name] = unpack(scene[name], name);
    if (values[name] && values[name].length !== count) throw new Error(`${name} has ${values[name].length} values for ${count} vertices`);
  }
  values.scan = with_nan(values.scan);
  values.region = with_nan(values.region);
  values.face = surface.faces && faces_of_vertices(surface);
  return { ...surface, ...values, poses: scene.poses ?? [] };
}

/** A face for each vertex. Triangles are turned so that their last corner, which a flat colour is taken from, is on their face. */
function faces_of_vertices({ triangles, faces, positions }) {
  const of_vertex = new Float32Array(positions.length / 3).fill(NaN);
  for (let t = 0; t < faces.length; ++t) {
    for (let k = 0; k < 3; ++k) if (Number.isNaN(of_vertex[triangles[3 * t + k]])) of_vertex[triangles[3 * t + k]] = faces[t];
  }
  for (let t = 0; t < faces.length; ++t) {
    for (let turn = 0; turn < 2 && of_vertex[triangles[3 * t + 2]] !== faces[t]; ++turn) {
      const [a, b, c] = triangles.subarray(3 * t, 3 * t + 3);
      triangles.set([b, c, a], 3 * t);
    }
  }
  return of_vertex;
}
