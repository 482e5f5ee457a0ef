// SPDX-License-Identifier: Apache-2.0
// The part in 3D while it is being scanned: coverage, deviation or age, and the sensors round it.
import { Vector3 } from 'three';
import { age_stops, category_colour, coverage_stops, deviation_stops, even_steps, lookup } from '../shared/colours.js';
import { h } from '../shared/dom.js';
import { number, signed_mm, typeset } from '../shared/format.js';
import { scale_bar, swatches } from '../shared/legend.js';
import { unpack } from '../shared/packed.js';
import { Sensors } from '../shared/sensors.js';
import { corner_at, read_surface, value_at } from '../shared/surface.js';
import { Viewer } from '../shared/viewer.js';
import { Axes } from './axes.js';
import { key_of } from './strip.js';
import { letter_of } from './side.js';

// What was not scanned must be seen from across the room, in each colouring.
const kHole = [[240, 150, 20], [255, 206, 110]];
const kNone = 65535;
const kMostScans = 4;
const kAges = 6;
const firmness = { firm: [43, 108, 176], fair: [120, 160, 205], weak: [214, 130, 0] };

/** A scan's own number if its name ends in one, so that the picture and the names agree. */
const number_in = (scan) => scan.name.match(/\d{1,3}$/)?.[0] ?? String(scan.arrival + 1);

export class LiveView {
  constructor(select) {
    this.select = select;
    this.mode = 'support';
    this.host = h('div', { class: 'view-host' });
    this.legend = h('div', { class: 'legend' });
    this.readout = h('p', { class: 'readout', hidden: true });
    this.buttons = [['support', 'Scans'], ['deviation', 'Deviation'], ['age', 'Age']].map(([id, label]) => h('button', { type: 'button', 'data-mode': id, 'aria-pressed': String(id === this.mode), onclick: () => this.set_mode(id) }, label));
    this.element = h('section', { class: 'frame', 'aria-label': 'The part in 3D' }, this.host, h('div', { class: 'modes', role: 'group', 'aria-label': 'Colour by' }, this.buttons), this.legend, this.readout,
      h('button', { type: 'button', class: 'whole', onclick: () => this.viewer?.show_all() }, 'Show all'));
  }

  /** Throws without WebGL. */
  set_surface(json) {
    // No antialiasing and one pixel a px: tablets and machines without a graphics card keep up.
    this.viewer = new Viewer(this.host, { antialias: false, most_pixels_per_px: 1 });
    this.surface = read_surface(json);
    this.viewer.set_surface(this.surface);
    this.viewer.picked = (hit) => this.#show_pick(hit);
    this.viewer.canvas.addEventListener('pointerdown', () => { this.touched = true; });
    this.viewer.orbit.wheel_active = true;
    this.viewer.canvas.addEventListener('blur', () => { this.viewer.orbit.wheel_active = true; });
    this.sensors = new Sensors(this.viewer, this.host, (id) => this.select(id));
    this.host.after(new Axes(this.viewer).element);
    const count = this.surface.positions.length / 3;
    this.shown = new Float32Array(count);
    this.values = { support: new Uint16Array(count), deviation: new Float32Array(count).fill(NaN), newest: new Uint16Array(count).fill(kNone) };
    this.#recolour();
    if (this.state) this.set_state(this.state);
  }

  set_values(json) {
    for (const name of ['support', 'deviation', 'newest']) {
      const values = unpack(json[name], name);
      if (values.length !== this.shown.length) throw new Error(`${name} has ${values.length} values for ${this.shown.length} vertices`);
      this.values[name] = values;
    }
    this.revision = json.revision;
    this.#recolour();
  }

  set_mode(mode) {
    this.mode = mode;
    for (const button of this.buttons) button.setAttribute('aria-pressed', String(button.dataset.mode === mode));
    this.#recolour();
  }

