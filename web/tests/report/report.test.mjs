// SPDX-License-Identifier: Apache-2.0
// Clicks through the report page in Chromium, with a report whose contents are known.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { built_page, canvas_figures, fits_its_width, kPatience, launch, open_tab, own_folder, screen_place } from '../support/browser.mjs';
import { example_report, report_html, true_deviation } from '../support/example-report.mjs';

const example = example_report({ triangles: 12000 });
const { report, mesh, deviation } = example;
let browser, folder, url;

before(async () => {
  folder = own_folder();
  const file = join(folder.path, 'report.html');
  writeFileSync(file, report_html(built_page('report'), example));
  url = pathToFileURL(file).href;
  browser = await launch();
}, { timeout: kPatience });

after(async () => {
  await browser?.close();
  folder?.remove();
});

async function opened(options) {
  const page = await open_tab(browser, options);
  await page.tab.goto(url);
  await page.tab.waitForSelector('html[data-ready]', { state: 'attached' });
  return page;
}

/** The scanned vertex nearest to a place of the plate. */
const vertex_at = (s, y, side) => mesh.vertices.reduce((best, vertex, v) => {
  const distance = vertex.side === side && Number.isFinite(deviation[v]) ? Math.hypot(vertex.s - s, vertex.y - y) : Infinity;
  return distance < best.distance ? { v, distance } : best;
}, { distance: Infinity }).v;

test('the verdict, its reason and the key figures stand first', { timeout: kPatience }, async () => {
  const { tab, faults, close } = await opened();
  assert.equal(await tab.textContent('#verdict'), 'fail');
  const figures = await tab.$$eval('.figure dd', (list) => list.map((each) => each.firstChild.textContent));
  assert.ok(figures.includes('8 of 10'), figures.join(' | '));
  assert.ok(figures.some((text) => text.startsWith('\u2212')), 'the worst deviation has a true minus');
  const top = await tab.$eval('.verdict', (element) => element.getBoundingClientRect().top);
  assert.ok(top < 200);
  assert.deepEqual(faults, []);
  await close();
});

test('every colouring draws, and each looks different', { timeout: kPatience }, async () => {
  const { tab, faults, close } = await opened();
  const pictures = new Set();
  for (const mode of ['deviation', 'coverage', 'uncertainty', 'scan', 'regions', 'faces']) {
    await tab.click(`[data-mode=${mode}]`);
    assert.equal(await tab.getAttribute(`[data-mode=${mode}]`, 'aria-pressed'), 'true');
    const { drawn, colours } = await canvas_figures(tab);
    assert.ok(drawn > 0.1 && drawn < 0.9, `${mode}: ${drawn} of the canvas is drawn on`);
    assert.ok(colours > 4, `${mode}: ${colours} colours`);
    pictures.add(await tab.evaluate(() => { window.asbuilt.view.viewer.draw(); return window.asbuilt.view.viewer.canvas.toDataURL(); }));
    assert.ok(await tab.isVisible('.stage .legend .swatches'), 'the legend names what was not scanned');
  }
  assert.equal(pictures.size, 6);
  assert.deepEqual(faults, []);
  await close();
});

test('a picked point tells the deviation that was planted there, its scans and its face', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  // The middle of each dent, and two places without.
  for (const [s, y, side] of [[40, 40, 1], [155, 85, 1], [30, 92, 0], [20, 60, 1], [160, 20, 1]]) {
    const v = vertex_at(s, y, side);
    const { point, normal } = mesh.vertices[v];
    const { x, y: at_y } = await screen_place(tab, point, normal);
    await tab.mouse.click(x, at_y);
    const read = Number(await tab.getAttribute('.readout .value', 'data-deviation'));
    // Within a pixel of the vertex: noise of the neighbours (3 sigma of 0.03 mm) and the slope of the dent.
    assert.ok(Math.abs(read - true_deviation(mesh.vertices[v])) < 0.12, `at ${s}, ${y}: read ${read}, planted ${true_deviation(mesh.vertices[v])}`);
    const shown = await tab.textContent('.readout .value');
    assert.ok(read >= 0 || shown.startsWith('\u2212'), shown);
    const text = await tab.textContent('.readout');
    const face = mesh.faces[mesh.triangles.findIndex((vertex) => vertex === v) / 3 | 0];
    assert.ok(text.includes(report.faces[face].name), `${text} names ${report.faces[face].name}`);
  }
  await close();
});

