// SPDX-License-Identifier: Apache-2.0
// Many copies of a small shape, each with its place and colour, drawn in one call. Merged on the processor: software
// renderers start anew for each instance of an instanced mesh.
import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Mesh, MeshBasicMaterial, Vector3 } from 'three';

export class Copies {
  /** `corners`: the shape's vertices, [[x, y, z]]; `triangles`: indices into them, counter-clockwise from outside. */
  constructor(corners, triangles) {
    this.corners = corners.map((corner) => new Vector3(...corner));
    this.triangles = triangles;
    this.capacity = 0;
    this.mesh = new Mesh(new BufferGeometry(), new MeshBasicMaterial({ vertexColors: true }));
    this.mesh.frustumCulled = false;
  }

  /** copies: [{matrix, colour: Color}]. Buffers are kept and only grow. */
  set(copies) {
    this.#reserve(copies.length);
    const { position, color } = this.mesh.geometry.attributes;
    const at = new Vector3();
    let i = 0;
    for (const { matrix, colour } of copies) {
      for (const corner of this.corners) {
        at.copy(corner).applyMatrix4(matrix);
        position.setXYZ(i, at.x, at.y, at.z);
        color.setXYZ(i++, colour.r, colour.g, colour.b);
      }
    }
    position.needsUpdate = color.needsUpdate = true;
    this.mesh.geometry.setDrawRange(0, copies.length * this.triangles.length);
  }

  #reserve(count) {
    if (count <= this.capacity && this.capacity > 0) return;
    this.capacity = Math.max(16, 2 * count);
    this.mesh.geometry.dispose();
    const geometry = new BufferGeometry();
    const size = this.corners.length;
    for (const name of ['position', 'color']) {
      geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * size * this.capacity), 3).setUsage(DynamicDrawUsage));
    }
    const index = new Uint32Array(this.triangles.length * this.capacity);
    for (let i = 0; i < index.length; ++i) index[i] = this.triangles[i % this.triangles.length] + size * Math.floor(i / this.triangles.length);
    geometry.setIndex(new BufferAttribute(index, 1));
    this.mesh.geometry = geometry;
  }
}
