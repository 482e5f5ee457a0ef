// SPDX-License-Identifier: Apache-2.0
// Drives the live page in Chromium against a stand-in server that replays states.
import assert from 'node:assert/strict';
import { after, afterEach, before, beforeEach, test } from 'node:test';
import { built_page, canvas_figures, fits_its_width, kPatience, launch, open_tab, screen_place } from '../support/browser.mjs';
import { example_part, example_state, example_values, with_rejected_last } from '../support/example-live.mjs';
import { LiveServer } from '../support/live-server.mjs';

const { mesh, surface } = example_part(8000);
let browser, server, url;

before(async () => { browser = await launch(); }, { timeout: kPatience });
after(() => browser?.close());
beforeEach(async () => {
  server = new LiveServer({ page: built_page('live'), surface: JSON.stringify(surface) });
  show(0);
  url = await server.start();
});
afterEach(() => server.stop());

/** The server tells of `count` scans. */
function show(count, more) {
  server.set(example_state(mesh, count, more), example_values(mesh, count, count).json);
}

async function opened(options = {}) {
  const page = await open_tab(browser, { home: url, ...options });
  await page.tab.goto(options.at ?? url);
  await page.tab.waitForSelector('html[data-view=ready]', { state: 'attached' });
  return page;
}

const revision_is = (tab, revision) => tab.waitForSelector(`html[data-revision="${revision}"]`, { state: 'attached' });
const values_are = (tab, revision) => tab.waitForFunction((wanted) => window.asbuilt.view.revision === wanted, revision);
const now = (tab) => tab.textContent('#now');

test('a session is followed: the line, coverage, scans and proposals', { timeout: kPatience }, async () => {
  const { tab, faults, close } = await opened();
  assert.match(await now(tab), /^Make the first scan/);
  assert.ok(await tab.isVisible('.strip-empty'));
  let before_share = 0;
  for (let count = 1; count <= 4; ++count) {
    show(count);
    await revision_is(tab, count + 1);
    assert.equal(await tab.$$eval('.strip li', (list) => list.length), count);
    const share = Number.parseFloat(await tab.textContent('.big'));
    assert.ok(share >= before_share);
    before_share = share;
  }
  assert.match(await now(tab), /^Next: stand 260\smm/);
  assert.equal(await tab.$$eval('.sensor.ghost', (list) => list.length), 3);
  assert.equal(await tab.$$eval('.sensor:not(.ghost)', (list) => list.length), 4);
  assert.match(await tab.textContent('.pieces'), /Joined/);
  assert.deepEqual(faults, []);
  await close();
});

test('pieces are told, with the view that joins them, and then joined', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const state = example_state(mesh, 3);
  state.pieces = [{ scans: [0, 1], percent: 40, join: null }, { scans: [2], percent: 10, join: { text: 'scan_02 shares 3 % with scan_01: a view that shows both joins them', best_overlap: 0.03, a: 2, b: 1, view: 0 } }];
  state.scans[2] = { ...state.scans[2], component: 1, status: 'disconnected' };
  server.set(state, example_values(mesh, 3, 3).json);
  await tab.waitForSelector('.pieces.apart');
  assert.match(await tab.textContent('.pieces'), /In 2 pieces.*joins them/);
  show(4);
  await tab.waitForSelector('.pieces:not(.apart)');
  await close();
});

test('the colours tell what the values say: scans, deviation, age', { timeout: kPatience }, async () => {
  const { tab, faults, close } = await opened();
  show(5);
  await values_are(tab, 5);
  const { support, deviation } = example_values(mesh, 5, 5);
  for (const mode of ['support', 'deviation', 'age']) {
    await tab.click(`[data-mode=${mode}]`);
    const { drawn, colours } = await canvas_figures(tab);
    assert.ok(drawn > 0.02 && colours > 4, `${mode}: ${drawn}, ${colours}`);
  }
  const v = mesh.vertices.findIndex((vertex, i) => vertex.side === 1 && vertex.s > 20 && vertex.s < 60 && vertex.y > 40 && vertex.y < 80 && support[i] > 0);
  assert.ok(v > 0);
  await tab.evaluate(() => { window.asbuilt.view.sensors.visible = false; });
  const { x, y } = await screen_place(tab, mesh.vertices[v].point, mesh.vertices[v].normal);
  await tab.mouse.click(x, y);
  const text = await tab.textContent('.readout');
  assert.match(text, new RegExp(`^${support[v]} scan`));
  const read = Number(text.match(/deviation ([+\u2212]?[\d.]+)/)[1].replace('\u2212', '-'));
  assert.ok(Math.abs(read - deviation[v]) < 0.02, `${text}, planted ${deviation[v]}`);
  assert.deepEqual(faults, []);
  await close();
});

