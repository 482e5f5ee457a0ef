// SPDX-License-Identifier: Apache-2.0
// The top of the report: the verdict, one sentence, the figures that everybody asks for.
import { h } from '../shared/dom.js';
import { file_name, mm, number, percent, plural, signed_mm } from '../shared/format.js';
import { verdict_class, verdict_icon } from '../shared/verdict.js';

const figure = (value, label, detail) =>
  h('div', { class: 'figure' }, h('dt', null, label), h('dd', null, value, detail && h('small', null, detail)));

/** Of the spots and of the regions, whose peaks lie between spots. */
const worst = (stats, regions) => {
  if (!stats || typeof stats.min !== 'number') return null;
  const peaks = (regions ?? []).filter((region) => region.significant !== false).map((region) => region.peak);
  return [stats.min, stats.max, ...peaks].reduce((far, value) => (Math.abs(value) > Math.abs(far) ? value : far));
};

export function head(report) {
  const { verdict, over_area: area, coverage, decimals } = report;
  const word = verdict.part ?? 'no tolerance given';
  return h('header', { class: 'head' },
    h('div', { class: 'title' },
      h('p', { class: 'soft' }, 'Inspection report'),
      h('h1', null, file_name(report.model.path)), report.summary && h('p', { class: 'summary' }, report.summary)),
    h('div', { class: `verdict ${verdict_class(verdict.part)}` },
      verdict_icon(verdict.part), h('div', null, h('strong', { id: 'verdict' }, word), verdict.reason && h('p', null, verdict.reason))),
    h('dl', { class: 'figures' }, figures(report, area, coverage, decimals)),
    notes(report));
}

function figures(report, area, coverage, decimals) {
  const accepted = (report.scans ?? []).filter((scan) => scan.status === 'accepted').length;
  const list = [];
  if (typeof area?.in_tolerance === 'number') list.push(figure(percent(area.in_tolerance), 'within tolerance', 'of the scanned area'));
  list.push(figure(percent(coverage?.share), 'scanned', coverage?.support_mean > 0 ? `${number(coverage.support_mean, 1)} scans a spot on average` : null));
  list.push(figure(signed_mm(area?.mean, decimals), 'mean deviation', 'over the area'));
  list.push(figure(mm(area?.sigma, decimals), 'standard deviation', typeof area?.sigma_without_noise === 'number' ? `${mm(area.sigma_without_noise, decimals)} without noise` : null));
  list.push(figure(mm(area?.p95, decimals), '95 % stay below', 'absolute deviation'));
  list.push(figure(signed_mm(worst(area, report.regions), decimals), 'largest deviation', plural(report.regions_found ?? report.regions?.length ?? 0, 'region', 'regions') + (report.verdict.tolerance_given ? ' out of tolerance' : ' stand out')));
  if (report.scans?.length) list.push(figure(`${accepted} of ${report.scans.length}`, 'scans used', scans_detail(report)));
  return list;
}

function scans_detail(report) {
  const pieces = report.graph?.components?.length ?? 0;
  return pieces > 1 ? `in ${pieces} pieces that do not hang together` : pieces === 1 ? 'all linked' : null;
}

const notes = (report) => report.notes?.length > 0 && h('ul', { class: 'notes' }, report.notes.map((note) => h('li', null, note)));