  #recolour() {
    if (!this.surface) return;
    const { support, deviation, newest } = this.values;
    const shown = this.shown;
    if (this.mode === 'deviation') {
      shown.set(deviation);
      this.#colour(deviation_stops(-this.#deviation_reach(), this.reach), null);
    } else if (this.mode === 'age') {
      const last = newest.reduce((most, value) => (value !== kNone && value > most ? value : most), 0);
      for (let v = 0; v < shown.length; ++v) shown[v] = newest[v] === kNone ? NaN : Math.min(kAges - 1, last - newest[v]);
      const stops = age_stops(-0.5, kAges - 0.5);
      this.#colour(stops, even_steps(stops, kAges));
    } else {
      for (let v = 0; v < shown.length; ++v) shown[v] = support[v] === 0 ? NaN : Math.min(kMostScans, support[v]);
      const stops = coverage_stops(0.5, kMostScans + 0.5);
      this.#colour(stops, even_steps(stops, kMostScans));
    }
    this.viewer.set_values(shown);
  }

  /** A round number near the 98th percentile; it only changes when the old one fits badly, so that colours keep their meaning. */
  #deviation_reach() {
    const sizes = [];
    const step = Math.max(1, Math.floor(this.shown.length / 20000));
    for (let v = 0; v < this.shown.length; v += step) if (this.shown[v] === this.shown[v]) sizes.push(Math.abs(this.shown[v]));
    const wanted = sizes.length ? sizes.sort((a, b) => a - b)[Math.floor(0.98 * (sizes.length - 1))] || 1 : 1;
    if (!this.reach || wanted > 1.3 * this.reach || wanted < 0.35 * this.reach) {
      const power = 10 ** Math.floor(Math.log10(wanted));
      this.reach = [1, 2, 5, 10].map((factor) => factor * power).find((value) => value >= wanted * 0.999);
    }
    return this.reach;
  }

  #colour(stops, steps) {
    const said = JSON.stringify([this.mode, stops[0].value, stops[stops.length - 1].value]);
    if (said === this.coloured) return;
    this.coloured = said;
    this.viewer.set_colouring({ texels: lookup(stops, steps), low: stops[0].value, high: stops[stops.length - 1].value, unknown: kHole });
    const hole = { name: 'not scanned', rgb: kHole[0], other: kHole[1] };
    const names = this.mode === 'support' ? (i) => (i === 0 ? '1 scan' : i === kMostScans - 1 ? `${kMostScans} or more` : `${i + 1} scans`) : (i) => (i === 0 ? 'newest scan' : i === kAges - 1 ? 'older' : `${i} before`);
    this.legend.replaceChildren(...(steps ? [swatches([hole, ...steps.map((step, i) => ({ name: names(i), rgb: step.rgb }))])] : [scale_bar({ stops, signs: true }), swatches([hole])]));
  }

  set_state(state) {
    this.state = state;
    if (!this.sensors) return;
    const apart = state.pieces.length > 1;
    const colour = (scan) => apart && scan.component !== null ? category_colour(3 * scan.component) : [44, 84, 128];
    const sensors = state.scans.filter((scan) => scan.viewpoint && scan.component !== null).map((scan) => ({
      id: key_of(scan), position: scan.viewpoint, direction: scan.view_direction, colour: colour(scan), label: number_in(scan), title: scan.name, kind: key_of(scan) === this.chosen ? 'chosen' : '' }));
    const ghosts = state.views.map((view, i) => ({ id: `view ${i}`, position: view.position, direction: view.direction, target: view.target, colour: i === 0 ? [0, 140, 90] : [110, 175, 145], label: letter_of(i), title: typeset(view.text), ghost: true, kind: 'ghost' }));
    const links = state.links.filter((link) => link.used).map((link) => ({ from: key_of(state.scans[link.a]), to: key_of(state.scans[link.b]), overlap: link.overlap, colour: firmness[link.firmness] ?? firmness.weak }));
    this.sensors.set([...sensors, ...ghosts], links);
    this.viewer.others = this.sensors.places();
    if (!this.touched) this.viewer.show_all({ animate: this.fitted === true });
    this.fitted = true;
  }

  choose(key) {
    this.chosen = key;
    if (this.state) this.set_state(this.state);
  }

  /** Shows where a proposal is, beside the part. */
  show_view(i) {
    const view = this.state.views[i];
    if (!view || !this.viewer) return;
    this.touched = true;
    const out = new Vector3(...view.position).sub(new Vector3(...this.surface.box.centre));
    this.viewer.show_all({ direction: out.applyAxisAngle(new Vector3(0, 0, 1), 0.6).add(new Vector3(0, 0, 0.25 * out.length())) });
  }

  show_hole(i) {
    const hole = this.state.holes[i];
    if (!hole || !this.viewer) return;
    this.touched = true;
    const direction = new Vector3(...hole.normal).add(new Vector3(0.12, -0.18, 0.15));
    this.viewer.fly_to({ target: new Vector3(...hole.centre), direction, radius: Math.max(hole.extent * 0.8, this.surface.box.diameter * 0.12) });
  }

  #show_pick(hit) {
    this.readout.hidden = !hit;
    if (!hit) return;
    const count = this.values.support[corner_at(this.surface, hit)];
    const deviation = value_at(this.surface, hit, this.values.deviation);
    this.readout.textContent = count ? `${number(count)} scan${count > 1 ? 's' : ''}, deviation ${signed_mm(deviation, 2)}` : 'not scanned';
  }
}
