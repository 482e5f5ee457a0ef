// SPDX-License-Identifier: Apache-2.0
// Measures, asserts nothing:  node tests/measure.mjs [report.html]
// - the report page with 150 000 triangles (or a given one): size, and when which part was there;
// - the live page with 60 scans and 200 000 triangles at 1280 x 800: frames a second while it turns.
import { readdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { built_page, launch, open_tab, own_folder } from './support/browser.mjs';
import { example_part, example_state, example_values } from './support/example-live.mjs';
import { example_report, report_html } from './support/example-report.mjs';
import { LiveServer } from './support/live-server.mjs';

async function measure_report(browser, file) {
  const { tab, close } = await open_tab(browser);
  await tab.goto(pathToFileURL(file).href);
  await tab.waitForSelector('html[data-ready]', { state: 'attached' });
  const marks = await tab.evaluate(() => performance.getEntriesByType('mark').map(({ name, startTime }) => `${name.replace('asbuilt: ', '')} ${Math.round(startTime)} ms`));
  const triangles = await tab.evaluate(() => (window.asbuilt ? window.asbuilt.view.scene.triangles.length / 3 : 0));
  console.log(`report: ${triangles} triangles, ${(statSync(file).size / 1e6).toFixed(2)} MB; ${marks.join(', ')}; ${await speed(tab)}`);
  await close();
}

/** Seconds of processor time that our children used so far (Linux; 100 ticks a second). */
function processor_seconds() {
  const parents = new Map(), ticks = new Map();
  for (const pid of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').replace(/^.*\) /, '').split(' ');
      parents.set(pid, fields[1]);
      ticks.set(pid, Number(fields[11]) + Number(fields[12]));
    } catch { /* it has just ended */ }
  }
  const ours = (pid) => { for (; pid && pid !== '0'; pid = parents.get(pid)) if (pid === String(process.pid)) return true; return false; };
  return [...ticks].reduce((sum, [pid, used]) => sum + (pid !== String(process.pid) && ours(pid) ? used / 100 : 0), 0);
}

async function speed(tab) {
  const before = processor_seconds();
  const { frames, seconds } = await frames_a_second(tab);
  return `${(frames / seconds).toFixed(1)} frames a second (${((1000 * (processor_seconds() - before)) / frames).toFixed(0)} ms of processor time a frame)`;
}

/** Turns the part for four seconds, waiting for each frame to be finished. */
const frames_a_second = (tab) => tab.evaluate(async () => {
  const { viewer } = window.asbuilt.view;
  const gl = viewer.renderer.getContext();
  const pixel = new Uint8Array(4);
  let frames = 0;
  viewer.orbit.rotate(0.03, 0);
  viewer.draw();
  const start = performance.now();
  while (performance.now() - start < 4000) {
    viewer.orbit.rotate(0.03, 0);
    viewer.draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    ++frames;
    if (frames % 8 === 0) await new Promise(requestAnimationFrame);
  }
  return { frames, seconds: (performance.now() - start) / 1000 };
});

async function measure_live(browser) {
  const { mesh, surface } = example_part(200000);
  const server = new LiveServer({ page: built_page('live'), surface: JSON.stringify(surface) });
  server.set(example_state(mesh, 60), example_values(mesh, 20, 1).json);
  const { tab, close } = await open_tab(browser, { home: 'http:' });
  await tab.goto(await server.start());
  await tab.waitForFunction(() => window.asbuilt?.view.revision === 1);
  const calls = await tab.evaluate(() => { window.asbuilt.view.viewer.draw(); return window.asbuilt.view.viewer.renderer.info.render; });
  console.log(`live: ${mesh.triangles.length / 3} triangles, 60 scans, 1280 x 800: ${await speed(tab)}, ${calls.calls} draw calls, ${calls.triangles} triangles drawn`);
  await close();
  await server.stop();
}

const browser = await launch();
const folder = own_folder();
let file = process.argv[2] && resolve(process.argv[2]);
if (!file) {
  file = join(folder.path, 'report.html');
  writeFileSync(file, report_html(built_page('report'), example_report({ triangles: 150000 })));
}
await measure_report(browser, file);
await measure_live(browser);
await browser.close();
folder.remove();
