// SPDX-License-Identifier: Apache-2.0
// Where the model's axes point in the present view: the words "from between +y and \u2212x" mean nothing without them.
import { Vector3 } from 'three';
import { svg } from '../shared/dom.js';
import { kMinus } from '../shared/format.js';

const kReach = 32;
const kAxes = [['x', new Vector3(1, 0, 0)], ['y', new Vector3(0, 1, 0)], ['z', new Vector3(0, 0, 1)]];

export class Axes {
  constructor(viewer) {
    this.viewer = viewer;
    this.element = svg('svg', { class: 'axes', viewBox: '-52 -52 104 104', role: 'img', 'aria-label': 'Directions of the axes' });
    this.ends = kAxes.flatMap(([name, axis]) => [1, -1].map((sign) => {
      const [line, text] = [svg('line', { x1: 0, y1: 0 }), svg('text', {}, [`${sign > 0 ? '+' : kMinus}${name}`])];
      return { axis: axis.clone().multiplyScalar(sign), line, text, group: svg('g', {}, [line, text]) };
    }));
    viewer.after_frame.push(() => this.#turn());
  }

  #turn() {
    const { quaternion } = this.viewer.camera;
    const inverse = quaternion.clone().invert();
    const seen = this.ends.map((end) => ({ ...end, at: end.axis.clone().applyQuaternion(inverse) }));
    seen.sort((a, b) => a.at.z - b.at.z);  // the nearest last, over the others
    const said = seen.map(({ at }) => `${at.x.toFixed(2)} ${at.y.toFixed(2)}`).join();
    if (said === this.said) return;
    this.said = said;
    const named = [];  // places of the names, the nearest first
    for (const { at, line, text, group } of [...seen].reverse()) {
      const [x, y] = [kReach * at.x, -kReach * at.y];
      const length = Math.hypot(x, y) || 1;
      const name = [x + (11 * x) / length, y + (11 * y) / length];
      const is_covered = named.some((other) => Math.hypot(name[0] - other[0], name[1] - other[1]) < 20);
      named.push(name);
      line.setAttribute('x2', x.toFixed(1));
      line.setAttribute('y2', y.toFixed(1));
      text.setAttribute('x', name[0].toFixed(1));
      text.setAttribute('y', name[1].toFixed(1));
      text.setAttribute('visibility', is_covered ? 'hidden' : 'visible');
      group.setAttribute('class', at.z < 0 ? 'back' : '');
      line.setAttribute('class', at.z < 0 ? 'back' : '');
    }
    this.element.replaceChildren(...seen.map(({ group }) => group));
  }
}
