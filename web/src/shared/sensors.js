// SPDX-License-Identifier: Apache-2.0
// Sensors round the part: one instanced pyramid each, links as lines between them, labels as HTML above the canvas.
import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Group, InstancedMesh, LineBasicMaterial, LineSegments,
  Matrix4, MeshBasicMaterial, Quaternion, SRGBColorSpace, Vector3,
} from 'three';
import { css_colour } from './colours.js';

/** Further than this from the part's middle, in diameters, sensors are drawn nearer: else the part would be a dot. */
const kFarthest = 0.95;

const shade_of = ([r, g, b]) => new Color().setRGB(r / 255, g / 255, b / 255, SRGBColorSpace);

/** A pyramid with its tip in the origin that opens along +z: the sensor and what it looks at. */
function pyramid_geometry() {
  const points = [[0, 0, 0], [-0.55, -0.4, 1], [0.55, -0.4, 1], [0.55, 0.4, 1], [-0.55, 0.4, 1]];
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(points.flat()), 3));
  geometry.setIndex([0, 2, 1, 0, 3, 2, 0, 4, 3, 0, 1, 4, 1, 2, 3, 1, 3, 4]);
  return geometry;
}

export class Sensors {
  /** Draws into the viewer; `select(id)` is called when a label is pressed. */
  constructor(viewer, host, select = () => {}) {
    Object.assign(this, { viewer, select, labels: new Map(), capacity: 0 });
    this.group = new Group();
    viewer.extras.add(this.group);
    this.layer = document.createElement('div');
    this.layer.className = 'sensor-labels';
    host.append(this.layer);
    this.geometry = pyramid_geometry();
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.9 }));
    this.lines.frustumCulled = false;
    this.group.add(this.lines);
    this.line_capacity = 0;
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

  /** sensors: [{id, position, direction | null, colour: rgb, label, title, ghost, kind}]; links: [{from: id, to: id, colour}]. */
  set(sensors, links) {
    const { diameter, centre } = this.viewer.surface.box;
    this.#reserve(sensors.length);
    const size = diameter * 0.055;
    this.shown = sensors.map((sensor) => ({ ...sensor, at: this.drawn_at(sensor.position) }));
    const forward = new Vector3(0, 0, 1);
    this.shown.forEach((sensor, i) => {
      const direction = sensor.direction ? new Vector3(...sensor.direction) : new Vector3(...centre).sub(sensor.at);
      const turn = new Quaternion().setFromUnitVectors(forward, direction.normalize());
      const scale = size * (sensor.ghost ? 1.5 : 1);
      this.mesh.setMatrixAt(i, new Matrix4().compose(sensor.at, turn, new Vector3(scale, scale, scale)));
      this.mesh.setColorAt(i, shade_of(sensor.colour));
    });
    if (this.mesh) {
      this.mesh.count = sensors.length;
      this.mesh.instanceMatrix.needsUpdate = true;
      if (this.mesh.instanceColor) this.mesh.instanceColor.needsUpdate = true;
    }
    this.#set_lines(links);
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

  #reserve(count) {
    if (count <= this.capacity) return;
    this.capacity = Math.max(16, 2 * count);
    if (this.mesh) {
      this.group.remove(this.mesh);
      this.mesh.dispose();
      this.mesh.material.dispose();
    }
    this.mesh = new InstancedMesh(this.geometry, new MeshBasicMaterial({ side: DoubleSide, transparent: true, opacity: 0.85 }), this.capacity);
    this.mesh.instanceMatrix.setUsage(DynamicDrawUsage);
    this.mesh.frustumCulled = false;
    this.group.add(this.mesh);
  }

  #set_lines(links) {
    const by_id = new Map(this.shown.map((sensor) => [sensor.id, sensor]));
    const pairs = links.filter(({ from, to }) => by_id.has(from) && by_id.has(to));
    // A ghost is tied to what it would look at.
    const rays = this.shown.filter((sensor) => sensor.target);
    const needed = 2 * (pairs.length + rays.length);
    const geometry = this.lines.geometry;
    if (needed > this.line_capacity) {
      this.line_capacity = Math.max(128, 2 * needed);
      geometry.dispose();
      for (const name of ['position', 'color']) geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * this.line_capacity), 3));
    }
    const position = geometry.getAttribute('position');
    const colours = geometry.getAttribute('color');
    let i = 0;
    const put = (point, colour) => {
      position.setXYZ(i, point.x, point.y, point.z);
      colours.setXYZ(i++, colour.r, colour.g, colour.b);
    };
    for (const { from, to, colour } of pairs) {
      const shade = shade_of(colour);
      put(by_id.get(from).at, shade);
      put(by_id.get(to).at, shade);
    }
    for (const sensor of rays) {
      const shade = shade_of(sensor.colour);
      put(sensor.at, shade);
      put(new Vector3(...sensor.target), shade);
    }
    geometry.setDrawRange(0, needed);
    if (position) position.needsUpdate = colours.needsUpdate = true;
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
      if (label.className !== kind) label.className = kind;
      if (label.textContent !== sensor.label) label.textContent = sensor.label;
      if (label.title !== sensor.title) label.title = sensor.title ?? '';
      label.style.setProperty('--colour', css_colour(sensor.colour));
    }
  }

  #place_labels() {
    if (!this.shown || !this.group.visible) return;
    for (const sensor of this.shown) {
      const label = this.labels.get(sensor.id);
      const at = this.viewer.project(sensor.at.toArray());
      label.hidden = !at;
      if (at) label.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, -50%)`;
    }
  }
}
