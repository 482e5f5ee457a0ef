// SPDX-License-Identifier: Apache-2.0
// What went in and how: enough to make the same report again.
import { h, table } from '../shared/dom.js';
import { kNone, mm, number, percent, place, short } from '../shared/format.js';

const rows = (pairs) => h('dl', { class: 'pairs' }, pairs.filter(([, value]) => value !== null && value !== undefined && value !== false && value !== '').map(([name, value]) => h('div', null, h('dt', null, name), h('dd', null, value))));

const shell_word = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

const is_identity = (matrix) => matrix?.every((value, i) => Math.abs(value - (i % 5 === 0 ? 1 : 0)) < 1e-12);

export function provenance(report) {
  const { model, measured, alignment, tolerance, significance, refinement, reference, asbuilt, command } = report;
  return h('div', { class: 'provenance' },
    block('Made by', rows([['Program', `asbuilt ${asbuilt.version}`], ['Unit', report.unit ?? 'mm'], ['Sign of deviations', report.sign]])),
    block('Model', rows([['Triangles of the outer skin', number(model.triangles)], ['CAD faces', model.cad_faces ? number(model.cad_faces) : 'none: a mesh'], ['Diameter', mm(model.diameter, 2)], ['Area', `${short(model.area)} mm²`],
      ['Box', model.box && `${place(model.box.min)} to ${place(model.box.max)}`], ['Closed', model.open_edges ? `no, ${number(model.open_edges)} open edges: the sign is unsure there` : 'yes'], ['Symmetry', model.symmetry]])),
    block('Measured', rows([['Points', number(measured.points)], ['Spacing', mm(measured.spacing, 3)], ['Sensor noise, 1σ', mm(measured.noise_sigma, 4)], ['Far from the part, in no figure', number(measured.far_points)],
      ['Significant area', typeof significance?.significant_share === 'number' && `${percent(significance.significant_share)} at ${percent(significance.confidence)} confidence`], ['Median standard error', significance && mm(significance.standard_error_median, 4)]])),
    block('Alignment', rows([['Method', alignment.method], ['How', alignment.detail], ['On', Array.isArray(alignment.on) ? alignment.on.join(', ') : alignment.on],
      ['Motion applied', is_identity(alignment.model_from_given) ? 'none' : matrix(alignment.model_from_given)], ['RMS before, after', typeof alignment.rms_after === 'number' ? `${mm(alignment.rms_before, 4)}, ${mm(alignment.rms_after, 4)}` : null],
      ...(refinement ?? []).map((r) => [`Refinement${refinement.length > 1 ? `, piece ${r.component + 1}` : ''}`, `${number(r.iterations)} iterations, RMS ${mm(r.rms_before, 3)} to ${mm(r.rms_after, 3)}, ${r.converged ? 'converged' : 'not converged'}`])])),
    block('Tolerance', tolerance ? rows([['Limits', tolerance.low === null ? 'from the file alone' : `${number(tolerance.low, 3)} to ${number(tolerance.high, 3)} mm`], ['Source', tolerance.source], ['Must be within', percent(tolerance.required_share)], ['Must be scanned', percent(tolerance.minimum_coverage)], ['Rows of the file', tolerance.rows?.length ? number(tolerance.rows.length) : null]]) : h('p', { class: 'soft' }, 'None was given.')),
    block('Command', h('code', { class: 'command' }, ['asbuilt', ...command.arguments].map(shell_word).join(' ')), 'wide'),
    block('Options', rows(Object.entries(report.options ?? {}).map(([name, value]) => [name, typeof value === 'object' ? JSON.stringify(value) : String(value)])), 'wide all-options'),
    block('Files', files_table({ model, measured, reference, scans: report.scans }), 'wide'));
}

const block = (title, content, kind = '') => h('section', { class: `block ${kind}` }, h('h3', null, title), content);

const matrix = (values) => h('pre', null, [0, 1, 2, 3].map((row) => values.slice(4 * row, 4 * row + 4).map((value) => number(value, 6).padStart(14)).join('')).join('\n'));

function files_table({ model, measured, reference, scans }) {
  const files = [['model', model], ['measured', measured], ['check points', reference], ...(scans ?? []).map((scan) => ['scan', scan])]
    .filter(([, file]) => file?.path).map(([role, file]) => ({ role, ...file }));
  const unique = files.filter((file, i) => files.findIndex((other) => other.path === file.path && other.role === file.role) === i);
  return table([{ title: 'role', of: (file) => file.role }, { title: 'file', of: (file) => file.path, class: 'path' }, { title: 'SHA-256', of: (file) => file.sha256 ?? kNone, class: 'hash' }], unique);
}