test('unscanned surface is orange stripes from the start', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const colours = await tab.evaluate(() => {
    const { viewer } = window.asbuilt.view;
    viewer.draw();
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [viewer.canvas.width, viewer.canvas.height];
    const context = canvas.getContext('2d');
    context.drawImage(viewer.canvas, 0, 0);
    const at = viewer.project(viewer.surface.box.centre);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    let orange = 0, other = 0;
    for (let i = 0; i < data.length; i += 4) if (data[i] !== data[0] || data[i + 2] !== data[2]) (data[i] > data[i + 2] + 60 ? ++orange : ++other);
    return { orange, other, at };
  });
  assert.ok(colours.orange > 5 * colours.other, JSON.stringify(colours));
  await close();
});

test('the axes of the words are shown, as the view turns them', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const places = () => tab.evaluate(() => { window.asbuilt.view.viewer.draw(); return Object.fromEntries([...document.querySelectorAll('.axes text')].map((text) => [text.textContent, [Number(text.getAttribute('x')), Number(text.getAttribute('y'))]])); });
  const look_from = (x, y, z) => tab.evaluate((from) => { const { viewer } = window.asbuilt.view; viewer.orbit.look_along({ x: from[0], y: from[1], z: from[2], length: () => Math.hypot(...from) }); }, [x, y, z]);
  await look_from(0, -1, 0);
  let at = await places();
  assert.equal(Object.keys(at).length, 6);
  assert.ok(at['+x'][0] > 30 && at['\u2212x'][0] < -30 && at['+z'][1] < -30 && Math.abs(at['+z'][0]) < 1, JSON.stringify(at));
  await look_from(1, 0, 0);
  at = await places();
  assert.ok(at['+y'][0] > 30 && at['\u2212y'][0] < -30, JSON.stringify(at));
  await close();
});

test('a rejected scan is told by line, colour and frame', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  show(2);
  await revision_is(tab, 3);
  server.set(with_rejected_last(example_state(mesh, 3)));
  await tab.waitForSelector('.banner[data-level=bad]');
  await tab.waitForSelector('#page.flash-rejected');
  assert.match(await now(tab), /^scan_02 was not used: the part is not in it\. Scan this side again\.$/);
  assert.equal(await tab.textContent('#now .rest'), 'Scan this side again.');
  assert.equal(await tab.$$eval('.strip [data-status=rejected]', (list) => list.length), 1);
  await close();
});

test('a lost connection is said, and everything missed is caught up', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  show(2);
  await values_are(tab, 2);
  await server.stop();
  await tab.waitForSelector('html[data-connection=lost]', { state: 'attached' });
  assert.match(await now(tab), /^Connection lost\. What you see is from \d\d:\d\d:\d\d/);
  show(6);
  await server.start();
  await tab.waitForSelector('html[data-connection=open]', { state: 'attached' });
  await values_are(tab, 6);
  assert.equal(await tab.$$eval('.strip li', (list) => list.length), 6);
  assert.match(await tab.textContent('#connection'), /caught up/);
  await close();
});

test('a program that starts anew counts from one again and is believed', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  show(5, { revision: 400 });
  await revision_is(tab, 400);
  await values_are(tab, 5);
  const asked = () => server.requests.filter((request) => request === 'GET /surface/values').length;
  const before = asked();
  await server.stop();
  show(5, { revision: 2 });  // its values have the number of the old ones by chance
  await server.start();
  await revision_is(tab, 2);
  while (asked() === before) await new Promise((resolve) => setTimeout(resolve, 20));
  await close();
});

