// SPDX-License-Identifier: Apache-2.0
// Makes report.html and live.html: one file each, style and script inlined, nothing fetched from anywhere.
//   node build.mjs --out DIR [--modules DIR]     DIR with node_modules in it; this folder if not given
import { createRequire } from 'node:module';
import { mkdirSync, readFileSync, renameSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

const here = dirname(fileURLToPath(import.meta.url));
const { values: options } = parseArgs({ options: { out: { type: 'string' }, modules: { type: 'string', default: here } } });
if (!options.out) throw new Error('--out DIR is missing: the folder that the pages are written to');
const modules = resolve(options.modules);
const esbuild = createRequire(join(modules, 'package.json'))('esbuild');

/** The one output of a bundle, as text that can stand inside a script or style element. */
async function bundle(entry) {
  const result = await esbuild.build({
    entryPoints: [join(here, 'src', entry)],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: ['chrome100', 'firefox100', 'safari15'],
    charset: 'utf8',
    legalComments: 'inline',
    nodePaths: [join(modules, 'node_modules')],
    logLevel: 'warning',
  });
  return result.outputFiles[0].text.trim();
}

/** Replaces `mark` once; a replacement string of String.replace would read `$&` in minified code. */
function put(html, mark, text) {
  const parts = html.split(mark);
  if (parts.length !== 2) throw new Error(`the page holds ${parts.length - 1} times ${mark}, not once`);
  return parts.join(text);
}

async function page(name) {
  const style = (await bundle(`${name}.css`)).replaceAll('</style', '<\\/style');
  // A literal `</script` ends the element and `<!--` changes how the rest is read; both only occur in strings.
  const script = (await bundle(`${name}.js`)).replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
  let html = readFileSync(join(here, 'src', `${name}.html`), 'utf8');
  html = put(html, '<!-- style -->', `<style>${style}</style>`);
  html = put(html, '<!-- script -->', `<script>${script}</script>`);
  mkdirSync(options.out, { recursive: true });
  const file = join(options.out, `${name}.html`);
  writeFileSync(`${file}.part`, html);
  renameSync(`${file}.part`, file);
  console.log(`${file}: ${(html.length / 1024).toFixed(0)} kB`);
}

for (const name of ['report', 'live']) await page(name);
