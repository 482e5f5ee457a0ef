// SPDX-License-Identifier: Apache-2.0
// The column beside the part: how much is covered, whether all hangs together, where to stand next, where the holes are.
import { h, make_button } from '../shared/dom.js';
import { percent, number, typeset } from '../shared/format.js';

const share = (value, decimals = 0) => (typeof value === 'number' ? percent(value / 100, decimals) : '\u2013');
export const letter_of = (i) => String.fromCharCode(65 + i);

export class Side {
  /** `act`: {show_view(i), show_hole(i), write_result(), restore(file), add(files)}. */
  constructor(act) {
    this.act = act;
    this.coverage = h('section', { class: 'coverage' });
    this.pieces = h('section', { class: 'pieces' });
    this.views = h('section', { class: 'next' });
    this.holes = h('section', { class: 'holes' });
    this.notes = h('section', { class: 'notes' });
    this.tools = this.#tools();
    this.element = h('aside', { class: 'side' }, this.coverage, this.pieces, this.views, this.holes, this.notes, this.tools);
  }

  set_state(state) {
    this.#coverage(state.coverage, state.unreachable_percent);
    this.#pieces(state.pieces);
    this.#views(state.views);
    this.#holes(state.holes);
    this.#notes(state);
    this.result.textContent = { none: '', running: 'Writing the result \u2026', done: `Result written: ${state.result.folder ?? ''}`, failed: `Not written: ${state.result.text}` }[state.result.state] ?? '';
    this.write.disabled = state.result.state === 'running' || state.phase === 'preparing';
  }

  #coverage({ percent: once, twice_percent: twice, coverable_percent: coverable }, unreachable) {
    const bar = h('div', { class: 'bar', role: 'img', 'aria-label': `${share(once)} scanned` }, h('i', { class: 'once', style: `width: ${once ?? 0}%` }), h('i', { class: 'twice', style: `width: ${twice ?? 0}%` }),
      typeof coverable === 'number' && h('i', { class: 'limit', style: `left: ${coverable}%` }));
    this.coverage.replaceChildren(h('p', { class: 'big' }, share(once), h('small', null, 'scanned')), bar,
      h('p', { class: 'soft' }, `${share(twice)} by two scans or more.`, typeof coverable === 'number' && ` ${share(coverable)} can be reached.`,
        typeof unreachable === 'number' && unreachable >= 0.5 && ` ${share(unreachable)} no position can see.`));
  }

  #pieces(pieces) {
    const apart = pieces.length > 1;
    this.pieces.className = `pieces ${apart ? 'apart' : ''}`;
    this.pieces.hidden = pieces.length === 0;
    this.pieces.replaceChildren(h('p', { class: 'state' }, apart ? `In ${pieces.length} pieces` : pieces[0]?.scans.length > 1 ? `Joined: all ${pieces[0].scans.length} scans hang together` : 'One scan'),
      ...pieces.filter((piece) => piece.join).map((piece) => h('p', null, typeset(piece.join.text))));
  }

  #views(views) {
    this.views.hidden = views.length === 0;
    this.views.replaceChildren(h('h2', null, 'Where to stand next'), h('ol', null, views.map((view, i) => {
      const item = h('li', { class: i === 0 ? 'first' : '' }, h('b', { class: 'letter' }, letter_of(i)), h('span', null, typeset(view.text),
        (i === 0 || view.purpose === 'join') && h('small', null, `${percent(view.overlap, 0)} of what it sees is known already${view.purpose === 'join' ? '; joins the pieces' : ''}`)));
      make_button(item, `Show place ${letter_of(i)}`, () => this.act.show_view(i));
      return item;
    })));
  }

  #holes(holes) {
    this.holes.hidden = holes.length === 0;
    this.holes.replaceChildren(h('h2', null, 'Holes'), h('ul', null, holes.map((hole, i) => {
      const item = h('li', { class: hole.reachable ? '' : 'unreachable' }, h('b', { class: 'n' }, share(hole.percent, 1)), h('span', null, typeset(hole.text), !hole.reachable && h('small', null, 'no position can see it')));
      make_button(item, `Show hole ${i + 1}`, () => this.act.show_hole(i));
      return item;
    })));
  }

  #notes({ notes, removed, duplicates }) {
    const rows = notes.slice(-6).reverse().map((note) => h('li', { class: note.level }, typeset(note.text)));
    const out = removed.map((file) => h('li', { class: 'out' }, `${file} was taken out. `, h('button', { type: 'button', onclick: () => this.act.restore(file) }, 'Bring it back')));
    const twice = duplicates.map(({ file, of }) => h('li', { class: 'info' }, `${file} is the same as ${of}.`));
    this.notes.hidden = rows.length + out.length + twice.length === 0;
    this.notes.replaceChildren(h('h2', null, 'Notes'), h('ul', null, out, twice, rows));
  }

  #tools() {
    this.result = h('p', { class: 'soft', id: 'result' });
    this.write = h('button', { type: 'button', onclick: () => this.act.write_result() }, 'Write the result now');
    const input = h('input', { type: 'file', multiple: true, hidden: true });
    input.addEventListener('change', () => { this.act.add([...input.files]); input.value = ''; });
    return h('section', { class: 'tools' }, this.write, h('button', { type: 'button', onclick: () => input.click() }, 'Add a scan file'), input, this.result);
  }
}

