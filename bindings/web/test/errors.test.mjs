// What is wrong is said in one sentence, with the library's code, and harms nothing.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Asset, Device, NifError, Pool, Scene, builds, golden, goldenBytes, nameOf, nifkit, someRays } from './common.mjs';

const is = (codeName, text) => (error) => {
  assert.ok(error instanceof NifError, String(error.stack));
  assert.equal(error.codeName, codeName);
  assert.match(error.message, text);
  return true;
};
const wrong = (text) => is('NIF_ERROR_INVALID_ARGUMENT', text);

const device = await Device.create();
const asset = await Asset.load(device, golden('v2-exact.nif'));
const scene = new Scene(device);
scene.add(asset);
scene.commit();
const rays = someRays(100);
const expected = scene.query(rays).visible;

test('the version is that of the header', async () => {
  const { readFileSync } = await import('node:fs');
  const header = readFileSync(new URL('../../../runtime/include/nif/nif.h', import.meta.url), 'utf8');
  const numbers = ['MAJOR', 'MINOR', 'PATCH'].map((part) => Number(header.match(new RegExp(`#define NIF_VERSION_${part} (\\d+)`))[1]));
  const stated = JSON.parse(readFileSync(new URL('../../../build/web/nifkit/package.json', import.meta.url), 'utf8')).version;
  assert.equal(stated, numbers.join('.'));
  assert.equal(device._use()._web_version(), numbers[0] * 10000 + numbers[1] * 100 + numbers[2]);
});

for (const build of builds)
  test(`damaged files, at every byte and every length: ${nameOf(build)}`, async () => {
    const device = await Device.create(build);
    const bytes = goldenBytes('v2-single.nif');
    for (let i = 0; i < bytes.length; ++i) {
      const damaged = bytes.slice();
      damaged[i] ^= 0x10;
      await assert.rejects(Asset.load(device, damaged), (error) => error instanceof NifError && error.code >= 12 && error.message.startsWith('memory: '));
      await assert.rejects(Asset.load(device, bytes.subarray(0, i)), (error) => error instanceof NifError && error.code >= 12);
    }
    (await Asset.load(device, bytes)).dispose();
    device.dispose();
  });

test('files that cannot be loaded', async () => {
  await assert.rejects(Asset.load(device, new Uint8Array(0)), is('NIF_ERROR_FILE_EMPTY', /^memory: /));
  await assert.rejects(Asset.load(device, new TextEncoder().encode('NetImmerse File Format')), is('NIF_ERROR_FOREIGN_NIF', /./));
  await assert.rejects(Asset.load(device, new TextEncoder().encode('glTF is not what this is')), is('NIF_ERROR_NOT_A_NIF', /./));
  await assert.rejects(Asset.load(device, 'no/such/file.nif'), is('NIF_ERROR_FILE_NOT_FOUND', /^no\/such\/file\.nif: /));
  await assert.rejects(Asset.load(device, 'http://127.0.0.1:9/file.nif'), is('NIF_ERROR_FILE_UNREADABLE', /^http:\/\/127\.0\.0\.1:9\/file\.nif: /));
  await assert.rejects(Asset.load(device, new Blob([goldenBytes('v2-single.nif').subarray(0, 99)])), is('NIF_ERROR_FILE_TRUNCATED', /./));
  for (const nothing of [undefined, null, 7, {}, []]) await assert.rejects(Asset.load(device, nothing), wrong(/^an asset is loaded from/));
  await assert.rejects(Asset.load(undefined, golden('v2-single.nif')), wrong(/no Device/));
  (await Asset.load(device, new Blob([goldenBytes('v2-single.nif')]))).dispose();
});

test('batches that are wrong', () => {
  const f = (length) => new Float32Array(length);
  for (const [batch, text] of [
    [undefined, /^rays are/],
    [[1, 2, 3], /^origins is no Float32Array/],
    [new Float64Array(8), /^origins is no Float32Array/],
    [f(9), /no multiple of 8/],
    [{ rays: new Uint8Array(8) }, /^rays is no Float32Array/],
    [{ origins: f(3) }, /^directions is no Float32Array/],
    [{ origins: f(6), directions: f(9) }, /^origins has 6 numbers for 3 rays/],
    [{ origins: f(4), directions: f(3) }, /no whole number of points/],
    [{ origins: f(6), directions: f(3), tmin: f(3) }, /^tmin has 3 numbers for 2 rays/],
    [{ origins: f(6), directions: f(3), tmax: '1' }, /^tmax is no Float32Array/],
    [{ origins: f(3), directions: f(3), count: -1 }, /^count is -1/],
    [{ origins: f(3), directions: f(3), count: 2 ** 33 }, /^count is 8589934592/],
  ]) {
    assert.throws(() => scene.query(batch), wrong(text));
    assert.throws(() => scene.intersect(batch), wrong(text));
  }
  for (const [outputs, text] of [
    [{}, /^no output is wanted/],
    [null, /^outputs are/],
    [{ seen: true }, /^there is no output 'seen'; there are visible,/],
    [{ visible: f(100) }, /^visible is no Uint8Array/],
    [{ visible: new Uint8Array(99) }, /^visible has room for 99/],
    [{ toString: true }, /^there is no output/],
  ])
    assert.throws(() => scene.query(rays, outputs), wrong(text));
  assert.deepEqual(scene.query(rays).visible, expected);
});

