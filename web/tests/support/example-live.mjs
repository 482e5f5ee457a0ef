// SPDX-License-Identifier: Apache-2.0
// A live session with known contents: states as docs/live-protocol.md describes them, on the bent plate.
import { bent_plate, packed, packed_positions } from './example-surface.mjs';

export function example_part(triangles = 6000) {
  const mesh = bent_plate(triangles);
  return { mesh, surface: { schema: 1, vertices: packed_positions(mesh.positions), triangles: packed('u32', Uint32Array.from(mesh.triangles)), faces: packed('u32', Uint32Array.from(mesh.faces)) } };
}

export function sensor_position(i) {
  const azimuth = 0.4 + i * 2.399963, elevation = 0.75 * Math.sin(1.7 * i);
  return [-25 + 260 * Math.cos(azimuth) * Math.cos(elevation), 60 + 260 * Math.sin(azimuth) * Math.cos(elevation), 15 + 260 * Math.sin(elevation)];
}

const direction_from = (position) => { const d = [-25, 60, 15].map((c, k) => c - position[k]); const l = Math.hypot(...d); return d.map((x) => x / l); };

/** Per-vertex values after scans 0 … count-1. */
export function example_values(mesh, count, revision) {
  const n = mesh.vertices.length;
  const support = new Uint16Array(n), deviation = new Float32Array(n).fill(NaN), newest = new Uint16Array(n).fill(65535);
  for (let i = 0; i < count; ++i) {
    const look = direction_from(sensor_position(i));
    mesh.vertices.forEach(({ normal }, v) => {
      if (normal[0] * look[0] + normal[1] * look[1] + normal[2] * look[2] > -0.45) return;
      ++support[v];
      newest[v] = i;
      deviation[v] = 0.2 * Math.sin(mesh.vertices[v].s / 25) + 0.1 * Math.cos(mesh.vertices[v].y / 17);
    });
  }
  return { json: { schema: 1, revision, support: packed('u16', support), deviation: packed('f32', deviation), newest: packed('u16', newest) }, support, deviation, newest };
}

/** The state after `count` scans; `more` overwrites fields. */
export function example_state(mesh, count, more = {}) {
  const { support } = example_values(mesh, count, count);
  const seen = (least) => (100 * support.filter((value) => value >= least).length) / support.length;
  const scans = Array.from({ length: count }, (_, i) => ({
    index: i, file: `scan_${String(i).padStart(2, '0')}.ply`, name: `scan_${String(i).padStart(2, '0')}`, index_in_file: 0, instance: 1, arrival: i, status: 'accepted', provisional: i === count - 1,
    reason_code: '', reason: '', sentence: `scan_${String(i).padStart(2, '0')}: accepted, ${(20 / (1 + i)).toFixed(1)} % of the surface, all of it new.`, points: 151234, part_points: 61021, noise_sigma: 0.11, spacing: 0.92, score: 0.81,
    new_percent: 20 / (1 + i), covers_percent: 22.4, component: 0, refined: true, model_from_scan: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    viewpoint: sensor_position(i), view_direction: direction_from(sensor_position(i)), links: i ? [{ to: i - 1, overlap: 0.42, firmness: 'firm', used: true }] : [],
    weak_directions: i === 1 ? [{ kind: 'translation', direction: [0, 1, 0], sigma: 0.8, unheld: false, text: 'may slide along y' }] : [], seconds: 1.4 }));
  const links = scans.slice(1).map((scan, i) => ({ a: i, b: i + 1, overlap: 0.42, used: true, firmness: ['firm', 'fair', 'weak'][i % 3], rms: 0.14 }));
  for (let i = 2; i < count; i += 2) links.push({ a: i - 2, b: i, overlap: 0.3, used: true, firmness: 'fair', rms: 0.15 });
  const view = (i) => { const position = sensor_position(count + i); return { position, direction: direction_from(position), target: [-25, 60, 15], distance: 260, gain_percent: 14.2 - 4 * i, gain_area: 9310, overlap: 0.35, purpose: 'coverage', text: `from ${['+x', '\u2212y', '+z'][i]}, 20° above: about ${14 - 4 * i} % new surface` }; };
  return {
    schema: 1, revision: count + 1, surface_revision: count, phase: 'waiting', busy_with: null,
    now: { level: 'act', text: count ? 'Next: stand 260 mm from the part, from +x, 20° above. About 14 % new surface.' : 'Make the first scan: stand anywhere that shows most of the part.', sound: null },
    model: { path: 'bent_plate.step', sha256: 'ab12', unit: 'mm', diameter: 196, min: [-80, 0, -24], max: [24, 120, 60], triangles: 6000, symmetry: 'none', faces: 10 },
    watch: '/data/scans', output: '/data/live', coverage: { percent: seen(1), twice_percent: seen(2), coverable_percent: 96.1, scanned_area: 30000, total_area: 41230 },
    scans, links, pieces: count ? [{ scans: scans.map((scan) => scan.index), percent: seen(1), join: null }] : [],
    holes: count ? [{ area: 1203, percent: 1.8, centre: [24, 60, 30], normal: [1, 0, 0], extent: 60, face: 2, reachable: true, text: '12 cm² near (24, 60, 30), facing +x, CAD face 2' },
      { area: 400, percent: 0.9, centre: [-80, 60, -22], normal: [-1, 0, 0], extent: 90, face: 8, reachable: false, text: '4 cm² near (\u221280, 60, \u221222), facing \u2212x, CAD face 8' }] : [],
    views: [0, 1, 2].map(view), sensor: { half_angle: 24, near: 100, far: 600, distance: 260, source: 'learnt' }, unreachable_percent: 3.9,
    refinement: { state: 'done', scans: count, rms: 0.13, dropped: 0 }, notes: [{ revision: 1, level: 'info', file: 'notes.docx', text: 'notes.docx is ignored: it is no scan' }], removed: [], duplicates: [],
    result: { state: 'none', folder: null, text: '' }, ...more,
  };
}

/** The same state with its last scan rejected. */
export function with_rejected_last(state, text = 'the part is not in it') {
  const last = state.scans.length - 1;
  const scans = state.scans.map((scan, i) => (i !== last ? scan : { ...scan, status: 'rejected', provisional: false, reason_code: 'low_score', reason: text, sentence: `${scan.name}: rejected, ${text}.`, component: null, viewpoint: null, view_direction: null, links: [], new_percent: null, model_from_scan: null }));
  return { ...state, scans, links: state.links.filter((link) => link.a !== last && link.b !== last), pieces: state.pieces.map((piece) => ({ ...piece, scans: piece.scans.filter((i) => i !== last) })),
    now: { level: 'bad', headline: `${scans[last].name} was not used: ${text}.`, text: `${scans[last].name} was not used: ${text}. Scan this side again.`, sound: 'rejected' } };
}