test('where nothing was scanned a pick says so', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const vertex = mesh.vertices.find(({ s, y, side }) => side === 0 && Math.hypot(s - 70, y - 36) < 5);
  const { x, y } = await screen_place(tab, vertex.point, vertex.normal);
  await tab.mouse.click(x, y);
  assert.equal(await tab.textContent('.readout .value'), 'not scanned');
  await close();
});

test('a press on a region or a face flies there', { timeout: kPatience }, async () => {
  const { tab, faults, close } = await opened();
  const target = () => tab.evaluate(() => window.asbuilt.view.viewer.orbit.target.toArray());
  await tab.click('.pick-list li:nth-child(2)');
  const [x, y, z] = report.regions[1].centre;
  await tab.waitForFunction(([a, b, c]) => {
    const [p, q, r] = window.asbuilt.view.viewer.orbit.target.toArray();
    return Math.hypot(p - a, q - b, r - c) < 3;
  }, [x, y, z]);
  await tab.click('.tabs button:nth-child(2)');
  const before_face = await target();
  await tab.click('.pick-list li:nth-child(4)');
  await tab.waitForFunction((old) => window.asbuilt.view.viewer.orbit.target.toArray().some((value, k) => Math.abs(value - old[k]) > 1), before_face);
  assert.deepEqual(faults, []);
  await close();
});

test('range, steps, outline and sensors can be changed', { timeout: kPatience }, async () => {
  const { tab, faults, close } = await opened();
  await tab.fill('.range input >> nth=1', '1.2');
  await tab.press('.range input >> nth=1', 'Tab');
  await tab.waitForFunction(() => document.querySelector('.stage .scale').getAttribute('aria-label').endsWith('to 1.2'));
  await tab.fill('.range input >> nth=1', '-5');
  await tab.press('.range input >> nth=1', 'Tab');
  assert.match(await tab.getAttribute('.stage .scale', 'aria-label'), /to 1\.2$/, 'a range that does not hold zero is not taken');
  await tab.click('.range .quiet');
  await tab.check('label:has-text("Discrete steps") input');
  assert.ok(await tab.$$eval('.stage .scale rect', (list) => list.length) > 8);
  await tab.check('label:has-text("Sensors") input');
  await tab.waitForFunction(() => document.querySelectorAll('.sensor').length === 8);
  assert.deepEqual(faults, []);
  await close();
});

test('mouse, keyboard and touch all turn the part', { timeout: kPatience }, async () => {
  const { tab, close } = await opened({ hasTouch: true });
  const angle = () => tab.evaluate(() => window.asbuilt.view.viewer.orbit.azimuth);
  const start = await angle();
  const box = await (await tab.$('.view-host canvas')).boundingBox();
  await tab.mouse.move(box.x + 300, box.y + 200);
  await tab.mouse.down();
  await tab.mouse.move(box.x + 380, box.y + 220, { steps: 4 });
  await tab.mouse.up();
  const turned = await angle();
  assert.ok(Math.abs(turned - start) > 0.1);
  await tab.focus('.view-host canvas');
  await tab.keyboard.press('ArrowLeft');
  assert.ok(Math.abs((await angle()) - turned) > 0.05);
  const distance = await tab.evaluate(() => window.asbuilt.view.viewer.orbit.distance);
  const session = await tab.context().newCDPSession(tab);
  const fingers = (gap) => [{ x: box.x + 300 - gap, y: box.y + 200, id: 1 }, { x: box.x + 300 + gap, y: box.y + 200, id: 2 }];
  await session.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: fingers(40) });
  for (const gap of [60, 90, 120]) await session.send('Input.dispatchTouchEvent', { type: 'touchMove', touchPoints: fingers(gap) });
  await session.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  await tab.waitForFunction((old) => window.asbuilt.view.viewer.orbit.distance < 0.6 * old, distance);
  await close();
});

