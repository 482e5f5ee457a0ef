// SPDX-License-Identifier: Apache-2.0
// The 3D view of both pages. It draws when something changed, never in a loop.
import {
  BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Mesh, NoToneMapping, OrthographicCamera,
  PerspectiveCamera, Scene, Vector3, WebGLRenderer, WebGLRenderTarget,
} from 'three';
import { coarser_triangles } from './coarse.js';
import { Orbit } from './orbit.js';
import { pick } from './surface.js';
import { apply_colouring, surface_material } from './surface-material.js';

// While the part moves and the machine is slow: so many triangles, and so many pixels a px.
const kCoarseTriangles = 30000;
const kCoarsePixels = 0.5;
const kSlowFrame = 45;  // ms
const kRest = 180;      // ms without motion after which all is drawn again

const calm = () => matchMedia('(prefers-reduced-motion: reduce)').matches;

export class Viewer {
  /** Draws into a canvas that fills `host`; throws if the browser has no WebGL 2. `covered_right` tells how many px at the
   * right of it something else lies over. */
  constructor(host, { antialias = true, most_pixels_per_px = 2, background = 0xf1f4f7, covered_right = () => 0 } = {}) {
    this.covered_right = covered_right;
    this.background = background;
    this.host = host;
    this.canvas = document.createElement('canvas');
    Object.assign(this.canvas, { tabIndex: 0 });
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', 'The part in 3D. Arrow keys turn it, shift and arrows move it, plus and minus zoom, 0 shows all of it.');
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias, alpha: false, powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, most_pixels_per_px));
    this.renderer.setClearColor(background, 1);
    this.renderer.toneMapping = NoToneMapping;
    this.scene = new Scene();
    this.extras = new Group();
    this.scene.add(this.extras);
    this.camera = new PerspectiveCamera(28, 1, 1, 1000);
    this.pixels_per_px = this.renderer.getPixelRatio();
    this.slow = is_software(this.renderer.getContext());
    this.orbit = new Orbit(this.camera, this.canvas, () => this.#moved());
    this.orbit.clicked = (x, y) => this.#clicked(x, y);
    this.orbit.clicked_centre = () => this.#clicked_centre();
    this.orbit.home = () => this.show_all();
    this.frames = 0;
    this.after_frame = [];
    host.prepend(this.canvas);
    this.coarse = false;
    this.resizing = new ResizeObserver(() => this.#resize());
    this.resizing.observe(host);
    this.canvas.addEventListener('webglcontextrestored', () => this.request());
    this.#resize();
  }

  /** The part; `open` surfaces show their inner side too. */
  set_surface(surface, { open = false } = {}) {
    this.surface = surface;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(surface.positions, 3));
    geometry.setAttribute('normal', new BufferAttribute(surface.normals, 4, true));
    this.data = new Float32Array((surface.positions.length / 3) * 2);
    geometry.setAttribute('datum', new BufferAttribute(this.data, 2));
    this.triangles = new BufferAttribute(surface.triangles, 1);
    geometry.setIndex(this.triangles);
    this.material = surface_material({ open });
    this.mesh = new Mesh(geometry, this.material);
    this.mesh.frustumCulled = false;
    const outline = new BufferGeometry();
    outline.setAttribute('position', geometry.getAttribute('position'));
    outline.setIndex(new BufferAttribute(surface.edges, 1));
    this.outline = new LineSegments(outline, new LineBasicMaterial({ color: 0x1f2933, transparent: true, opacity: 0.55 }));
    this.outline.frustumCulled = false;
    this.scene.add(this.mesh, this.outline);
    this.show_all({ animate: false });
  }

  /** `values`: one a vertex, NaN where unknown; or categories, from 0. See apply_colouring for the rest. */
  set_values(values) {
    const data = this.data;
    for (let v = 0; v < values.length; ++v) {
      const known = values[v] === values[v];
      data[2 * v] = known ? values[v] : 0;
      data[2 * v + 1] = known ? 1 : 0;
    }
    this.mesh.geometry.getAttribute('datum').needsUpdate = true;
    this.request();
  }

  set_colouring(colouring) {
    apply_colouring(this.material, colouring);
    this.request();
  }

  /** The camera moved: draws soon, coarsely if the machine is slow, and all of it once the camera rests. */
  #moved() {
    const now = performance.now();
    // Several slow frames in a row, not one that something else held up.
    this.slow_frames = now - this.last_move > kSlowFrame && now - this.last_move < 1000 ? (this.slow_frames ?? 0) + 1 : 0;
    this.slow ||= this.slow_frames > 5;
    this.last_move = now;
    if (this.slow) this.#set_coarse(true);
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.#set_coarse(false), kRest);
    this.request();
  }

  #set_coarse(on) {
    if (!this.surface || on === this.coarse) return;
    this.coarse = on;
    if (on) this.coarse_triangles ??= new BufferAttribute(coarser_triangles(this.surface, kCoarseTriangles), 1);
    this.mesh.geometry.setIndex(on ? this.coarse_triangles : this.triangles);
    this.renderer.setPixelRatio(on ? Math.min(this.pixels_per_px, kCoarsePixels * Math.max(1, this.pixels_per_px)) : this.pixels_per_px);
    this.request();
  }

  /** Draws once before the browser shows its next picture, however often it is asked. */
  request() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw();
    });
  }

  draw() {
    this.orbit.apply();
    if (this.material) this.material.uniforms.hatch.value = Math.max(2, 9 * this.renderer.getPixelRatio());
    this.renderer.render(this.scene, this.camera);
    ++this.frames;
    for (const action of this.after_frame) action();
  }

  /** All of the part, and of what stands round it (`others`, points), from `direction`. */
  show_all({ animate = true, direction = new Vector3(0.55, -0.72, 0.48) } = {}) {
    const { centre, min, max, diameter } = this.surface.box;
    const points = [...(this.others ?? [])];
    for (let corner = 0; corner < 8; ++corner) points.push(new Vector3(...[0, 1, 2].map((axis) => (corner & (1 << axis) ? max : min)[axis])));
    const target = new Vector3(...centre);
    this.orbit.radius = Math.max(diameter / 2, ...points.map((point) => point.distanceTo(target)));
    this.fly_to({ target, direction, points, animate });
  }

  /** Looks at `target` from `direction` so that all points, or a sphere of `radius`, are in view. */
  fly_to({ target, direction, radius, points, animate = true }) {
    const orbit = this.orbit;
    const from = { target: orbit.target.clone(), azimuth: orbit.azimuth, elevation: orbit.elevation, distance: orbit.distance };
    if (direction) orbit.look_along(direction);
    let turn = (orbit.azimuth - from.azimuth) % (2 * Math.PI);
    if (Math.abs(turn) > Math.PI) turn -= Math.sign(turn) * 2 * Math.PI;
    const to = { target: target.clone(), azimuth: from.azimuth + turn, elevation: orbit.elevation, distance: points ? orbit.distance_for(points, target) : orbit.fitting_distance(radius) };
    cancelAnimationFrame(this.flight);
    if (!animate || calm()) return this.#place(from, to, 1);
    const start = performance.now();
    const step = (now) => {
      const t = Math.min(1, (now - start) / 450);
      this.#place(from, to, t * t * (3 - 2 * t));
      if (t < 1) this.flight = requestAnimationFrame(step);
    };
    this.flight = requestAnimationFrame(step);
  }

  #place(from, to, t) {
    const orbit = this.orbit;
    orbit.target.lerpVectors(from.target, to.target, t);
    orbit.azimuth = from.azimuth + (to.azimuth - from.azimuth) * t;
    orbit.elevation = from.elevation + (to.elevation - from.elevation) * t;
    orbit.distance = from.distance * (to.distance / from.distance) ** t;
    orbit.apply();
    if (t < 1) this.#moved();
    this.request();
  }

  /** CSS pixels inside the canvas of a point in the model frame; null behind the camera. */
  project([x, y, z]) {
    const point = new Vector3(x, y, z).project(this.camera);
    if (point.z > 1) return null;
    return [((point.x + 1) / 2) * this.canvas.clientWidth, ((1 - point.y) / 2) * this.canvas.clientHeight];
  }

  /** What lies under a place of the canvas, in CSS pixels: see pick in surface.js. */
  pick_at(x, y) {
    const ray = new Vector3((2 * x) / this.canvas.clientWidth - 1, 1 - (2 * y) / this.canvas.clientHeight, 0.5);
    const direction = ray.unproject(this.camera).sub(this.camera.position).normalize();
    return pick(this.surface, this.camera.position.toArray(), direction.toArray());
  }

  #clicked(client_x, client_y) {
    const box = this.canvas.getBoundingClientRect();
    if (this.surface) this.picked?.(this.pick_at(client_x - box.left, client_y - box.top));
  }

  #clicked_centre() {
    if (this.surface) this.picked?.(this.pick_at(...this.project(this.orbit.target.toArray())));
  }

  /** A picture of the part alone, parallel projection, on white: a PNG as data URL. */
  picture({ direction, up = [0, 0, 1], width, height, samples = 4 }) {
    this.#set_coarse(false);
    const { centre, min, max } = this.surface.box;
    const camera = new OrthographicCamera();
    const middle = new Vector3(...centre);
    const far = this.surface.box.diameter;
    camera.position.copy(middle).addScaledVector(new Vector3(...direction).normalize(), far);
    camera.up.set(...up);
    camera.lookAt(middle);
    camera.updateMatrixWorld();
    let half = [0, 0];
    for (let corner = 0; corner < 8; ++corner) {
      const point = new Vector3(...[0, 1, 2].map((axis) => (corner & (1 << axis) ? max : min)[axis])).applyMatrix4(camera.matrixWorldInverse);
      half = [Math.max(half[0], Math.abs(point.x)), Math.max(half[1], Math.abs(point.y))];
    }
    const scale = 1.06 * Math.max(half[0] / width, half[1] / height);
    Object.assign(camera, { left: -scale * width, right: scale * width, top: scale * height, bottom: -scale * height, near: far * 0.3, far: far * 1.7 });
    camera.updateProjectionMatrix();
    return this.#render_to_url(camera, width, height, samples);
  }

  #render_to_url(camera, width, height, samples) {
    const target = new WebGLRenderTarget(width, height, { samples });
    const shown = this.extras.visible;
    this.extras.visible = false;
    this.material.uniforms.hatch.value = 14;
    this.renderer.setRenderTarget(target);
    this.renderer.setClearColor(0xffffff, 1);
    this.renderer.render(this.scene, camera);
    const pixels = new Uint8Array(width * height * 4);
    this.renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    this.renderer.setRenderTarget(null);
    this.renderer.setClearColor(this.background, 1);
    this.extras.visible = shown;
    target.dispose();
    return url_of(pixels, width, height);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    const was = this.orbit.free_aspect;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // The target comes to stand in the middle of what nothing covers.
    const covered = Math.min(this.covered_right(), width / 2);
    this.camera.setViewOffset(width, height, covered / 2, 0, width, height);
    this.orbit.free_aspect = (width - covered) / height;
    // A part that filled the view still does when the window gets narrower.
    if (this.surface && was > this.orbit.free_aspect) this.orbit.distance *= Math.min(2, was / this.orbit.free_aspect);
    this.request();
  }
}

/** Whether the processor draws in place of a graphics card. */
function is_software(gl) {
  const extension = gl.getExtension('WEBGL_debug_renderer_info');
  return extension ? /swiftshader|llvmpipe|softpipe|software|basic render/i.test(gl.getParameter(extension.UNMASKED_RENDERER_WEBGL)) : false;
}

/** WebGL's rows run upwards, a picture's downwards. */
function url_of(pixels, width, height) {
  const canvas = Object.assign(document.createElement('canvas'), { width, height });
  const image = new ImageData(width, height);
  for (let row = 0; row < height; ++row) {
    image.data.set(pixels.subarray((height - 1 - row) * width * 4, (height - row) * width * 4), row * width * 4);
  }
  canvas.getContext('2d').putImageData(image, 0, 0);
  return canvas.toDataURL('image/png');
}
