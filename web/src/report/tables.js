// SPDX-License-Identifier: Apache-2.0
// Statistics, faces, boxes, regions, scans and check points as tables.
import { h, make_button, table } from '../shared/dom.js';
import { kNone, mm, number, percent, place, plural, short, signed, signed_mm } from '../shared/format.js';
import { verdict_badge } from '../shared/verdict.js';

const severity = { fail: 0, 'not enough data': 1, 'not scanned': 2, pass: 3 };
export const by_severity = (faces) => [...faces].sort((a, b) => (severity[a.verdict] ?? 4) - (severity[b.verdict] ?? 4) || a.index - b.index);

/** A long table starts with `most` rows; a button shows the rest, and print gets them all. */
function shortened(columns, rows, options, most = 40) {
  const all = table(columns, rows, options);
  if (rows.length <= most) return all;
  [...all.querySelectorAll('tbody tr')].slice(most).forEach((row) => row.classList.add('beyond'));
  all.classList.add('shortened');
  const more = h('button', { class: 'more no-print', type: 'button', onclick: () => { all.classList.remove('shortened'); more.remove(); } }, `Show all ${number(rows.length)}`);
  return [all, more];
}

export function statistics_table({ over_area: area, over_points: points, decimals }) {
  const length = (name, sign) => [area, points].map((stats) => (sign ? signed_mm(stats?.[name], decimals) : mm(stats?.[name], decimals)));
  const share = (name) => [area, points].map((stats) => percent(stats?.[name], 2));
  const rows = [
    ['Samples', ...[area, points].map((stats) => number(stats?.count))],
    ['Mean', ...length('mean', true)], ['Median', ...length('median', true)], ['Standard deviation', ...length('sigma')],
    ['\u2003without noise', ...length('sigma_without_noise')], ['RMS', ...length('rms')], ['Mean of absolute values', ...length('mean_absolute')],
    ['Mean of positive', ...length('mean_positive', true)], ['Mean of negative', ...length('mean_negative', true)],
    ['95th percentile, absolute', ...length('p95')], ['99th percentile, absolute', ...length('p99')],
    ['Smallest', ...length('min', true)], ['Largest', ...length('max', true)],
    ['In tolerance', ...share('in_tolerance')], ['Over tolerance', ...share('over_tolerance')], ['Under tolerance', ...share('under_tolerance')],
  ].filter(([, a, b]) => a !== kNone || b !== kNone);
  return table([{ title: '', of: (row) => row[0] }, { title: 'over the area', of: (row) => row[1], numeric: true }, { title: 'over the points', of: (row) => row[2], numeric: true }], rows, { class: 'statistics' });
}

const band = (limits, decimals) => (limits ? `${signed(limits[0], decimals)} \u2026 ${signed(limits[1], decimals)}` : kNone);

/** Without any tolerance there is nothing to judge: three columns less. */
const figure_columns = ({ decimals, verdict }) => [
  verdict.tolerance_given && { title: 'verdict', of: (row) => verdict_badge(row.verdict) },
  { title: 'scanned', of: (row) => percent(row.coverage), numeric: true },
  verdict.tolerance_given && { title: 'in tolerance', of: (row) => percent(row.in_tolerance), numeric: true },
  verdict.tolerance_given && { title: 'tolerance, mm', of: (row) => band(row.tolerance, Math.min(3, decimals)), numeric: true },
  { title: 'mean', of: (row) => signed(row.mean, decimals), numeric: true },
  { title: 'std. dev.', of: (row) => number(row.sigma, decimals), numeric: true },
  { title: 'smallest', of: (row) => signed(row.min, decimals), numeric: true },
  { title: 'largest', of: (row) => signed(row.max, decimals), numeric: true },
  { title: '95 %', of: (row) => number(row.p95, decimals), numeric: true },
  { title: 'area, mm²', of: (row) => short(row.area), numeric: true },
].filter(Boolean);

export const faces_table = (report, go) =>
  shortened([{ title: report.model.cad_faces ? 'CAD face' : 'piece', of: (face) => face.name, class: 'name' }, ...figure_columns(report)], by_severity(report.faces),
    { on_row: go && ((row, face) => make_button(row, `Show ${face.name}`, () => go({ face: face.index }))) });

export const boxes_table = (report) => table([{ title: 'named region', of: (box) => box.name, class: 'name' }, ...figure_columns(report)], report.boxes);

