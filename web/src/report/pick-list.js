// SPDX-License-Identifier: Apache-2.0
// The list beside the 3D view: regions and faces, a press flies there.
import { h, make_button } from '../shared/dom.js';
import { number, percent, short, signed_mm } from '../shared/format.js';
import { verdict_icon } from '../shared/verdict.js';
import { by_severity } from './tables.js';

const kMost = 400;

function region_items(report, go) {
  return report.regions.map((region) => item(`Region ${region.index + 1}`, signed_mm(region.peak, report.decimals), `${short(region.area)} mm² on ${region.face_name ?? 'the part'}`, region.peak > 0 ? 'over' : 'under', () => go({ region: region.index })));
}

function face_items(report, go) {
  return by_severity(report.faces).slice(0, kMost).map((face) => {
    const detail = face.spots_scanned ? `${percent(face.coverage, 0)} scanned, mean ${signed_mm(face.mean, report.decimals)}` : 'not scanned';
    const share = typeof face.in_tolerance === 'number' ? percent(face.in_tolerance) : '';
    return item([face.verdict && verdict_icon(face.verdict), face.name], share, detail, '', () => go({ face: face.index }));
  });
}

function item(name, value, detail, kind, action) {
  const element = h('li', { class: kind }, h('b', null, name), h('span', { class: 'n' }, value), h('small', null, detail));
  make_button(element, `Show ${typeof name === 'string' ? name : name.at(-1)}`, action);
  return element;
}

/** Tabs with what the report has. */
export function pick_list(report, go) {
  const tabs = [
    report.regions && { title: 'Regions', count: report.regions.length, items: region_items(report, go), empty: 'No region is out of tolerance.' },
    report.faces?.length > 0 && { title: report.model.cad_faces ? 'Faces' : 'Pieces', count: report.faces.length, items: face_items(report, go) },
  ].filter(Boolean);
  const list = h('ul', { class: 'pick-list' });
  const buttons = tabs.map((tab) => h('button', { type: 'button', role: 'tab', onclick: () => choose(tab) }, tab.title, h('small', null, ` ${number(tab.count)}`)));
  function choose(tab) {
    buttons.forEach((button, i) => button.setAttribute('aria-selected', String(tabs[i] === tab)));
    list.replaceChildren(...(tab.items.length ? tab.items : [h('li', { class: 'soft' }, tab.empty ?? 'none')]));
  }
  if (tabs.length) choose(tabs.find((tab) => tab.count) ?? tabs[0]);
  return h('div', { class: 'lists' }, h('div', { class: 'tabs', role: 'tablist' }, buttons), list);
}