test('detached buffers', async () => {
  const detached = (array) => {
    structuredClone(array.buffer, { transfer: [array.buffer] });
    return array;
  };
  assert.throws(() => scene.query(detached(someRays(10))), wrong(/^the buffer of rays is detached/));
  assert.throws(() => scene.query({ origins: new Float32Array(3), directions: detached(new Float32Array(3)) }), wrong(/^the buffer of directions is detached/));
  assert.throws(() => scene.query(rays, { visible: detached(new Uint8Array(100)) }), wrong(/^the buffer of visible is detached/));
  assert.throws(() => scene.setTransform(0, detached(new Float32Array(12))), wrong(/transform is detached/));
  await assert.rejects(Asset.load(device, detached(goldenBytes('v2-single.nif')).buffer), wrong(/asset is detached/));
  assert.deepEqual(scene.query(rays).visible, expected);
});

test('scenes that are wrong', () => {
  const empty = new Scene(device);
  assert.throws(() => empty.query(rays), is('NIF_ERROR_INVALID_OPERATION', /./));
  assert.throws(() => empty.addInstance(asset, 99), wrong(/./));
  assert.throws(() => empty.addInstance(asset, -1), wrong(/^object is -1/));
  assert.throws(() => empty.addInstance({}, 0), wrong(/no Asset/));
  assert.throws(() => empty.add(asset, [1, 2, 3]), wrong(/12 numbers/));
  assert.throws(() => empty.add(asset, new Float32Array(12)), is('NIF_ERROR_SINGULAR_TRANSFORM', /./));
  assert.throws(() => empty.add(asset, Array(12).fill(NaN)), wrong(/finite/));
  assert.throws(() => empty.setTransform(0), wrong(/no instance 0/));
  assert.throws(() => asset.object(1000), wrong(/./));
  assert.throws(() => asset.instance(1000), wrong(/./));
  assert.throws(() => new Scene(), wrong(/no Device/));
  assert.equal(empty.info.instances, 0);
  empty.commit();
  assert.ok(empty.query(rays).visible.every((bit) => bit === 1));
  empty.dispose();
});

test('what has been disposed of', async () => {
  const device = await Device.create();
  const asset = await Asset.load(device, golden('v2-exact.nif'));
  const scene = new Scene(device);
  scene.add(asset);
  scene.commit();
  device.dispose(), asset.dispose();
  // The scene keeps both alive.
  assert.deepEqual(scene.query(rays).visible, expected);
  assert.throws(() => new Scene(device), wrong(/^the device has been disposed of/));
  await assert.rejects(Asset.load(device, golden('v2-exact.nif')), wrong(/^the device has been disposed of/));
  assert.throws(() => asset.info, wrong(/^the asset has been disposed of/));
  assert.throws(() => scene.add(asset), wrong(/^the asset has been disposed of/));
  scene.dispose(), scene.dispose();
  for (const use of [() => scene.query(rays), () => scene.commit(), () => scene.info, () => scene.setTransform(0)])
    assert.throws(use, wrong(/^the scene has been disposed of/));
  assert.ok(device.disposed && asset.disposed && scene.disposed);
});

test('things that are not made by new', async () => {
  assert.throws(() => new Device(), wrong(/Device.create/));
  assert.throws(() => new Asset(), wrong(/Asset.load/));
  assert.throws(() => new Pool(), wrong(/Pool.create/));
  const other = await Device.create();
  const theirs = new Scene(other);
  assert.throws(() => theirs.add(asset), wrong(/another device/));
  theirs.dispose(), other.dispose();
});

test('engines without vectors, or without WebAssembly', async () => {
  const { validate } = WebAssembly;
  try {
    WebAssembly.validate = () => false;
    assert.equal(nifkit.hasSimd(), false);
    await assert.rejects(Device.create({ simd: true }), is('NIF_ERROR_NOT_AVAILABLE', /vectors/));
    const fallback = await Device.create();
    assert.equal(fallback.isa, 'scalar');
    fallback.dispose();
  } finally {
    WebAssembly.validate = validate;
  }
  const { WebAssembly: whole } = globalThis;
  try {
    globalThis.WebAssembly = undefined;
    await assert.rejects(Device.create(), is('NIF_ERROR_NOT_AVAILABLE', /no WebAssembly/));
  } finally {
    globalThis.WebAssembly = whole;
  }
});

test('pools', async () => {
  await assert.rejects(Pool.create({}), wrong(/^assets is no list/));
  await assert.rejects(Pool.create({ workers: 0, assets: [golden('v2-single.nif')] }), wrong(/^workers is 0/));
  await assert.rejects(Pool.create({ workers: 1, assets: ['no/such.nif'] }), is('NIF_ERROR_FILE_NOT_FOUND', /^no\/such\.nif/));
  await assert.rejects(Pool.create({ workers: 1, assets: [new Uint8Array(99)] }), is('NIF_ERROR_NOT_A_NIF', /^memory: /));
  await assert.rejects(Pool.create({ workers: 1, assets: [golden('v2-single.nif')], instances: [{ asset: 1 }] }), wrong(/no asset 1/));
  const pool = await Pool.create({ workers: 2, assets: [golden('v2-exact.nif')] });
  assert.deepEqual((await pool.query(rays)).visible, expected);
  await assert.rejects(pool.query(rays, { seen: true }), wrong(/no output 'seen'/));
  await assert.rejects(pool.setInstances([{ asset: 0, transform: new Float32Array(12) }]), is('NIF_ERROR_SINGULAR_TRANSFORM', /./));
  assert.deepEqual((await pool.query(rays)).visible, expected);
  const asked = pool.query(someRays(200000)), changed = pool.setInstances([{ asset: 0 }]);
  pool.dispose();
  await assert.rejects(asked, wrong(/^the pool has been disposed of/));
  await assert.rejects(changed, wrong(/^the pool has been disposed of/));
  await assert.rejects(pool.query(rays), wrong(/^the pool has been disposed of/));
});