test('a scan is taken out after a second press, and brought back', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  show(3);
  await revision_is(tab, 4);
  await tab.click('.strip li:nth-child(2) button');
  assert.match(await tab.textContent('.sheet'), /scan_01.*may slide along y/s);
  await tab.click('.danger');
  assert.deepEqual(server.posted, []);
  await tab.click('.danger');
  await tab.waitForSelector('.sheet', { state: 'hidden' });
  show(2, { removed: ['scan_01.ply'] });
  await tab.click('text=Bring it back');
  await tab.click('text=Write the result now');
  await tab.setInputFiles('.tools input', { name: 'scan 07.ply', mimeType: 'application/octet-stream', buffer: Buffer.from('ply\n') });
  while (server.posted.length < 4) await new Promise((resolve) => setImmediate(resolve));
  assert.deepEqual(server.posted.sort(), ['DELETE /scans/scan_01.ply', 'POST /result', 'POST /scans scan 07.ply', 'POST /scans/scan_01.ply/restore']);
  await close();
});

test('trouble that somebody must deal with is told beside the notes, too', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  show(2);
  await revision_is(tab, 3);
  show(2, { revision: 4, notes: [{ revision: 4, level: 'bad', file: 'scan_07.ply', text: 'scan_07.ply could not be stored and waits: no room' }] });
  await tab.waitForSelector('.toast:has-text("scan_07.ply could not be stored")');
  await close();
});

test('what the server refuses is said', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  show(1);
  await revision_is(tab, 2);
  await tab.route('**/result*', (route) => route.fulfill({ status: 507, contentType: 'application/json', body: '{"error": "the disk is full"}' }));
  await tab.click('text=Write the result now');
  await tab.waitForSelector('.toast:has-text("the disk is full")');
  await close();
});

test('a token in the address goes along with every request', { timeout: kPatience }, async () => {
  server.token = 'a b&c';
  const { tab, faults, close } = await opened({ at: `${url}?token=${encodeURIComponent('a b&c')}` });
  show(1);
  await values_are(tab, 1);
  assert.deepEqual(faults, []);
  await close();
});

test('five hundred updates leave no memory and no elements behind', { timeout: 5 * kPatience }, async () => {
  const { tab, faults, close } = await opened();
  const session = await tab.context().newCDPSession(tab);
  const measure = async () => {
    await session.send('HeapProfiler.collectGarbage');
    const { usedSize } = await session.send('Runtime.getHeapUsage');
    const { nodes, documents } = await session.send('Memory.getDOMCounters');
    const gpu = await tab.evaluate(() => ({ ...window.asbuilt.view.viewer.renderer.info.memory }));
    return { heap: usedSize / 1e6, nodes, documents, ...gpu };
  };
  const values = example_values(mesh, 8, 0).json;
  const update = async (i) => {
    server.set(example_state(mesh, 8, { revision: 100 + i, surface_revision: 100 + i }), { ...values, revision: 100 + i });
    await revision_is(tab, 100 + i);
    await values_are(tab, 100 + i);
  };
  for (let i = 0; i < 50; ++i) await update(i);
  const start = await measure();
  for (let i = 50; i < 550; ++i) await update(i);
  const end = await measure();
  console.log(`# memory before and after 500 updates: ${JSON.stringify(start)} ${JSON.stringify(end)}`);
  // One update's values are some 100 kB here: a leak of one array each would be 50 MB.
  assert.ok(end.heap < start.heap + 5, `${start.heap} MB grew to ${end.heap} MB`);
  assert.ok(end.nodes < start.nodes + 500, `${start.nodes} nodes grew to ${end.nodes}`);
  assert.equal(end.geometries, start.geometries);
  assert.equal(end.textures, start.textures);
  assert.deepEqual(faults, []);
  await close();
});

for (const width of [1920, 1280, 390]) {
  test(`the page fits ${width} px without scrolling sideways`, { timeout: kPatience }, async () => {
    const { tab, faults, close } = await opened({ width, height: 800 });
    show(9);
    await values_are(tab, 9);
    assert.ok(await fits_its_width(tab));
    const size = await tab.$eval('#now', (element) => Number.parseFloat(getComputedStyle(element).fontSize));
    assert.ok(size >= 22, `the line is ${size} px high`);
    const small = await tab.$$eval('#page button', (list) => list.filter((button) => button.offsetParent && !button.closest('.sensor-labels') && button.getBoundingClientRect().height < 44).length);
    assert.equal(small, 0, 'every button is large enough for a finger');
    assert.deepEqual(faults, []);
    await close();
  });
}
