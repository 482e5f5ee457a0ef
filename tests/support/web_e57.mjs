// SPDX-License-Identifier: Apache-2.0
// node web_e57.mjs FOLDER_OF_WEB_E57 FILE.e57: the points of all scans as lines "x y z", poses applied, in metres, as the
// npm package web-e57 (a reader that shares nothing with ours) sees them.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, file] = process.argv.slice(2);
const glue = await import(pathToFileURL(`${folder}/e57_bg.js`));
const module = await WebAssembly.compile(readFileSync(`${folder}/e57_bg.wasm`));
const instance = await WebAssembly.instantiate(module, { "./e57_bg.js": glue });
glue.__wbg_set_wasm(instance.exports);
process.stdout.write(glue.convertE57(new Uint8Array(readFileSync(file)), "XYZ"));
