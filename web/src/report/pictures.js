// SPDX-License-Identifier: Apache-2.0
// The part from fixed sides, as pictures that print: always coloured by deviation, whatever the 3D view shows.
import { h, make_button } from '../shared/dom.js';
import { directions } from './view.js';

export class Pictures {
  constructor(view) {
    this.view = view;
    this.images = directions.map(({ name, detail }) => h('img', { alt: `${name}${detail ? `, ${detail}` : ''}: the part coloured by deviation`, width: 640, height: 480 }));
    this.legend = h('div', { class: 'legend' });
    this.element = h('div', { class: 'pictures' }, h('div', { class: 'grid' }, directions.map(({ name, detail, direction }, i) => {
      const figure = h('figure', null, this.images[i], h('figcaption', null, name, detail && h('small', null, ` ${detail}`)));
      make_button(figure, `Show ${name} in 3D`, () => { view.look(direction); view.element.scrollIntoView({ behavior: 'smooth' }); });
      return figure;
    })), this.legend);
    view.listeners.push((mode) => { if (mode.id === 'deviation') this.#soon(); });
  }

  /** One picture between two frames, so that the page stays alive; resolves when all are there. */
  async draw() {
    const run = (this.run = (this.run ?? 0) + 1);
    const { viewer, modes, settings } = this.view;
    const deviation = modes[0];
    this.legend.replaceChildren(...deviation.legend(settings[deviation.id]));
    for (let i = 0; i < directions.length; ++i) {
      await new Promise((resolve) => setTimeout(resolve));
      if (run !== this.run) return;
      const mode = this.view.mode;
      if (mode !== deviation) { viewer.set_values(deviation.values); viewer.set_colouring(deviation.colouring(settings[deviation.id])); }
      this.images[i].src = viewer.picture({ ...directions[i], width: 640, height: 480 });
      if (mode !== deviation) this.view.set_mode(mode.id);
    }
    this.element.dataset.ready = 'true';
  }

  #soon() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.draw(), 150);
  }
}
