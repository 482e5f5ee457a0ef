// SPDX-License-Identifier: Apache-2.0
// The interactive view: what the part is coloured by, its legend, picking, and flying to regions and faces.
import { Vector3 } from 'three';
import { category_colour } from '../shared/colours.js';
import { h } from '../shared/dom.js';
import { kNone, number, percent, place, short, signed, signed_mm } from '../shared/format.js';
import { Sensors } from '../shared/sensors.js';
import { corner_at, value_at } from '../shared/surface.js';
import { verdict_badge } from '../shared/verdict.js';
import { Viewer } from '../shared/viewer.js';
import { modes_of } from './modes.js';
import { pick_list } from './pick-list.js';

export const directions = [
  { name: 'Oblique', direction: [0.55, -0.72, 0.48] }, { name: 'Oblique, from behind', direction: [-0.55, 0.72, -0.42] },
  { name: 'Front', detail: 'from \u2212y', direction: [0, -1, 0] }, { name: 'Back', detail: 'from +y', direction: [0, 1, 0] },
  { name: 'Left', detail: 'from \u2212x', direction: [-1, 0, 0] }, { name: 'Right', detail: 'from +x', direction: [1, 0, 0] },
  { name: 'Top', detail: 'from +z', direction: [0, 0, 1], up: [0, 1, 0] }, { name: 'Bottom', detail: 'from \u2212z', direction: [0, 0, -1], up: [0, 1, 0] },
];

export class ReportView {
  constructor(report, scene) {
    Object.assign(this, { report, scene, settings: {}, listeners: [] });
    this.modes = modes_of(report, scene);
    for (const mode of this.modes) this.settings[mode.id] = { ...mode.range, steps: false };
    this.host = h('div', { class: 'view-host' });
    this.legend = h('div', { class: 'legend' });
    this.readout = h('div', { class: 'readout', 'aria-live': 'polite' });
    this.marker = h('div', { class: 'marker', hidden: true });
    this.host.append(this.marker);
    this.element = h('section', { class: 'stage no-print', 'aria-label': '3D view' },
      this.#mode_buttons(), h('div', { class: 'frame' }, this.host, this.legend, this.readout, this.#view_buttons()),
      h('aside', null, this.options = h('div', { class: 'options' }), pick_list(report, (what) => this.go(what))));
  }

  /** Makes the view; call when the element is in the page, so that it has a size. Throws without WebGL. */
  start() {
    this.viewer = new Viewer(this.host, { covered_right: () => this.#covered_by_legend() });
    this.viewer.set_surface(this.scene, { open: this.report.model.open_edges > 0 });
    this.viewer.picked = (hit) => this.show_pick(hit);
    this.viewer.after_frame.push(() => this.#place_marker());
    this.set_mode(this.modes[0].id);
    this.show_pick(null);
  }

  /** px at the right of the view that the legend lies over; on a phone it stands below. */
  #covered_by_legend() {
    const legend = this.legend.getBoundingClientRect(), host = this.host.getBoundingClientRect();
    return legend.bottom > host.top && legend.top < host.bottom ? Math.max(0, host.right - legend.left) : 0;
  }

  set_mode(id) {
    this.mode = this.modes.find((mode) => mode.id === id);
    for (const button of this.buttons) button.setAttribute('aria-pressed', String(button.dataset.mode === id));
    this.viewer.set_values(this.mode.values);
    if (this.sensors) this.#set_sensors();
    this.#recolour();
    this.#show_options();
  }

  #recolour() {
    const settings = { ...this.settings[this.mode.id], chosen: this.chosen };
    this.viewer.set_colouring(this.mode.colouring(settings));
    this.legend.replaceChildren(h('p', null, h('b', null, this.mode.label), h('small', null, this.mode.note)), ...this.mode.legend(settings));
    for (const listener of this.listeners) listener(this.mode);
  }

  #mode_buttons() {
    this.buttons = this.modes.map((mode) => h('button', { type: 'button', 'data-mode': mode.id, onclick: () => this.set_mode(mode.id) }, mode.label));
    return h('div', { class: 'modes', role: 'group', 'aria-label': 'Colour by' }, this.buttons);
  }

