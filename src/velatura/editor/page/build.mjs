// Bundles the page and the notebook's widget into ../static, and unpacks the environments.

import { copyFile, cp, mkdir, readFile, readdir, rm, stat, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { build, context } from 'esbuild';

const STATIC = '../static';
const LICENCES = '../../../../THIRD-PARTY-LICENSES.txt'; // of all that the page carries; part of the package's metadata
const ENVIRONMENTS = ['apartment', 'city', 'forest', 'lobby', 'sunset', 'workshop'];

const options = {
  outdir: STATIC,
  bundle: true,
  format: 'esm',
  minify: true,
  target: 'es2022',
  legalComments: 'linked',
  logLevel: 'warning',
};

const page = { ...options, entryPoints: { editor: 'main.js' }, sourcemap: true };
const widget = { ...options, entryPoints: { widget: 'widget.js' } };

/** The picture that a module of @pmndrs/assets holds as a data URL. */
async function environment(name) {
  const { default: url } = await import(`@pmndrs/assets/hdri/${name}.exr.js`);
  return Buffer.from(url.slice(url.indexOf(',') + 1), 'base64');
}

/** The licences as they are committed; throws where that of a package that the page carries differs or is missing. */
async function licences(packages) {
  const text = await readFile(LICENCES, 'utf8');
  for (const name of packages) {
    const own = `${name}\n\n${await readFile(`node_modules/${name}/LICENSE`, 'utf8')}`;
    if (!text.includes(own)) throw new Error(`THIRD-PARTY-LICENSES.txt lacks this:\n\n${own}`);
  }
  return text;
}

/** Removes what lies there of earlier builds; all else was written over, so that open pages lack nothing meanwhile. */
async function removeOlder(time) {
  const entries = await readdir(STATIC, { recursive: true, withFileTypes: true });
  for (const entry of entries.filter((entry) => entry.isFile())) {
    const file = join(entry.parentPath ?? entry.path, entry.name);
    if ((await stat(file)).mtimeMs < time) await rm(file);
  }
}

const { dependencies } = JSON.parse(await readFile('package.json', 'utf8'));
const carried = [...Object.keys(dependencies), 'fflate', '@pmndrs/assets']; // three carries a copy of fflate

const begun = Date.now() - 1000; // file systems round times
await mkdir(`${STATIC}/environments`, { recursive: true });
for (const name of ['index.html', 'opened.js']) await copyFile(name, `${STATIC}/${name}`);
await cp('thumbnails', `${STATIC}/thumbnails`, { recursive: true });
await writeFile(`${STATIC}/LICENSES.txt`, await licences(carried));
for (const name of ENVIRONMENTS) await writeFile(`${STATIC}/environments/${name}.exr`, await environment(name));
const entries = [page, widget];
if (process.argv.includes('--watch')) {
  for (const entry of entries) await (await context(entry)).watch();
} else {
  for (const entry of entries) await build(entry);
  await removeOlder(begun);
}
