// SPDX-License-Identifier: Apache-2.0
// A whole session in Chromium against the program itself: scans of `asbuilt simulate` come one by one into the folder
// that `asbuilt live` watches, and the page says what a person beside the scanner has to know.
// ASBUILT_PROGRAM: the program. SCREENSHOTS: a folder for pictures of what was seen, if wanted.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { copyFileSync, mkdirSync, readFileSync, renameSync } from 'node:fs';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { after, before, test } from 'node:test';
import { canvas_figures, kPatience, launch, open_tab, own_folder } from '../support/browser.mjs';

const program = process.env.ASBUILT_PROGRAM;
const base = own_folder();
const scenes = join(base.path, 'scenes'), watched = join(base.path, 'watched');
let browser, live, url, truth;

before(async () => {
  execFileSync(program, ['simulate', 'demo:valve_body', '-o', scenes, '--scans', '6', '--points', '20000', '--seed', '11', '--absent-share', '0.15', '-q']);
  truth = JSON.parse(readFileSync(join(scenes, 'truth.json'), 'utf8'));
  mkdirSync(watched);
  live = spawn(program, ['live', join(scenes, 'model.ply'), '--watch', watched, '-o', join(base.path, 'session'), '--port', '0', '--idle', '0.3', '--no-result'], { stdio: ['ignore', 'pipe', 'inherit'] });
  url = await new Promise((resolve, reject) => {
    live.on('exit', (code) => reject(new Error(`asbuilt live ended with ${code}`)));
    createInterface({ input: live.stdout }).on('line', (line) => {
      const address = line.match(/the page is at (http:\S+)/)?.[1];
      if (address) resolve(address.replace('localhost', '127.0.0.1'));
    });
  });
  browser = await launch();
}, { timeout: kPatience });

after(async () => {
  await browser?.close();
  if (live?.exitCode === null) await new Promise((ended) => { live.removeAllListeners('exit').on('exit', ended); live.kill('SIGINT'); });
  base.remove();
}, { timeout: kPatience });

/** As a careful program puts it there: whole at once. */
function put(name) {
  copyFileSync(join(scenes, `${name}.ply`), join(base.path, 'coming'));
  renameSync(join(base.path, 'coming'), join(watched, `${name}.ply`));
}

const shows = (name) => truth.scans.find((scan) => scan.path === `${name}.ply`).model_from_scan !== null;

/** How alike the directions are from which two scans see the part: the cosine between them, in the model frame. */
function likeness(a, b) {
  const from = (name) => truth.scans.find((scan) => scan.path === `${name}.ply`).model_from_scan.slice(0, 3).map((row) => row[3]);
  const [p, q] = [from(a), from(b)];
  const dot = (u, v) => u.reduce((sum, value, i) => sum + value * v[i], 0);
  return dot(p, q) / Math.sqrt(dot(p, p) * dot(q, q));
}

test('from the first scan over two pieces and a scan without the part to one piece', { timeout: 3 * kPatience }, async () => {
  const { tab, faults, close } = await open_tab(browser, { home: url });
  await tab.goto(url);
  await tab.waitForSelector('html[data-view=ready]', { state: 'attached' });
  const now = () => tab.textContent('#now');
  const covered = async () => Number.parseFloat(await tab.textContent('.coverage .big'));
  const picture = async (name) => { if (process.env.SCREENSHOTS) await tab.screenshot({ path: join(process.env.SCREENSHOTS, `${name}.png`) }); };
  /** Puts a scan there and waits for its verdict; says which it was. */
  const scan = async (name) => {
    put(name);
    return tab.locator('.strip li', { has: tab.locator('b', { hasText: name }) }).getAttribute('data-status');
  };
  /** Nothing is judged or refined any more, and the picture shows what the state says. */
  const at_rest = async () => {
    for (;;) {
      await tab.waitForFunction(() => /^Waiting/.test(document.getElementById('phase').textContent));
      const state = await (await fetch(`${url}state`)).json();
      if (state.phase === 'waiting' && state.refinement.state === 'done') {
        await tab.waitForFunction((wanted) => window.asbuilt.view.revision === wanted, state.surface_revision);
        return state;
      }
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  };
  assert.match(await now(), /^Take the first scan/);

  // Two scans from the most different sides have too little in common, whatever else there is.
  const names = truth.scans.map((each) => each.path.replace('.ply', ''));
  const usable = names.filter(shows), absent = names.find((name) => !shows(name));
  assert.ok(usable.length >= 4 && absent, 'a scene with and without the part');
  const pairs = usable.flatMap((a) => usable.filter((b) => b > a).map((b) => ({ a, b, alike: likeness(a, b) })));
  const { a: first, b: second } = pairs.sort((x, y) => x.alike - y.alike)[0];

  assert.equal(await scan(first), 'accepted');
  await at_rest();
  const after_first = await covered();
  assert.ok(after_first > 5, `${after_first} %`);
  assert.match(await tab.textContent('.pieces'), /One scan/);
  assert.match(await now(), /^Next: from /);
  assert.ok(await tab.$$eval('.sensor.ghost', (list) => list.length) >= 1, 'a proposal is shown in the picture');
  assert.ok(await tab.$$eval('.next li', (list) => list.length) >= 1, 'and beside it');
  await picture('live-first');

  await scan(second);
  await tab.waitForSelector('.pieces.apart');
  assert.match(await now(), /^In pieces: scan_0\d hangs loose/);
  assert.ok(await covered() > after_first + 2);
  await at_rest();
  await picture('live-pieces');

  const before_absent = await covered();
  assert.equal(await scan(absent), 'rejected');
  await tab.waitForSelector('.banner[data-level=bad]');
  await at_rest();
  assert.match(await now(), new RegExp(`^${absent} is not used: the part was not found in it`));
  assert.equal(await covered(), before_absent);
  await picture('live-absent');

  // The others, first those that see something of both.
  const rest = usable.filter((name) => name !== first && name !== second)
    .sort((x, y) => Math.min(likeness(y, first), likeness(y, second)) - Math.min(likeness(x, first), likeness(x, second)));
  for (const name of rest) assert.equal(await scan(name), 'accepted');
  await tab.waitForSelector('.pieces:not(.apart)');
  await tab.waitForFunction((count) => document.querySelector('.pieces').textContent.includes(`Joined: all ${count} scans hang together`), usable.length);
  const state = await at_rest();
  assert.ok(await covered() > before_absent + 2);
  assert.match(await now(), /^Next: from /);
  const { drawn, colours } = await canvas_figures(tab);
  assert.ok(drawn > 0.02 && colours > 4, `${drawn}, ${colours}`);
  assert.equal(state.pieces.length, 1);
  assert.equal(state.scans.filter((each) => each.status === 'accepted').length, usable.length);
  await picture('live-joined');

  // A press on the first proposal turns the view so that its ghost can be seen.
  await tab.click('.next li:first-child');
  await tab.waitForFunction(() => { const ghost = [...document.querySelectorAll('.sensor.ghost')].find((each) => each.textContent === 'A'); return ghost && !ghost.hidden && !ghost.classList.contains('beyond'); });
  await tab.waitForTimeout(700);  // the flight there
  await picture('live-next');
  assert.deepEqual(faults, []);
  await close();
});
