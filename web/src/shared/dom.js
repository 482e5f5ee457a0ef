// SPDX-License-Identifier: Apache-2.0
// Elements without a framework: h('p', {class: 'note'}, 'text', child). Text never becomes markup.

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? '' : value);
  }
  for (const child of children.flat(Infinity)) {
    if (child !== null && child !== undefined && child !== false) element.append(child);
  }
  return element;
}

export const h = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);

export const svg = (tag, attributes, ...children) =>
  fill(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);

/** A table. Columns: {title, of(row) -> text or node, numeric, class}; rows are elements of any kind. */
export function table(columns, rows, { caption, on_row, class: kind } = {}) {
  const head = h('tr', null, columns.map((column) => h('th', { scope: 'col', class: column.numeric ? 'n' : null }, column.title)));
  const body = rows.map((row) => {
    const cells = columns.map((column) => h('td', { class: [column.numeric ? 'n' : '', column.class ?? ''].join(' ').trim() || null }, column.of(row)));
    const line = h('tr', null, cells);
    on_row?.(line, row);
    return line;
  });
  return h('div', { class: 'scroll' },
    h('table', { class: kind }, caption && h('caption', null, caption), h('thead', null, head), h('tbody', null, body)));
}

/** A clickable row or item that the keyboard reaches too. */
export function make_button(element, label, action) {
  element.classList.add('go');
  element.tabIndex = 0;
  element.setAttribute('aria-label', label);
  element.addEventListener('click', action);
  element.addEventListener('keydown', (event) => {
    if (event.key !== 'Enter' && event.key !== ' ') return;
    event.preventDefault();
    action();
  });
}