test('nothing is drawn while nothing changes', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const frames = () => tab.evaluate(() => window.asbuilt.view.viewer.frames);
  await tab.evaluate(() => new Promise((resolve) => { let left = 5; const wait = () => (left-- ? requestAnimationFrame(wait) : resolve()); wait(); }));
  const before_wait = await frames();
  await tab.evaluate(() => new Promise((resolve) => { let left = 20; const wait = () => (left-- ? requestAnimationFrame(wait) : resolve()); wait(); }));
  assert.equal(await frames(), before_wait);
  await close();
});

test('fixed views are pictures of the part, not blank and not alike', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const sources = await tab.$$eval('.pictures img', (images) => images.map((image) => image.src));
  assert.equal(sources.length, 8);
  assert.equal(new Set(sources).size, 8);
  for (const source of sources) assert.ok(source.startsWith('data:image/png') && source.length > 2000);
  await close();
});

test('what was rejected is there with its reason, and the graph has a node a scan', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const text = await tab.textContent('.not-used');
  for (const scan of report.scans.filter(({ status }) => status !== 'accepted')) assert.ok(text.includes(scan.name) && text.includes(scan.reason));
  assert.equal(await tab.$$eval('.graph .node', (nodes) => nodes.length), 8);
  assert.equal(await tab.$$eval('.graph .link', (links) => links.length), report.graph.links.length);
  await close();
});

for (const width of [1920, 1280, 390]) {
  test(`the page fits ${width} px without scrolling sideways`, { timeout: kPatience }, async () => {
    const { tab, faults, close } = await opened({ width, height: 844 });
    assert.ok(await fits_its_width(tab));
    assert.deepEqual(faults, []);
    await close();
  });
}

test('it prints to a PDF of a few pages', { timeout: kPatience }, async () => {
  const { tab, close } = await opened();
  const pdf = await tab.pdf({ preferCSSPageSize: true, printBackground: true });
  assert.equal(pdf.subarray(0, 5).toString(), '%PDF-');
  const pages = pdf.toString('latin1').match(/\/Type\s*\/Page[^s]/g).length;
  assert.ok(pages >= 2 && pages <= 9, `${pages} pages`);
  await close();
});

test('without a scene, and without data at all, the page says so', { timeout: kPatience }, async () => {
  const file = join(folder.path, 'bare.html');
  writeFileSync(file, report_html(built_page('report'), { report, scene: null }));
  const { tab, faults, close } = await open_tab(browser);
  await tab.goto(pathToFileURL(file).href);
  await tab.waitForSelector('html[data-ready]', { state: 'attached' });
  assert.match(await tab.textContent('.problem'), /no surface/);
  assert.equal(await tab.textContent('#verdict'), 'fail');
  writeFileSync(file, built_page('report'));
  await tab.goto(pathToFileURL(file).href);
  await tab.waitForSelector('.problem');
  assert.match(await tab.textContent('.problem'), /holds no report/);
  assert.deepEqual(faults, []);
  await close();
});

test('text from files stays text', { timeout: kPatience }, async () => {
  const hostile = '<img src=x onerror=alert(1)></script><b>';
  const scans = report.scans.map((scan) => ({ ...scan, name: hostile, reason: hostile }));
  const file = join(folder.path, 'hostile.html');
  writeFileSync(file, report_html(built_page('report'), { ...example, report: { ...report, summary: hostile, scans, faces: report.faces.map((face) => ({ ...face, name: hostile })) } }));
  const { tab, faults, close } = await open_tab(browser);
  await tab.goto(pathToFileURL(file).href);
  await tab.waitForSelector('html[data-ready]', { state: 'attached' });
  assert.equal(await tab.textContent('.summary'), hostile);
  assert.equal(await tab.$$eval('#page img[src=x]', (list) => list.length), 0);
  assert.deepEqual(faults, []);
  await close();
});
