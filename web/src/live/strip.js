// SPDX-License-Identifier: Apache-2.0
// The scans in order of arrival, newest last: a card each with status, gain and links. A press shows all about one.
import { h } from '../shared/dom.js';
import { number, percent, plural, typeset } from '../shared/format.js';
import { verdict_icon } from '../shared/verdict.js';

const looks = { accepted: 'pass', rejected: 'fail', failed: 'fail', dropped: 'fail', disconnected: 'not enough data', ambiguous: 'not enough data' };
export const look_of = (scan) => looks[scan.status] ?? 'none';
export const key_of = (scan) => `${scan.file}\n${scan.index_in_file}\n${scan.instance}`;
/** What a card says of a scan that is not used: its sheet and the big line tell more. */
const reasons = { no_hypothesis: 'part not found', low_score: 'part not found', poor_fit: 'part not found', normals_disagree: 'part not found', free_space_violated: 'part not found', contradicted: 'part not found', mirror_image: 'its mirror image',
  weak_evidence: 'too little of the part', too_few_points: 'too little of the part', under_constrained: 'too little of the part', scan_too_small: 'scan too small', ambiguous_pose: 'two poses fit', second_instance: 'two parts in it',
  contradicted_by_scans: 'others contradict it', unreadable: 'cannot be read' };
const share = (value) => (typeof value === 'number' ? percent(value / 100, 1) : '');

export class Strip {
  constructor(select) {
    Object.assign(this, { select, cards: new Map() });
    this.list = h('ol', { class: 'strip', 'aria-label': 'Scans' });
    this.empty = h('p', { class: 'strip-empty soft' }, 'No scan yet. The first one appears here as soon as its file is complete.');
    this.element = h('section', { class: 'strip-host' }, this.list, this.empty);
  }

  set_state(state) {
    const scans = [...state.scans].sort((a, b) => a.arrival - b.arrival || a.instance - b.instance);
    const wanted = new Set(scans.map(key_of));
    for (const [key, card] of this.cards) {
      if (wanted.has(key)) continue;
      card.element.remove();
      this.cards.delete(key);
    }
    let grown = false;
    scans.forEach((scan, place) => {
      const key = key_of(scan);
      let card = this.cards.get(key);
      if (!card) {
        card = this.#make(key);
        grown = true;
      }
      if (this.list.children[place] !== card.element) this.list.insertBefore(card.element, this.list.children[place] ?? null);
      this.#fill(card, scan);
    });
    this.empty.hidden = scans.length > 0;
    if (grown) this.list.scrollLeft = this.list.scrollWidth;
  }

  mark(key) {
    for (const [of, card] of this.cards) card.element.firstChild.setAttribute('aria-pressed', String(of === key));
  }

  #make(key) {
    const card = { name: h('b'), status: h('span', { class: 'status' }), detail: h('small'), said: '' };
    const button = h('button', { type: 'button', 'aria-pressed': 'false', onclick: () => this.select(key) }, card.name, card.status, card.detail);
    card.element = h('li', null, button);
    this.cards.set(key, card);
    return card;
  }

  /** Touches the page only where something changed: this runs for each scan at each state. */
  #fill(card, scan) {
    const links = scan.links.filter((link) => link.used).length;
    const detail = scan.status === 'accepted' || scan.status === 'disconnected' ? `+${share(scan.new_percent)} · ${plural(links, 'link')}` : reasons[scan.reason_code] ?? scan.reason_code.replaceAll('_', ' ');
    const said = [scan.name, scan.status, detail, scan.provisional].join('\n');
    if (said === card.said) return;
    card.said = said;
    card.element.className = `verdict-${look_of(scan).replaceAll(' ', '-')}`;
    card.element.dataset.status = scan.status;
    card.name.textContent = scan.name;
    card.status.replaceChildren(verdict_icon(look_of(scan)), scan.status + (scan.provisional ? ' …' : ''));
    card.detail.textContent = detail;
  }
}

const pairs = (rows) => h('dl', { class: 'pairs' }, rows.filter(([, value]) => value !== null && value !== '' && value !== undefined).map(([name, value]) => h('div', null, h('dt', null, name), h('dd', null, value))));

/** All about one scan, with the button that takes it out. */
export function scan_sheet(state, scan, { close, remove }) {
  const name = (index) => state.scans[index]?.name ?? `scan ${index}`;
  const links = scan.links.map((link) => h('li', null, `${name(link.to)}: ${percent(link.overlap, 0)}, ${link.firmness}${link.used ? '' : ', not used'}`));
  const weak = scan.weak_directions.map((direction) => h('li', null, direction.text));
  const others = state.scans.filter((other) => other.file === scan.file).length;
  const button = h('button', { type: 'button', class: 'danger', onclick: () => {
    if (button.dataset.sure) { remove(scan.file); return; }
    button.dataset.sure = 'yes';
    button.textContent = others > 1 ? `Press again: takes all ${others} scans of ${scan.file} out` : 'Press again to take it out';
  } }, 'Take this scan out');
  return h('section', { class: `sheet verdict-${look_of(scan).replaceAll(' ', '-')}` },
    h('div', { class: 'sheet-head' }, verdict_icon(look_of(scan)), h('h2', null, scan.name), h('button', { type: 'button', class: 'close', 'aria-label': 'Close', onclick: close }, '×')),
    h('p', { class: 'sentence' }, typeset(scan.sentence || scan.reason)),
    pairs([['Status', scan.status + (scan.provisional ? ', provisional: judged from a thinned copy' : '')], ['New surface', share(scan.new_percent)], ['Sees of the part', share(scan.covers_percent)],
      ['Points on the part', `${number(scan.part_points)} of ${number(scan.points)}`], ['Score', typeof scan.score === 'number' ? number(scan.score, 2) : null], ['File', scan.file]]),
    links.length > 0 && [h('h3', null, 'Overlaps'), h('ul', null, links)], weak.length > 0 && [h('h3', null, 'Weakly held'), h('ul', null, weak)],
    h('div', { class: 'sheet-foot' }, button));
}
