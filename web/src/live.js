// SPDX-License-Identifier: Apache-2.0
// The live page: states come from the server, each panel shows its share of them.
import { h } from './shared/dom.js';
import { typeset } from './shared/format.js';
import { Banner } from './live/banner.js';
import { LiveClient, Newest } from './live/client.js';
import { Side } from './live/side.js';
import { Sound } from './live/sound.js';
import { Strip, key_of, scan_sheet } from './live/strip.js';
import { LiveView } from './live/view.js';

const page = document.getElementById('page');
const sheet = h('div', { class: 'sheet-host', hidden: true });
const toast = h('p', { class: 'toast', role: 'alert', hidden: true });
const banner = new Banner();
const view = new LiveView(choose);
const strip = new Strip(choose);
const sound = new Sound();
let state = null;
let chosen = null;
let last_note = 0;

const client = new LiveClient({ state: take, connection: (connection) => {
  banner.set_connection(connection);
  if (connection === 'lost') values.forget();
  if (connection === 'open') load_surface();
} });
const side = new Side({
  show_view: (i) => view.show_view(i), show_hole: (i) => view.show_hole(i), write_result: () => attempt(client.write_result()),
  restore: (file) => attempt(client.restore(file)), add: (files) => files.forEach((file) => attempt(client.add(file), `${file.name} is being sent`)),
});
const values = new Newest(async (revision) => view.set_values(await client.values(revision)));
const sound_button = h('button', { type: 'button', class: 'sound', 'aria-pressed': 'true', onclick: () => {
  sound.on = !sound.on;
  sound_button.setAttribute('aria-pressed', String(sound.on));
  sound_button.textContent = sound.on ? 'Sound on' : 'Sound off';
} }, 'Sound on');

function take(next) {
  if (state && state.model.sha256 !== next.model.sha256 && state.model.sha256) return location.reload();
  const first = state === null;
  state = next;
  banner.set_state(state);
  side.set_state(state);
  strip.set_state(state);
  view.set_state(state);
  if (view.surface) values.want(state.surface_revision);
  if (state.now.sound && !first) announce(state.now.sound);
  // A note beside many others is easily missed.
  const newest = state.notes.at(-1);
  if (newest?.level === 'bad' && newest.revision > last_note && !first) say(typeset(newest.text));
  last_note = newest?.revision ?? 0;
  show_sheet();
  document.documentElement.dataset.revision = state.revision;
}

/** The surface is fetched once; it may not be there yet while the model is being prepared. */
async function load_surface() {
  if (view.surface || load_surface.running) return;
  load_surface.running = true;
  try {
    for (let tries = 0; !view.surface && tries < 1000; ++tries) {
      const json = await client.surface().catch(() => null);
      if (json) start_view(json);
      else await new Promise((resolve) => setTimeout(resolve, 1000));
      if (view.failed) return;
    }
  } finally {
    load_surface.running = false;
  }
}

function start_view(json) {
  try {
    view.set_surface(json);
    window.asbuilt = { view, client };
    document.documentElement.dataset.view = 'ready';
    if (state) values.want(state.surface_revision);
  } catch (error) {
    view.failed = true;
    view.element.replaceChildren(h('p', { class: 'problem' }, `The 3D view cannot be shown: ${error.message}. All figures are beside it.`));
  }
}

function announce(kind) {
  sound.play(kind);
  page.classList.remove('flash-accepted', 'flash-rejected');
  void page.offsetWidth;  // so that the same flash can start again
  page.classList.add(`flash-${kind}`);
}

function choose(key) {
  const i = key?.match(/^view (\d)$/)?.[1];
  if (i !== undefined) return view.show_view(Number(i));
  chosen = key === chosen ? null : key;
  strip.mark(chosen);
  view.choose(chosen);
  show_sheet(true);
}

/** The sheet is made anew only where its scan changed, so that a press on its button is never lost. */
function show_sheet(anew = false) {
  const scan = state?.scans.find((each) => key_of(each) === chosen);
  sheet.hidden = !scan;
  if (!scan) { chosen = null; sheet.said = ''; return; }
  const said = JSON.stringify(scan);
  if (!anew && said === sheet.said) return;
  sheet.said = said;
  sheet.replaceChildren(scan_sheet(state, scan, { close: () => choose(chosen), remove: (file) => { attempt(client.remove(file)); choose(chosen); } }));
}

/** Does something at the server and says it if that fails. */
async function attempt(promise, saying) {
  if (saying) say(saying);
  try {
    await promise;
    if (saying) say('');
  } catch (error) {
    say(error.message);
  }
}

function say(text) {
  toast.hidden = !text;
  toast.textContent = text;
  clearTimeout(say.timer);
  say.timer = setTimeout(() => { toast.hidden = true; }, 8000);
}

addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', (event) => {
  event.preventDefault();
  [...event.dataTransfer.files].forEach((file) => attempt(client.add(file), `${file.name} is being sent`));
});

view.element.append(sound_button);
page.append(banner.element, view.element, side.element, strip.element, sheet, toast);
client.start();
