// SPDX-License-Identifier: Apache-2.0
// The report page: text first, the 3D view once the browser has shown it, the pictures last.
import { h } from './shared/dom.js';
import { file_name } from './shared/format.js';
import { head } from './report/head.js';
import { histogram } from './report/histogram.js';
import { read_report, read_scene } from './report/model.js';
import { Pictures } from './report/pictures.js';
import { pose_graph } from './report/pose-graph.js';
import { provenance } from './report/provenance.js';
import { boxes_table, faces_table, not_used, reference_table, regions_table, scans_table, statistics_table } from './report/tables.js';
import { ReportView } from './report/view.js';

const section = (title, ...content) => h('section', { class: 'card' }, h('h2', null, title), ...content);

function build(report, scene) {
  const view = scene && new ReportView(report, scene);
  const pictures = view && new Pictures(view);
  const go = view && ((what) => view.go(what));
  document.title = `${file_name(report.model.path)}: ${report.verdict.part ?? 'inspection report'}`;
  const page = document.getElementById('page');
  page.append(...[
    head(report),
    view ? view.element : h('p', { class: 'problem' }, 'This report carries no surface to show in 3D; all figures are below.'),
    pictures && section('Views', pictures.element),
    h('div', { class: 'two' }, report.histogram && section('Distribution', histogram(report)), section('Statistics', statistics_table(report))),
    report.regions?.length > 0 && section(report.verdict.tolerance_given ? 'Regions out of tolerance' : 'Conspicuous regions', regions_table(report, go)),
    report.boxes?.length > 0 && section('Named regions', boxes_table(report)),
    report.faces?.length > 0 && section(report.model.cad_faces ? 'Faces' : 'Pieces between sharp edges', faces_table(report, go)),
    report.reference && section('Independent check points', reference_table(report)),
    report.scans?.length > 0 && section('Scans', scans_table(report), h('div', { class: 'two graph-row' }, pose_graph(report, scene), not_used(report))),
    section('Provenance', provenance(report)),
    h('footer', null, `asbuilt ${report.asbuilt.version} · lengths in mm, model frame · ${report.sign ?? ''}`),
  ].filter(Boolean));
  return { view, pictures };
}

function without_view(view, error) {
  view.element.replaceChildren(h('p', { class: 'problem' }, `The 3D view cannot be shown: ${error.message}. All figures are below.`));
}

/** Lets the browser show what it has before the heavy part starts. */
const next_picture = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));

async function main() {
  const report = read_report();
  if (!report) {
    document.getElementById('page').append(h('p', { class: 'problem' }, 'This page holds no report: it is the form that asbuilt fills in.'));
    return;
  }
  const scene = read_scene();
  const { view, pictures } = build(report, scene);
  if (view) {
    await next_picture();
    try {
      view.start();
      window.asbuilt = { view, report };
      await next_picture();
      document.documentElement.dataset.view = 'ready';
      await pictures.draw();
    } catch (error) {
      without_view(view, error);
      pictures.element.parentElement.hidden = true;
    }
  }
  document.documentElement.dataset.ready = 'true';
}

main();
