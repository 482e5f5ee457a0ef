// SPDX-License-Identifier: Apache-2.0
// The one big line: what to do now. And below it, small: what the program does, and whether we still hear from it.
import { h, svg } from '../shared/dom.js';
import { typeset } from '../shared/format.js';

const icons = {
  act: ['M4 12h15M13 5.5l6.5 6.5-6.5 6.5'], good: ['M4.5 12.8l5 5L19.5 7'], warn: ['M12 4.5v9.5M12 18.6v1'], bad: ['M6 6l12 12M18 6L6 18'], lost: ['M12 3a9 9 0 1 0 .01 0M5.8 5.8l12.4 12.4'],
};

const phases = {
  preparing: 'Preparing the model', waiting: 'Waiting for the next scan', judging: 'Judging', refining: 'Fitting all scans together', writing: 'Writing the result', ended: 'The session has ended',
};

const clock = (date) => date.toLocaleTimeString('en-GB');

export class Banner {
  constructor() {
    this.icon = h('span', { class: 'banner-icon' });
    this.text = h('p', { id: 'now', role: 'status' }, 'Connecting \u2026');
    this.phase = h('p', { id: 'phase' });
    this.connection = h('p', { id: 'connection' });
    this.element = h('header', { class: 'banner' }, this.icon, this.text, h('div', { class: 'banner-side' }, this.phase, this.connection));
    this.#level('lost');
  }

  set_state(state) {
    this.state = state;
    this.heard = new Date();
    this.phase.textContent = (phases[state.phase] ?? state.phase) + (state.busy_with ? ` ${state.busy_with}` : '');
    this.#show();
  }

  set_connection(connection) {
    const was_lost = this.is_lost;
    this.is_lost = connection === 'lost';
    document.documentElement.dataset.connection = connection;
    this.connection.textContent = { connecting: 'Connecting \u2026', open: was_lost ? `Connected again, caught up at ${clock(new Date())}` : 'Connected', lost: 'Trying to connect again \u2026' }[connection];
    this.#show();
  }

  #show() {
    const now = this.state?.now;
    if (this.is_lost) {
      this.#level('lost');
      this.text.textContent = this.heard ? `Connection lost. What you see is from ${clock(this.heard)}.` : 'No connection to the program.';
    } else if (now) {
      this.#level(now.level);
      this.#say(now);
    }
  }

  /** The headline large, what follows it smaller: a long sentence must not push the part out of sight. */
  #say({ text, headline }) {
    const first = headline && text.startsWith(headline) ? headline : text;
    const rest = text.slice(first.length).trim();
    this.text.replaceChildren(typeset(first), ...(rest ? [' ', h('span', { class: 'rest' }, typeset(rest))] : []));
  }

  #level(level) {
    if (this.element.dataset.level === level) return;
    this.element.dataset.level = level;
    this.icon.replaceChildren(svg('svg', { viewBox: '0 0 24 24', 'aria-hidden': 'true' }, (icons[level] ?? icons.act).map((d) => svg('path', { d }))));
  }
}
