// SPDX-License-Identifier: Apache-2.0
// Sensors round the part: one instanced pyramid each, links as bars between them, as thick as the overlap, labels as HTML above the canvas.
import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Group, InstancedMesh, Matrix4, MeshBasicMaterial,
  Quaternion, SRGBColorSpace, Vector3,
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

/** A square bar from the origin to (0, 0, 1), 2 wide, without ends. */
function bar_geometry() {
  const points = [0, 1].flatMap((z) => [[-1, -1, z], [1, -1, z], [1, 1, z], [-1, 1, z]]);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(points.flat()), 3));
  geometry.setIndex([0, 1, 2, 3].flatMap((i) => { const j = (i + 1) % 4; return [i, j, j + 4, i, j + 4, i + 4]; }));
  return geometry;
}

/** Tells the graphics card that the first `count` instances are new. */
function changed(mesh, count) {
  mesh.count = count;
  mesh.instanceMatrix.needsUpdate = true;
  if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
}

export class Sensors {
  /** Draws into the viewer; `select(id)` is called when a label is pressed. */
  constructor(viewer, host, select = () => {}) {
    Object.assign(this, { viewer, select, labels: new Map() });
    this.group = new Group();
    viewer.extras.add(this.group);
    this.layer = document.createElement('div');
    this.layer.className = 'sensor-labels';
    host.append(this.layer);
    this.geometry = pyramid_geometry();
    this.bar_geometry = bar_geometry();
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
    this.mesh = this.#with_room(this.mesh, this.geometry, sensors.length);
    const size = diameter * 0.07;
    this.shown = sensors.map((sensor) => ({ ...sensor, at: this.drawn_at(sensor.position) }));
    const forward = new Vector3(0, 0, 1);
    this.shown.forEach((sensor, i) => {
      const direction = sensor.direction ? new Vector3(...sensor.direction) : new Vector3(...centre).sub(sensor.at);
      const turn = new Quaternion().setFromUnitVectors(forward, direction.normalize());
      const scale = size * (sensor.ghost ? 1.5 : 1);
      this.mesh.setMatrixAt(i, new Matrix4().compose(sensor.at, turn, new Vector3(scale, scale, scale)));
      this.mesh.setColorAt(i, shade_of(sensor.colour));
    });
    if (this.mesh) changed(this.mesh, sensors.length);
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

  /** `mesh` if it holds so many instances, else a larger one in its place; what it held on the graphics card is freed. */
  #with_room(mesh, geometry, count) {
    if (count <= (mesh?.instanceMatrix.count ?? 0)) return mesh;
    if (mesh) {
      this.group.remove(mesh);
      mesh.dispose();
      mesh.material.dispose();
    }
    const larger = new InstancedMesh(geometry, new MeshBasicMaterial({ side: DoubleSide }), Math.max(32, 2 * count));
    larger.instanceMatrix.setUsage(DynamicDrawUsage);
    larger.frustumCulled = false;
    this.group.add(larger);
    return larger;
  }

  #set_bars(links) {
    const by_id = new Map(this.shown.map((sensor) => [sensor.id, sensor]));
    const { diameter } = this.viewer.surface.box;
    const bars = links.filter(({ from, to }) => by_id.has(from) && by_id.has(to)).map(({ from, to, colour, overlap }) => ({
      from: by_id.get(from).at, to: by_id.get(to).at, colour, width: diameter * (0.0012 + 0.005 * (overlap ?? 0.2)) }));
    // A ghost is tied to what it would look at.
    for (const { target, at, colour } of this.shown) if (target) bars.push({ from: at, to: new Vector3(...target), colour, width: diameter * 0.0022 });
    this.bars = this.#with_room(this.bars, this.bar_geometry, bars.length);
    if (!this.bars) return;
    const along = new Vector3(0, 0, 1);
    bars.forEach(({ from, to, colour, width }, i) => {
      const way = to.clone().sub(from);
      const length = way.length() || 1;
      this.bars.setMatrixAt(i, new Matrix4().compose(from, new Quaternion().setFromUnitVectors(along, way.divideScalar(length)), new Vector3(width, width, length)));
      this.bars.setColorAt(i, shade_of(colour));
    });
    changed(this.bars, bars.length);
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