  #view_buttons() {
    const names = ['Oblique', 'Front', 'Back', 'Left', 'Right', 'Top', 'Bottom'];
    return h('div', { class: 'views' }, names.map((name) => {
      const { direction } = directions.find((view) => view.name === name);
      return h('button', { type: 'button', onclick: () => this.look(direction) }, name);
    }), h('button', { type: 'button', onclick: () => this.viewer.show_all() }, 'All'));
  }

  look(direction) {
    this.viewer.show_all({ direction: new Vector3(...direction) });
  }

  #show_options() {
    const settings = this.settings[this.mode.id];
    const rows = [];
    if (this.mode.range) rows.push(this.#range_inputs(settings));
    if (this.mode.range) rows.push(check('Discrete steps', settings.steps, (on) => { settings.steps = on; this.#recolour(); }));
    rows.push(check('Outline', this.viewer.outline.visible, (on) => { this.viewer.outline.visible = on; this.viewer.request(); }));
    if (this.scene.poses.some((pose) => pose.sensor)) rows.push(check('Sensors', this.sensors_on ?? false, (on) => this.show_sensors(on)));
    this.options.replaceChildren(...rows);
  }

  #range_inputs(settings) {
    const { low, high, through_zero } = this.mode.range;
    const step = Number(((high - low) / 40).toPrecision(1));
    const field = (name, label) => {
      const input = h('input', { type: 'number', step, value: Number(settings[name].toPrecision(4)), 'aria-label': `${label} end of the colour scale` });
      input.addEventListener('change', () => {
        const wanted = { ...settings, [name]: Number(input.value) };
        const fits = input.value !== '' && wanted.low < wanted.high && (!through_zero || (wanted.low < 0 && wanted.high > 0));
        input.setCustomValidity(fits ? '' : through_zero ? 'The scale must reach from below zero to above it.' : 'The lower end must lie below the upper.');
        input.reportValidity();
        if (!fits) return;
        settings[name] = wanted[name];
        this.#recolour();
      });
      return input;
    };
    const reset = h('button', { type: 'button', class: 'quiet', onclick: () => { Object.assign(settings, { low, high }); this.#recolour(); this.#show_options(); } }, 'Reset');
    return h('div', { class: 'range' }, h('span', null, 'Scale'), field('low', 'Lower'), '\u2026', field('high', 'Upper'), h('span', { class: 'soft' }, 'mm'), reset);
  }

  show_sensors(on) {
    this.sensors_on = on;
    if (!this.sensors) {
      this.sensors = new Sensors(this.viewer, this.host);
      this.#set_sensors();
    }
    this.sensors.visible = on;
    this.viewer.others = on ? this.sensors.places() : [];
    this.viewer.show_all();
  }

  /** Sensors have the colours of their scans where the part has them, too. */
  #set_sensors() {
    const colour = (scan) => (this.mode.id === 'scan' ? category_colour(scan) : [44, 84, 128]);
    const name = (index) => this.report.scans[index]?.name ?? `scan ${index}`;
    const sensors = this.scene.poses.filter((pose) => pose.sensor).map((pose) => ({
      id: pose.scan, position: pose.sensor, colour: colour(pose.scan), label: String(pose.scan), title: name(pose.scan) }));
    const links = (this.report.graph?.links ?? []).filter((link) => link.linked).map((link) => ({ from: link.a, to: link.b, overlap: link.overlap, colour: [120, 132, 146] }));
    this.sensors.set(sensors, links);
  }

  /** Flies to {region: i}, {face: i} or {scan: i}, and marks it where the colouring can. */
  go(what) {
    this.chosen = what;
    const mode = what.region !== undefined ? 'regions' : what.face !== undefined ? 'faces' : null;
    if (mode && this.modes.some(({ id }) => id === mode) && this.mode.categories) this.set_mode(mode);
    else this.#recolour();
    const values = what.region !== undefined ? this.scene.region : this.scene.face;
    const index = what.region ?? what.face;
    const sight = values && sight_of(this.scene, values, index);
    if (!sight) return;
    const least = this.scene.box.diameter * (what.region !== undefined ? 0.09 : 0.14);
    this.viewer.fly_to({ target: sight.centre, direction: sight.direction, radius: Math.max(least, sight.radius * 1.5) });
    this.#show_chosen(what);
    this.element.scrollIntoView({ block: 'nearest', behavior: 'smooth' });
  }

  /** The figures of a region or face that was flown to. */
  #show_chosen({ region, face }) {
    const d = this.report.decimals;
    if (region !== undefined) {
      const { peak, peak_at, peak_standard_error: error, excess, face_name, area } = this.report.regions[region];
      this.readout.replaceChildren(h('p', { class: 'value' }, signed(peak, d), h('small', null, `${typeof error === 'number' ? ` ± ${number(error, d + 1)}` : ''} mm at its peak`)),
        h('dl', null, line('region', `${region + 1}, ${short(area)} mm²`), line('beyond', signed_mm(excess, d)), line('face', face_name ?? kNone), line('x, y, z', place(peak_at, 2))));
      return this.#mark(peak_at);
    }
    const { name, verdict, coverage, mean, sigma, in_tolerance } = this.report.faces[face];
    this.readout.replaceChildren(h('p', { class: 'value' }, name), h('dl', null, verdict && line('verdict', verdict_badge(verdict)), line('scanned', percent(coverage)),
      typeof in_tolerance === 'number' && line('within', percent(in_tolerance)), line('mean', `${signed_mm(mean, d)}, std. dev. ${number(sigma, d)}`)));
    this.#mark(null);
  }

  #mark(point) {
    this.marked = point;
    this.viewer.request();
  }

  #place_marker() {
    const at = this.marked && this.viewer.project(this.marked);
    this.marker.hidden = !at;
    if (at) this.marker.style.transform = `translate(${at[0]}px, ${at[1]}px)`;
  }

  /** The figures of a picked place; null clears them. */
  show_pick(hit) {
    this.#mark(hit?.point ?? null);
    if (!hit) return this.readout.replaceChildren(h('p', { class: 'soft' }, 'Press on the part to read its deviation. Drag turns, scroll or pinch zooms, right drag moves.'));
    const figures = figures_at(this.report, this.scene, hit);
    const d = this.report.decimals;
    const scanned = Number.isFinite(figures.deviation);
    const error = Number.isFinite(figures.sigma) ? ` ± ${number(figures.sigma, d + 1)}` : '';
    this.readout.replaceChildren(
      h('p', { class: 'value', 'data-deviation': scanned ? figures.deviation : '' }, scanned ? [signed(figures.deviation, d), h('small', null, `${error} mm`)] : 'not scanned'),
      h('dl', null, line('scans', figures.support === null ? kNone : [number(figures.support), figures.scan && h('small', null, `  mostly ${figures.scan}`)]),
        figures.face && line('face', [figures.face.name, '  ', figures.face.verdict && verdict_badge(figures.face.verdict)]),
        figures.region !== null && line('region', `${figures.region + 1}, peak ${signed_mm(this.report.regions[figures.region].peak, d)}`),
        line('x, y, z', place(hit.point, 2))));
    return figures;
  }
}

