// SPDX-License-Identifier: Apache-2.0
// What the tests of both pages share: the built pages, Chromium without a graphics card, and a page that tells its faults.
import { createRequire } from 'node:module';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const web = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
const folder = process.env.ASBUILT_WEB_FOLDER ?? web;
const { chromium } = createRequire(join(folder, 'package.json'))('playwright-core');

/** CI has two loaded cores: whatever happens at all happens within this. */
export const kPatience = 120000;

export const built_page = (name) => readFileSync(join(folder, process.env.ASBUILT_WEB_FOLDER ? '' : 'dist', `${name}.html`), 'utf8');

export const launch = () => chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', timeout: kPatience,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-dev-shm-usage', '--enable-precise-memory-info', '--js-flags=--expose-gc'],
});

/** A tab of the given size; `faults` collects errors of any kind and requests to other places than `home`. */
export async function open_tab(browser, { width = 1280, height = 800, home = 'file:', ...more } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, ...more });
  const tab = await context.newPage();
  tab.setDefaultTimeout(kPatience);
  const faults = [];
  tab.on('console', (message) => { if (['error', 'warning'].includes(message.type())) faults.push(`${message.type()}: ${message.text()}`); });
  tab.on('pageerror', (error) => faults.push(`uncaught: ${error.message}`));
  tab.on('request', (request) => { if (!request.url().startsWith(home) && !/^(data|blob):/.test(request.url())) faults.push(`asked ${request.url()}`); });
  return { tab, faults, close: () => context.close() };
}

export function own_folder() {
  const path = mkdtempSync(join(tmpdir(), 'asbuilt-web-'));
  return { path, remove: () => rmSync(path, { recursive: true, force: true }) };
}

/** Shares of the canvas' pixels: {drawn: not background, colours: how many different (in steps of 16)}. */
export const canvas_figures = (tab) => tab.evaluate(() => {
  const { viewer } = (window.asbuilt.view);
  viewer.draw();
  const canvas = document.createElement('canvas');
  Object.assign(canvas, { width: viewer.canvas.width, height: viewer.canvas.height });
  const context = canvas.getContext('2d');
  context.drawImage(viewer.canvas, 0, 0);
  const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
  const colours = new Set();
  let drawn = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] === data[0] && data[i + 1] === data[1] && data[i + 2] === data[2]) continue;
    ++drawn;
    colours.add(((data[i] >> 4) << 8) | ((data[i + 1] >> 4) << 4) | (data[i + 2] >> 4));
  }
  return { drawn: drawn / (data.length / 4), colours: colours.size };
});

/** Where a point of the model lies on the screen; the view flies there first, looking from `direction`, and stands still. */
export async function screen_place(tab, point, direction) {
  return tab.evaluate(([at, from]) => {
    const { viewer } = window.asbuilt.view;
    const Vector = viewer.orbit.target.constructor;
    viewer.fly_to({ target: new Vector(...at), direction: new Vector(...from), radius: viewer.surface.box.diameter / 4, animate: false });
    viewer.draw();
    const box = viewer.canvas.getBoundingClientRect();
    const [x, y] = viewer.project(at);
    return { x: box.left + x, y: box.top + y };
  }, [point, direction]);
}

export const fits_its_width = (tab) => tab.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth);
