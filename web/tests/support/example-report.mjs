// SPDX-License-Identifier: Apache-2.0
// A report with known contents: the bent plate with warp, two dents, a boss, a part of it unscanned, 8 scans + 2 rejected.
import { bent_plate, packed, packed_positions, randoms } from './example-surface.mjs';

const tolerance = [-0.3, 0.3];
const dents = [
  { s: 40, y: 40, side: 1, radius: 13, height: -0.72 },
  { s: 155, y: 85, side: 1, radius: 11, height: 0.55 },
  { s: 30, y: 92, side: 0, radius: 9, height: -0.48 },
];

/** The planted deviation, mm, without noise. */
export function true_deviation({ s, y, side }) {
  let value = 0.06 * Math.sin(s / 40) * Math.cos(y / 35);
  for (const dent of dents) {
    const r = Math.hypot(s - dent.s, y - dent.y) / dent.radius;
    if (side === dent.side && r < 1) value += dent.height * (1 - r * r) ** 2;
  }
  return value;
}

const sensors = Array.from({ length: 8 }, (_, i) => {
  const azimuth = (i / 8) * 2 * Math.PI + 0.3;
  const elevation = i % 2 ? 0.55 : -0.35;
  return [220 * Math.cos(azimuth) * Math.cos(elevation) - 20, 60 + 220 * Math.sin(azimuth) * Math.cos(elevation), 220 * Math.sin(elevation)];
});

function seen_by({ point, normal, s, y, side }, sensor) {
  if (side === 0 && Math.hypot(s - 92, y - 36) < 38) return false; // a corner that no scan reached
  if (side === 3 && s > 100) return false;
  const to = sensor.map((value, k) => value - point[k]);
  return to.reduce((sum, value, k) => sum + value * normal[k], 0) / Math.hypot(...to) > 0.25;
}

function statistics(values, noise2) {
  const sorted = Float64Array.from(values).sort();
  const n = sorted.length;
  if (!n) return null;
  const mean = sorted.reduce((a, b) => a + b, 0) / n;
  const square = sorted.reduce((a, b) => a + b * b, 0) / n;
  const sides = [1, -1].map((sign) => sorted.filter((value) => sign * value > 0));
  const average = (list) => (list.length ? list.reduce((a, b) => a + b, 0) / list.length : null);
  const sizes = Float64Array.from(sorted, Math.abs).sort();
  const share = (test) => sorted.filter(test).length / n;
  const variance = square - mean * mean;
  return { count: n, min: sorted[0], max: sorted[n - 1], mean, mean_absolute: average(sizes), rms: Math.sqrt(square), sigma: Math.sqrt(variance),
    sigma_without_noise: Math.sqrt(Math.max(0, variance - noise2)), mean_positive: average(sides[0]), mean_negative: average(sides[1]),
    median: sorted[n >> 1], p95: sizes[Math.floor(0.95 * n)], p99: sizes[Math.floor(0.99 * n)],
    in_tolerance: share((v) => v >= tolerance[0] && v <= tolerance[1]), over_tolerance: share((v) => v > tolerance[1]), under_tolerance: share((v) => v < tolerance[0]) };
}

/** {report, scene, mesh, deviation}. */
export function example_report({ triangles = 6000 } = {}) {
  const mesh = bent_plate(triangles);
  const random = randoms(7);
  const n = mesh.vertices.length;
  const deviation = new Float32Array(n).fill(NaN), sigma = new Float32Array(n).fill(NaN);
  const support = new Uint16Array(n), scan = new Uint16Array(n).fill(65535), region = new Uint16Array(n).fill(65535);
  const seen = sensors.map(() => 0);
  const shared = new Map();
  mesh.vertices.forEach((vertex, v) => {
    const views = sensors.flatMap((sensor, i) => (seen_by(vertex, sensor) ? [i] : []));
    support[v] = views.length;
    if (!views.length) return;
    sigma[v] = 0.03 / Math.sqrt(views.length);
    deviation[v] = true_deviation(vertex) + sigma[v] * (random() + random() + random() - 1.5) * 2;
    scan[v] = views[Math.floor((vertex.s + vertex.y) / 37) % views.length];
    views.forEach((a) => { ++seen[a]; views.forEach((b) => { if (a < b) shared.set(`${a} ${b}`, (shared.get(`${a} ${b}`) ?? 0) + 1); }); });
    dents.forEach((dent, i) => {
      const out = deviation[v] < tolerance[0] || deviation[v] > tolerance[1];
      if (out && dent.side === vertex.side && Math.hypot(vertex.s - dent.s, vertex.y - dent.y) < dent.radius) region[v] = i;
    });
  });
  const scene = { schema: 1, vertices: packed_positions(mesh.positions), triangles: packed('u32', Uint32Array.from(mesh.triangles)),
    faces: packed('u32', Uint32Array.from(mesh.faces)), deviation: packed('f32', deviation), sigma: packed('f32', sigma), support: packed('u16', support),
    scan: packed('u16', scan), region: packed('u16', region),
    poses: sensors.map((viewpoint, i) => ({ scan: i, model_from_scan: [1, 0, 0, viewpoint[0], 0, 1, 0, viewpoint[1], 0, 0, 1, viewpoint[2], 0, 0, 0, 1], viewpoint })) };
  return { report: report_of(mesh, { deviation, sigma, support, scan, region, seen, shared, tolerance }), scene, mesh, deviation };
}