const line = (name, value) => h('div', null, h('dt', null, name), h('dd', null, value));

const check = (label, on, changed) => {
  const input = h('input', { type: 'checkbox', checked: on });
  input.addEventListener('change', () => changed(input.checked));
  return h('label', { class: 'check' }, input, label);
};

/** {deviation, sigma, support, scan, face, region} at a hit. */
export function figures_at(report, scene, hit) {
  const corner = corner_at(scene, hit);
  const at = (values) => (values ? value_at(scene, hit, values) : NaN);
  const category = (values) => (values && !Number.isNaN(values[corner]) ? values[corner] : null);
  const scan = category(scene.scan);
  const face = scene.faces ? report.faces?.[scene.faces[hit.triangle]] : null;
  return { deviation: at(scene.deviation), sigma: at(scene.sigma), support: scene.support ? scene.support[corner] : null,
    scan: scan === null ? null : report.scans?.[scan]?.name, face, region: category(scene.region) };
}

/** Middle, mean normal and radius of the vertices whose value is `index`; null if there are none. */
function sight_of({ positions, normals, box }, values, index) {
  const centre = new Vector3(), direction = new Vector3();
  let count = 0;
  const each = (action) => values.forEach((value, v) => { if (value === index) action(new Vector3(positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]), v); });
  each((point, v) => { ++count; centre.add(point); direction.add(new Vector3(normals[4 * v], normals[4 * v + 1], normals[4 * v + 2]).divideScalar(127)); });
  if (!count) return null;
  centre.divideScalar(count);
  let radius = 0;
  each((point) => { radius = Math.max(radius, point.distanceTo(centre)); });
  // A face that closes round itself has no direction of its own: then from where its middle lies, seen from the part's.
  if (direction.length() < 0.2 * count) direction.copy(centre).sub(new Vector3(...box.centre));
  if (direction.length() < 1e-6) direction.set(0.55, -0.72, 0.48);
  direction.normalize().add(new Vector3(0.1, -0.16, 0.12));
  return { centre, direction, radius };
}