export function regions_table(report, go) {
  const d = report.decimals;
  const columns = [
    { title: '#', of: (region) => number(region.index + 1), numeric: true },
    { title: 'peak, mm', of: (region) => signed(region.peak, d), numeric: true },
    { title: '± 1σ', of: (region) => number(region.peak_standard_error, d), numeric: true },
    { title: 'beyond limit', of: (region) => signed(region.excess, d), numeric: true },
    { title: 'mean', of: (region) => signed(region.mean, d), numeric: true },
    { title: 'area, mm²', of: (region) => short(region.area), numeric: true },
    { title: 'size, mm', of: (region) => region.size?.map(short).join(' × ') ?? kNone, numeric: true },
    { title: 'peak at x, y, z', of: (region) => place(region.peak_at), numeric: true },
    { title: 'face', of: (region) => region.face_name ?? kNone },
    { title: 'more than noise', of: (region) => (region.significant === null || region.significant === undefined ? kNone : region.significant ? 'yes' : 'no') },
  ];
  const found = report.regions_found ?? report.regions.length;
  const note = found > report.regions.length && h('p', { class: 'soft' }, `The ${number(report.regions.length)} largest of ${number(found)}.`);
  const rows = shortened(columns, report.regions, { on_row: go && ((row, region) => make_button(row, `Show region ${region.index + 1}`, () => go({ region: region.index }))) });
  return [note, rows];
}

const status_class = (status) => (status === 'accepted' ? 'pass' : ['rejected', 'failed', 'dropped'].includes(status) ? 'fail' : 'not enough data');
export const status_badge = (status) => {
  const badge = verdict_badge(status_class(status));
  badge.lastChild.textContent = status;
  return badge;
};

export function scans_table(report) {
  const d = report.decimals;
  const columns = [
    { title: '#', of: (scan) => number(scan.index), numeric: true }, { title: 'scan', of: (scan) => scan.name, class: 'name' },
    { title: 'status', of: (scan) => status_badge(scan.status) },
    { title: 'points', of: (scan) => number(scan.points), numeric: true }, { title: 'on the part', of: (scan) => number(scan.segment_points), numeric: true },
    { title: 'main source of', of: (scan) => percent(scan.share_of_part), numeric: true }, { title: 'score', of: (scan) => number(scan.score, 2), numeric: true },
    { title: 'links', of: (scan) => number(scan.links), numeric: true }, { title: 'best overlap', of: (scan) => percent(scan.best_overlap, 0), numeric: true },
    { title: 'residual, mm', of: (scan) => number(scan.residual, d), numeric: true }, { title: 'position 1σ', of: (scan) => number(scan.position_sigma, d), numeric: true },
    { title: 'rotation 1σ', of: (scan) => (typeof scan.rotation_sigma_deg === 'number' ? `${number(scan.rotation_sigma_deg, 3)}°` : kNone), numeric: true },
    { title: 'noise, mm', of: (scan) => number(scan.noise_sigma, d), numeric: true },
  ];
  return shortened(columns, report.scans, {}, 100);
}

/** What was not used, and why; null if all was. */
export function not_used(report) {
  const scans = report.scans.filter((scan) => scan.status !== 'accepted');
  const links = report.graph?.links?.filter((link) => !link.linked) ?? [];
  if (!scans.length && !links.length) return null;
  return h('div', { class: 'not-used' }, h('h3', null, 'Not used, and why'),
    h('ul', null, scans.map((scan) => h('li', null, status_badge(scan.status), h('div', null, h('b', null, scan.name), scan.reason_code && h('code', null, scan.reason_code), h('p', null, scan.reason || 'no reason given'))))),
    links.length > 0 && h('p', { class: 'soft' }, `${plural(links.length, 'pair of scans shares', 'pairs of scans share')} too little surface to be linked: `, links.slice(0, 12).map((link) => `${name_of(report, link.a)} and ${name_of(report, link.b)} (${percent(link.overlap, 0)})`).join(', '), links.length > 12 ? ' …' : '.'));
}

const name_of = (report, index) => report.scans.find((scan) => scan.index === index)?.name ?? `scan ${index}`;

export function reference_table({ reference, decimals }) {
  const columns = [
    { title: 'point', of: (point) => point.name }, { title: 'x, y, z', of: (point) => place(point.point, 2), numeric: true },
    { title: 'deviation, mm', of: (point) => signed(point.deviation, decimals), numeric: true }, { title: '± 1σ', of: (point) => number(point.standard_error, decimals), numeric: true },
    { title: 'own 1σ', of: (point) => number(point.sigma, decimals), numeric: true }, { title: 'status', of: (point) => point.status },
    { title: 'more than noise', of: (point) => (point.significant === null ? kNone : point.significant ? 'yes' : 'no') },
  ];
  return shortened(columns, reference.points, {});
}
