// SPDX-License-Identifier: Apache-2.0
// Sensors round the part: a pyramid each, links as bars as thick as the overlap, labels as HTML above the canvas.
import { Color, Group, Matrix4, Quaternion, SRGBColorSpace, Vector3 } from 'three';
import { css_colour } from './colours.js';
import { Copies } from './copies.js';

/** Further than this from the part's middle, in diameters, sensors are drawn nearer: else the part would be a dot. */
const kFarthest = 0.95;

const shade_of = ([r, g, b]) => new Color().setRGB(r / 255, g / 255, b / 255, SRGBColorSpace);

/** A pyramid with its tip in the origin that opens along +z: the sensor and what it looks at. */
const pyramids = () => new Copies([[0, 0, 0], [-0.55, -0.4, 1], [0.55, -0.4, 1], [0.55, 0.4, 1], [-0.55, 0.4, 1]], [0, 2, 1, 0, 3, 2, 0, 4, 3, 0, 1, 4, 1, 2, 3, 1, 3, 4]);

/** A three-sided bar from the origin to (0, 0, 1), without ends. */
const bars = () => new Copies([0, 1].flatMap((z) => [0, 1, 2].map((i) => [1.2 * Math.cos((i * 2 * Math.PI) / 3), 1.2 * Math.sin((i * 2 * Math.PI) / 3), z])), [0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 2, 0, 3, 2, 3, 5]);

export class Sensors {
  /** Draws into the viewer; `select(id)` is called when a label is pressed. */
  constructor(viewer, host, select = () => {}) {
    Object.assign(this, { viewer, select, labels: new Map() });
    this.group = new Group();
    viewer.extras.add(this.group);
    this.layer = document.createElement('div');
    this.layer.className = 'sensor-labels';
    host.append(this.layer);
    this.pyramids = pyramids();
    this.bars = bars();
    this.group.add(this.bars.mesh, this.pyramids.mesh);
    viewer.after_frame.push(() => this.#place_labels());
  }

  /** Where a sensor is drawn. */
  drawn_at(position) {
    const { centre, diameter } = this.viewer.surface.box;
    const middle = new Vector3(...centre);
    const offset = new Vector3(...position).sub(middle);
    const most = kFarthest * diameter;
    if (offset.length() > most) offset.setLength(most);
    return middle.add(offset);
  }

  /** sensors: [{id, position, direction | null, colour: rgb, label, title, ghost, kind}]; links: [{from: id, to: id, colour, overlap}]. */
  set(sensors, links) {
    const { diameter, centre } = this.viewer.surface.box;
    const forward = new Vector3(0, 0, 1);
    this.shown = sensors.map((sensor) => ({ ...sensor, at: this.drawn_at(sensor.position) }));
    this.pyramids.set(this.shown.map((sensor) => {
      const direction = sensor.direction ? new Vector3(...sensor.direction) : new Vector3(...centre).sub(sensor.at);
      const turn = new Quaternion().setFromUnitVectors(forward, direction.normalize());
      const size = diameter * (sensor.ghost ? 0.1 : 0.07);
      return { matrix: new Matrix4().compose(sensor.at, turn, new Vector3(size, size, size)), colour: shade_of(sensor.colour) };
    }));
    this.#set_bars(links);
    this.#set_labels();
    this.viewer.request();
  }

  /** Where all sensors are drawn: what a view of the whole must hold beside the part. */
  places() {
    return (this.shown ?? []).map((sensor) => sensor.at);
  }

  set visible(on) {
    this.group.visible = on;
    this.layer.hidden = !on;
    this.viewer.request();
  }

  #set_bars(links) {
    const by_id = new Map(this.shown.map((sensor) => [sensor.id, sensor]));
    const { diameter } = this.viewer.surface.box;
    const wanted = links.filter(({ from, to }) => by_id.has(from) && by_id.has(to)).map(({ from, to, colour, overlap }) => ({
      from: by_id.get(from).at, to: by_id.get(to).at, colour, width: diameter * (0.0012 + 0.005 * (overlap ?? 0.2)) }));
    // A ghost is tied to what it would look at.
    for (const { target, at, colour } of this.shown) if (target) wanted.push({ from: at, to: new Vector3(...target), colour, width: diameter * 0.0022 });
    const along = new Vector3(0, 0, 1);
    this.bars.set(wanted.map(({ from, to, colour, width }) => {
      const way = to.clone().sub(from);
      const length = way.length() || 1;
      const turn = new Quaternion().setFromUnitVectors(along, way.divideScalar(length));
      return { matrix: new Matrix4().compose(from, turn, new Vector3(width, width, length)), colour: shade_of(colour) };
    }));
  }

  #set_labels() {
    const wanted = new Set(this.shown.map((sensor) => sensor.id));
    for (const [id, label] of this.labels) {
      if (wanted.has(id)) continue;
      label.remove();
      this.labels.delete(id);
    }
    for (const sensor of this.shown) {
      let label = this.labels.get(sensor.id);
      if (!label) {
        label = document.createElement('button');
        label.type = 'button';
        label.addEventListener('click', () => this.select(sensor.id));
        this.layer.append(label);
        this.labels.set(sensor.id, label);
      }
      const kind = `sensor ${sensor.kind ?? ''}`;
      if (label.kind !== kind) label.className = label.kind = kind;
      if (label.textContent !== sensor.label) label.textContent = sensor.label;
      if (label.title !== sensor.title) label.title = sensor.title ?? '';
      label.style.setProperty('--colour', css_colour(sensor.colour));
    }
  }

  #place_labels() {
    if (!this.shown || !this.group.visible) return;
    const middle = new Vector3(...this.viewer.surface.box.centre);
    const towards_us = this.viewer.camera.position.clone().sub(middle);
    // All places are asked for before the first label moves: the browser lays the page out anew for each question after a change.
    const places = this.shown.map((sensor) => this.viewer.project(sensor.at.toArray()));
    this.shown.forEach((sensor, i) => {
      const label = this.labels.get(sensor.id);
      const at = places[i];
      if (label.hidden !== !at) label.hidden = !at;
      // A label has no depth: what stands beyond the part is faint, and under what stands before it.
      const is_beyond = sensor.at.clone().sub(middle).dot(towards_us) < 0;
      if (label.classList.contains('beyond') !== is_beyond) label.classList.toggle('beyond', is_beyond);
      if (at) label.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, -50%)`;
    });
  }
}
