// node speed.mjs ASSET NATIVE [ROUNDS]: rates of the package beside those of NATIVE, which is speed.cpp, in turns.
import { execFileSync } from 'node:child_process';

import { Asset, Device, Pool, Scene } from './common.mjs';

const [assetFile, native, rounds = '9'] = process.argv.slice(2);
const count = 400000;

function makeRays({ boundsMin, boundsMax }) {
  let state = 1;
  const unit = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
  const rays = new Float32Array(8 * count);
  for (let i = 0; i < count; ++i) {
    for (let a = 0; a < 3; ++a) {
      const size = boundsMax[a] - boundsMin[a];
      const from = boundsMin[a] + size * (1.5 * unit() - 0.25);
      const to = boundsMin[a] + size * unit();
      rays[8 * i + a] = from;
      rays[8 * i + 4 + a] = to - from;
    }
    rays[8 * i + 7] = Infinity;
  }
  return rays;
}

const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];

/** The best of five, in million rays a second. */
async function rate(ask) {
  let best = 0;
  for (let i = 0; i < 5; ++i) {
    const start = performance.now();
    await ask();
    best = Math.max(best, count / (performance.now() - start) / 1000);
  }
  return best;
}

const began = performance.now();
const devices = { vectors: await Device.create({ simd: true }) };
const loaded = performance.now();
devices.scalar = await Device.create({ simd: false });
const scenes = {};
let assetMs;
for (const [name, device] of Object.entries(devices)) {
  const start = performance.now();
  const asset = await Asset.load(device, assetFile);
  assetMs ??= performance.now() - start;
  const scene = (scenes[name] = new Scene(device));
  scene.addAsset(asset);
  scene.commit();
}
const rays = makeRays(scenes.vectors.info);
const pools = { one: await Pool.create({ workers: 1, assets: [assetFile] }), two: await Pool.create({ workers: 2, assets: [assetFile] }) };
const rates = { native: [], vectors: [], scalar: [], one: [], two: [] };
const seen = new Set();
for (let round = 0; round < Number(rounds); ++round) {
  const [speed, visible] = execFileSync(native, [assetFile, String(count)], { encoding: 'utf8' }).split(' ').map(Number);
  rates.native.push(speed);
  seen.add(visible);
  for (const [name, scene] of Object.entries(scenes)) {
    rates[name].push(await rate(() => scene.query(rays)));
    seen.add(scene.query(rays).visible.reduce((sum, bit) => sum + bit, 0));
  }
  for (const [name, pool] of Object.entries(pools)) rates[name].push(await rate(() => pool.query(rays)));
}
if (seen.size !== 1) throw new Error('the answers differ');
const middle = Object.fromEntries(Object.entries(rates).map(([name, values]) => [name, median(values)]));
const row = (what, value, share) => console.log(`| ${what} | ${value.toFixed(2)} | ${share.toFixed(2)} |`);
console.log('| one thread | million rays a second | of native |\n| --- | --- | --- |');
row('native, SSE4', middle.native, 1);
row('WebAssembly with vectors', middle.vectors, middle.vectors / middle.native);
row('WebAssembly without', middle.scalar, middle.scalar / middle.native);
console.log('\n| workers | million rays a second | of one worker |\n| --- | --- | --- |');
row('one', middle.one, 1);
row('two', middle.two, middle.two / middle.one);
console.log(`\nThe module starts in ${(loaded - began).toFixed(0)} ms, the asset loads in ${assetMs.toFixed(0)} ms.`);
for (const pool of Object.values(pools)) pool.dispose();
