// All builds of the module, and workers, give the bits of this machine's library, for all golden assets.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Asset, Cursor, Device, Pool, Scene, builds, golden, goldenNames, nameOf, nativeAnswers, nativeRays } from './common.mjs';

const transform = [0, -2, 0, 1, 1.5, 0, 0, 2, 0, 0.25, 1, 3];

/** Compared as bits: NaN and the sign of zero count. */
function same(ours, theirs, what) {
  const bytes = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength);
  if (bytes(ours).equals(bytes(theirs))) return;
  const at = ours.findIndex((value, i) => !Object.is(value, theirs[i]));
  assert.fail(`${what}: entry ${at} is ${ours[at]}, not ${theirs[at]}`);
}

const all = (...names) => Object.fromEntries(names.map((name) => [name, true]));
const wantedAnswers = all('visible', 'visibleBits', 'probability', 'certain', 'logit');
const wantedHits = all('hit', 't', 'normal', 'instance', 'object', 'triangle', 'u', 'v', 'certain', 'tLow', 'tHigh', 'color', 'user');

/** The next case of the file; ask(rays) gives answers and hits. Returns how many rays it has. */
async function compare(cursor, what, ask) {
  const n = nativeRays;
  const rays = cursor.take(Float32Array, 8 * n);
  const answers = {
    visible: cursor.take(Uint8Array, n),
    visibleBits: cursor.take(Uint8Array, n / 8),
    probability: cursor.take(Float32Array, n),
    certain: cursor.take(Uint8Array, n),
    logit: cursor.take(Int32Array, n),
  };
  const hits = { hit: cursor.take(Uint8Array, n), t: cursor.take(Float32Array, n), normal: cursor.take(Float32Array, 3 * n) };
  for (const name of ['instance', 'object', 'triangle']) hits[name] = cursor.take(Uint32Array, n);
  for (const name of ['u', 'v']) hits[name] = cursor.take(Float32Array, n);
  hits.certain = cursor.take(Uint8Array, n);
  for (const name of ['tLow', 'tHigh']) hits[name] = cursor.take(Float32Array, n);
  hits.color = cursor.take(Float32Array, 3 * n);
  hits.user = cursor.take(BigUint64Array, n);

  const ours = await ask(rays);
  // nif.h: the last bits of the probability may differ between machines, the other outputs never.
  const { probability, ...exact } = answers;
  for (const [name, theirs] of Object.entries(exact)) same(ours.answers[name], theirs, `${what}, ${name}`);
  for (let i = 0; i < n; ++i)
    if (!(Math.abs(ours.answers.probability[i] - probability[i]) <= 1e-6))
      assert.fail(`${what}, probability: ray ${i} has ${ours.answers.probability[i]}, not ${probability[i]}`);
  for (const [name, theirs] of Object.entries(hits)) same(ours.hits[name], theirs, `${what}, hits.${name}`);
  return n;
}

const askScene = (scene) => (rays) => ({ answers: scene.query(rays, wantedAnswers), hits: scene.intersect({ rays }, wantedHits) });

for (const build of builds)
  test(`all golden assets have the native bits: ${nameOf(build)}`, async () => {
    const device = await Device.create(build);
    assert.equal(device.isa, build.simd ? 'wasm' : 'scalar');
    let rays = 0;
    for (const name of goldenNames) {
      const asset = await Asset.load(device, golden(name));
      const cursor = new Cursor(nativeAnswers(name));
      for (let object = 0; object <= asset.info.objectCount; ++object) {
        const scene = new Scene(device);
        if (object < asset.info.objectCount) scene.addInstance(asset, object);
        else scene.addAsset(asset, transform);
        scene.commit();
        rays += await compare(cursor, `${name}, object ${object}`, askScene(scene));
        scene.dispose();
      }
      assert.ok(cursor.done);
      asset.dispose();
    }
    device.dispose();
    assert.ok(rays >= 1e6, `${rays} rays`);
  });

test('workers have the native bits', async () => {
  const name = 'v2-exact.nif';
  const pool = await Pool.create({ workers: 2, assets: [golden(name)], instances: [{ asset: 0, object: 0 }] });
  const cursor = new Cursor(nativeAnswers(name));
  const ask = async (rays) => ({ answers: await pool.query(rays, wantedAnswers), hits: await pool.intersect({ rays }, wantedHits) });
  await compare(cursor, 'object 0', ask);
  await pool.setInstances([{ asset: 0, object: 1 }]);
  await compare(cursor, 'object 1', ask);
  pool.dispose();
});

test('every layout of rays gives the same answers', async () => {
  const device = await Device.create();
  const asset = await Asset.load(device, golden('v2-exact.nif'));
  const scene = new Scene(device);
  scene.addAsset(asset);
  scene.commit();
  const rays = new Cursor(nativeAnswers('v2-exact.nif')).take(Float32Array, 8 * nativeRays);
  const column = (first, count) => Float32Array.from({ length: nativeRays * count }, (_, i) => rays[8 * Math.floor(i / count) + first + (i % count)]);
  const separate = { origins: column(0, 3), tmin: column(3, 1), directions: column(4, 3), tmax: column(7, 1) };
  same(scene.query(separate).visible, scene.query(rays).visible, 'separate arrays');
  // One direction, one tmin and no tmax for all.
  const sun = Float32Array.of(0.3, 0.8, 0.1);
  const spelled = new Float32Array(rays);
  for (let i = 0; i < nativeRays; ++i) spelled.set([0.25, ...sun, Infinity], 8 * i + 3);
  const { visible } = scene.query({ origins: separate.origins, directions: sun, tmin: 0.25 });
  same(visible, scene.query(spelled).visible, 'one direction');
  assert.ok(visible.includes(0) && visible.includes(1));
  // One ray, and none.
  assert.equal(scene.query({ origins: rays.subarray(0, 3), directions: rays.subarray(4, 7), tmin: rays[3], tmax: rays[7] }).visible[0], scene.query(rays.slice(0, 8)).visible[0]);
  assert.equal(scene.query(new Float32Array(0)).visible.length, 0);
  // Arrays of the caller's, with more room than is needed.
  const t = new Float32Array(nativeRays + 5).fill(-1);
  assert.equal(scene.intersect(rays, { t }).t, t);
  same(t.subarray(0, nativeRays), scene.intersect(rays).t, 't');
  assert.equal(t[nativeRays], -1);
  scene.dispose(), asset.dispose(), device.dispose();
});