function report_of(mesh, { deviation, sigma, scan, region, seen, shared }) {
  const n = mesh.vertices.length;
  const ids = Array.from({ length: n }, (_, v) => v);
  const known = ids.filter((v) => Number.isFinite(deviation[v]));
  const noise2 = known.reduce((sum, v) => sum + sigma[v] ** 2, 0) / known.length;
  const all = statistics(known.map((v) => deviation[v]), noise2);
  const vertex_face = new Int32Array(n);
  mesh.faces.forEach((face, t) => { for (let k = 0; k < 3; ++k) vertex_face[mesh.triangles[3 * t + k]] = face; });
  const names = ['base, outer', 'bend, outer', 'upright, outer', 'base, inner', 'bend, inner', 'upright, inner', 'side -y', 'side +y', 'end -x', 'end +z'];
  const mean_of = (list, get) => [0, 1, 2].map((k) => list.reduce((sum, v) => sum + get(v)[k], 0) / list.length);
  const faces = names.map((name, index) => {
    const spots = ids.filter((v) => vertex_face[v] === index);
    const scanned = spots.filter((v) => Number.isFinite(deviation[v]));
    const stats = statistics(scanned.map((v) => deviation[v]), noise2);
    const coverage = scanned.length / spots.length;
    const verdict = coverage === 0 ? 'not scanned' : stats.in_tolerance < 0.99 ? 'fail' : coverage < 0.8 ? 'not enough data' : 'pass';
    return { index, cad_face: index, name, area: 8000 - 430 * index, coverage, spots: spots.length, spots_scanned: scanned.length, verdict, tolerance,
      in_tolerance: stats?.in_tolerance ?? null, mean: stats?.mean ?? null, sigma: stats?.sigma ?? null, rms: stats?.rms ?? null, min: stats?.min ?? null,
      max: stats?.max ?? null, p95: stats?.p95 ?? null, centre: mean_of(spots, (v) => mesh.vertices[v].point), normal: mean_of(spots, (v) => mesh.vertices[v].normal) };
  });
  const regions = dents.map((dent, index) => {
    const spots = ids.filter((v) => region[v] === index);
    const peak = spots.reduce((best, v) => (Math.abs(deviation[v]) > Math.abs(deviation[best]) ? v : best), spots[0]);
    const limit = dent.height < 0 ? tolerance[0] : tolerance[1];
    return { index, area: spots.length * 1.9, spots: spots.length, size: [dent.radius * 1.3, dent.radius * 1.2, 0.4], centre: mean_of(spots, (v) => mesh.vertices[v].point),
      peak: deviation[peak], peak_at: mesh.vertices[peak].point, peak_standard_error: 0.012, mean: deviation[peak] * 0.7, limit, excess: deviation[peak] - limit,
      face: vertex_face[peak], face_name: names[vertex_face[peak]], significant: true };
  });
  const count = (verdict) => faces.filter((face) => face.verdict === verdict).length;
  const high = 0.8, bins = 64;
  const histogram = Array(bins).fill(0);
  for (const v of known) ++histogram[Math.min(bins - 1, Math.max(0, Math.floor(((deviation[v] + high) / (2 * high)) * bins)))];
  const links = [...shared].map(([pair, both]) => {
    const [a, b] = pair.split(' ').map(Number);
    return { a, b, overlap: both / Math.min(seen[a], seen[b]), linked: both / Math.min(seen[a], seen[b]) > 0.3, residual: 0.031 + 0.002 * a, pairs: both * 7 };
  }).filter((link) => link.overlap > 0.08).map((link) => (link.linked ? link : { ...link, residual: null, pairs: null }));
  const scan_row = (index, extra) => ({ index, name: `scan_${String(index).padStart(2, '0')}`, path: `scans/scan_${String(index).padStart(2, '0')}.ply`,
    sha256: '7f3a'.repeat(16), status: 'accepted', reason_code: '', reason: '', points: 412003 - 9000 * index, segment_points: 98123 - 2100 * index, noise_sigma: 0.03,
    spacing: 0.4, viewpoint: [0, 0, 0], score: 0.93 - 0.01 * index, visible_share: 0.41, free_space_violations: 0.001, normal_agreement: 0.99, margin: 0.4, component: 0,
    links: links.filter((link) => link.linked && (link.a === index || link.b === index)).length, best_overlap: 0.72, residual: 0.031 + 0.001 * index, position_sigma: 0.004,
    rotation_sigma_deg: 0.002, share_of_part: seen[index] / n || 0, spots: ids.filter((v) => scan[v] === index).length, model_from_scan: null, ...extra });
  const none = { viewpoint: null, component: null, links: 0, best_overlap: null, residual: null, position_sigma: null, rotation_sigma_deg: null, share_of_part: 0, spots: 0, segment_points: 0 };
  const scans = sensors.map((_, i) => scan_row(i, {}));
  scans.push(scan_row(8, { ...none, status: 'rejected', reason_code: 'low_score', score: 0.12, normal_agreement: 0.41, margin: 0.01,
    reason: 'the best pose explains 12 % of what should be visible, 35 % is required' }));
  scans.push(scan_row(9, { ...none, status: 'failed', reason_code: 'too_few_points', points: 37, score: null, visible_share: null, normal_agreement: null, margin: null,
    reason: 'scan_09.ply holds 37 points, at least 50 are needed' }));
  const coverage = known.length / n;
  return {
    asbuilt: { version: '0.1.0', report_schema: 1 },
    command: { verb: 'reconstruct', arguments: ['reconstruct', 'bent_plate.step', 'scans/', '-o', 'result', '--tolerance', '-0.3,0.3'] }, unit: 'mm',
    sign: 'positive: outside the material',
    verdict: { part: 'fail', reason: `${count('fail')} of ${faces.length} faces are out of tolerance`, tolerance_given: true, pass: count('pass'), fail: count('fail'),
      not_enough_data: count('not enough data'), not_scanned: count('not scanned') },
    summary: `The part is out of tolerance: ${count('fail')} of ${faces.length} faces fail. ${(100 * coverage).toFixed(1)} % of the surface was scanned; the standard deviation from the model is ${all.sigma.toFixed(3)} mm.`,
    notes: ['2 of 10 scans were not used'],
    model: { path: 'parts/bent_plate.step', sha256: '9f2b5e3c7d1a4f60'.repeat(4), triangles: mesh.triangles.length / 3, diameter: 196.4, area: 41230.5, open_edges: 0, cad_faces: faces.length,
      symmetry: 'none', box: { min: [-80, 0, -24], max: [24, 120, 60] } },
    measured: { path: null, sha256: null, points: 218440, far_points: 31, spacing: 0.42, noise_sigma: 0.03 },
    alignment: { method: 'as refined', detail: 'best fit of all segments to the CAD: one rigid motion, robust, without scale', on: 'all',
      model_from_given: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], rms_before: null, rms_after: null },
    tolerance: { low: tolerance[0], high: tolerance[1], required_share: 0.99, minimum_coverage: 0.8, source: '-0.3,0.3', rows: [] },
    coverage: { share: coverage, area: 41230.5 * coverage, spots: n, spots_scanned: known.length, support_mean: 2.6 },
    significance: { confidence: 0.997, significant_share: 0.214, standard_error_median: 0.018 },
    over_area: all, over_points: { ...all, count: 218409, min: all.min - 0.06, max: all.max + 0.05 },
    histogram: { low: -high, high, bins, over_area: histogram, below: 0, above: 0, note: 'shares of the scanned area are over_area / sum; bins are equally wide' },
    colours: null, faces,
    boxes: [{ name: 'sealing rim', min: -0.05, max: 0.08, area: 820, coverage: 0.97, spots: 488, spots_scanned: 473, verdict: 'pass', tolerance: [-0.1, 0.1], in_tolerance: 1, mean: 0.01, sigma: 0.02, rms: 0.022, p95: 0.05 }],
    regions, scans, graph: { links, components: [[0, 1, 2, 3, 4, 5, 6, 7]] },
    refinement: [{ component: 0, fixed_scan: 0, iterations: 14, rms_before: 0.34, rms_after: 0.033, converged: true, gauge: 'best_fit' }],
    reference: { path: 'probe.csv', sha256: 'ab12'.repeat(16), search_distance: 1.26, statistics: { ...all, count: 1, mean: 0.013, rms: 0.013 },
      points: [{ name: 'P1', point: [-40, 20, -24], sigma: 0.02, deviation: 0.013, standard_error: 0.011, distance: 0.013, status: 'measured', significant: false },
        { name: 'P2', point: [10, 20, 50], sigma: null, deviation: null, standard_error: null, distance: null, status: 'not scanned', significant: null }] },
    options: { seed: 0, score_distance: 0, overlap_low: 0.15 },
    files: { reconstruction: 'reconstruction.ply', mesh: null, points_csv: 'points.csv', faces_csv: 'faces.csv', regions_csv: 'regions.csv', scans_csv: 'scans.csv', views: ['views/front.png'], timing: 'timing.json', result: 'result.json' },
  };
}

/** The page with the data in it, as the program writes it. */
export function report_html(page, { report, scene }) {
  const element = (id, value) => `<script type="application/json" id="${id}">${JSON.stringify(value).replaceAll('<', '\\u003c')}</script>`;
  const parts = page.split('<!-- asbuilt:data -->');
  if (parts.length !== 2) throw new Error('the page has no single place for its data');
  return parts.join(`${element('asbuilt-report', report)}\n${element('asbuilt-scene', scene)}`);
}
