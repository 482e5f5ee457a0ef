// SPDX-License-Identifier: Apache-2.0
// Runs the tests of one folder with node's own runner:  node tests/run.mjs unit|report|live
// (and session, which drives the program itself, named in ASBUILT_PROGRAM)
// ASBUILT_WEB_FOLDER: the folder with node_modules and the built pages; web/ itself if not set.
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const group = process.argv[2];
const folder = join(here, group);
const files = readdirSync(folder).filter((name) => name.endsWith('.test.mjs')).map((name) => join(folder, name));

if (group !== 'unit') {
  const chromium = process.env.CHROMIUM ?? '/usr/bin/chromium';
  if (!existsSync(chromium)) {
    console.log(`skipped: ${chromium} is not there (Debian: chromium; or name another in CHROMIUM)`);
    process.exit(77);
  }
}
if (group === 'session' && !existsSync(process.env.ASBUILT_PROGRAM ?? '')) {
  console.log('skipped: ASBUILT_PROGRAM names no program');
  process.exit(77);
}
// The name of the reporter is the one that ctest's log can be read with, on Node 18 and later.
const result = spawnSync(process.execPath, ['--test', ...files], { stdio: 'inherit' });
process.exit(result.status ?? 1);
