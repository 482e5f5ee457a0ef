// SPDX-License-Identifier: Apache-2.0
// Moves a camera round a target, z up: mouse, touch and keyboard. Knows nothing of rendering; calls `changed` instead.
import { MathUtils, Vector3 } from 'three';

const kPole = Math.PI / 2 - 1e-4;

export class Orbit {
  /** `surface`: the element that takes the input. `radius`: of what is looked at, in mm. `free_aspect`: width / height of what is free. */
  constructor(camera, surface, changed) {
    Object.assign(this, { camera, surface, changed, target: new Vector3(), azimuth: -0.9, elevation: 0.5, distance: 100, radius: 50, free_aspect: 1 });
    this.pointers = new Map();
    this.wheel_active = false;
    const listen = (name, handler, options) => surface.addEventListener(name, handler.bind(this), options);
    listen('pointerdown', this.#down);
    listen('pointermove', this.#move);
    for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) listen(name, this.#up);
    listen('wheel', this.#wheel, { passive: false });
    listen('keydown', this.#key);
    listen('contextmenu', (event) => event.preventDefault());
    // On a page that scrolls, the wheel belongs to the page until the view was clicked.
    listen('focus', () => { this.wheel_active = true; });
    listen('blur', () => { this.wheel_active = false; });
  }

  get direction() {
    const c = Math.cos(this.elevation);
    return new Vector3(c * Math.cos(this.azimuth), c * Math.sin(this.azimuth), Math.sin(this.elevation));
  }

  /** Puts the camera where the angles say. */
  apply() {
    this.elevation = MathUtils.clamp(this.elevation, -kPole, kPole);
    this.distance = MathUtils.clamp(this.distance, this.radius * 0.02, this.radius * 60);
    this.camera.position.copy(this.target).addScaledVector(this.direction, this.distance);
    this.camera.up.set(0, 0, 1);
    this.camera.lookAt(this.target);
    const far = this.distance + this.radius * 8;
    this.camera.near = Math.max(far / 5000, this.distance - this.radius * 8);
    this.camera.far = far;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  /** The distance from the target at which a sphere fills the view. */
  fitting_distance(radius) {
    const half = MathUtils.degToRad(this.camera.fov) / 2;
    const narrow = Math.min(half, Math.atan(Math.tan(half) * this.free_aspect));
    return (1.04 * radius) / Math.sin(narrow);
  }

  /** The distance from `target`, looking from the present direction, at which all points are in view. */
  distance_for(points, target) {
    const out = this.direction;
    const right = new Vector3(-Math.sin(this.azimuth), Math.cos(this.azimuth), 0);
    const up = new Vector3().crossVectors(out, right);
    const tangent = Math.tan(MathUtils.degToRad(this.camera.fov) / 2);
    const offset = new Vector3();
    return points.reduce((most, point) => {
      offset.subVectors(point, target);
      const aside = Math.max(Math.abs(offset.dot(right)) / (tangent * this.free_aspect), Math.abs(offset.dot(up)) / tangent);
      return Math.max(most, offset.dot(out) + 1.1 * aside);
    }, 0);
  }

  look_along(direction) {
    this.azimuth = Math.hypot(direction.x, direction.y) > 1e-6 ? Math.atan2(direction.y, direction.x) : -Math.PI / 2;
    this.elevation = Math.asin(MathUtils.clamp(direction.z / (direction.length() || 1), -1, 1));
  }

  rotate(right, up) {
    this.azimuth -= right;
    this.elevation += up;
    this.#done();
  }

  /** Shares of the view's height. */
  pan(right, up) {
    const height = 2 * this.distance * Math.tan(MathUtils.degToRad(this.camera.fov) / 2);
    const x = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    const y = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    this.target.addScaledVector(x, -right * height).addScaledVector(y, -up * height);
    this.#done();
  }

  zoom(factor) {
    this.distance *= factor;
    this.#done();
  }

  #done() {
    this.apply();
    this.changed();
  }

  #down(event) {
    this.surface.focus({ preventScroll: true });
    this.surface.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, button: event.button, moved: 0 });
    if (this.pointers.size > 1) for (const pointer of this.pointers.values()) pointer.moved = Infinity;
  }

  #move(event) {
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) return;
    const [dx, dy] = [event.clientX - pointer.x, event.clientY - pointer.y];
    const before = this.#grip();
    Object.assign(pointer, { x: event.clientX, y: event.clientY, moved: pointer.moved + Math.hypot(dx, dy) });
    const height = this.surface.clientHeight;
    if (this.pointers.size >= 2) {
      const after = this.#grip();
      this.distance *= before.spread / Math.max(1, after.spread);
      this.pan((after.x - before.x) / height, -(after.y - before.y) / height);
    } else if (pointer.button !== 0 || event.shiftKey) {
      this.pan(dx / height, -dy / height);
    } else if (pointer.moved > 3) {
      this.rotate((dx / height) * Math.PI, (dy / height) * Math.PI);
    }
  }

  /** Middle and spread of two fingers. */
  #grip() {
    const [a, b] = [...this.pointers.values()];
    if (!b) return { x: a.x, y: a.y, spread: 1 };
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, spread: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)) };
  }

  #up(event) {
    const pointer = this.pointers.get(event.pointerId);
    this.pointers.delete(event.pointerId);
    if (event.type === 'pointerup' && pointer?.button === 0 && pointer.moved < 6) this.clicked?.(event.clientX, event.clientY);
  }

  #wheel(event) {
    if (!this.wheel_active && !event.ctrlKey) return;
    event.preventDefault();
    this.zoom(Math.exp(MathUtils.clamp(event.deltaY * (event.deltaMode === 1 ? 18 : 1), -200, 200) * 0.0016));
  }

  #key(event) {
    const step = 0.12;
    const actions = {
      ArrowLeft: () => (event.shiftKey ? this.pan(-0.05, 0) : this.rotate(-step, 0)),
      ArrowRight: () => (event.shiftKey ? this.pan(0.05, 0) : this.rotate(step, 0)),
      ArrowUp: () => (event.shiftKey ? this.pan(0, 0.05) : this.rotate(0, step)),
      ArrowDown: () => (event.shiftKey ? this.pan(0, -0.05) : this.rotate(0, -step)),
      '+': () => this.zoom(0.85), '=': () => this.zoom(0.85), '-': () => this.zoom(1 / 0.85),
      Home: () => this.home?.(), 0: () => this.home?.(), Enter: () => this.clicked_centre?.(),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }
}
