// Errors give one sentence and the library's code, and do no harm.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
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
scene.addAsset(asset);
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

/** This file with the metadata's first character changed, and the checksums right. */
function withoutJson(bytes) {
  const crc = (part) => ~part.reduce((sum, byte) => {
    sum ^= byte;
    for (let bit = 0; bit < 8; ++bit) sum = (sum >>> 1) ^ (sum & 1 ? 0x82f63b78 : 0);
    return sum;
  }, -1);
  const view = new DataView(bytes.buffer);
  const end = 64 + 32 * view.getUint32(24, true);
  for (let at = 64; at < end; at += 32) {
    if (String.fromCharCode(...bytes.subarray(at, at + 4)) !== 'META') continue;
    const first = view.getUint32(at + 8, true);
    bytes[first] = 'x'.charCodeAt(0);
    view.setInt32(at + 24, crc(bytes.subarray(first, first + view.getUint32(at + 16, true))), true);
  }
  view.setInt32(28, crc(bytes.subarray(64, end)), true);
  view.setInt32(32, 0, true);
  view.setInt32(32, crc(bytes.subarray(0, 64)), true);
  return bytes;
}

test('metadata that is no JSON is refused, and the rest is there', async () => {
  const name = 'v2-shapes.nif';
  const whole = await Asset.load(device, golden(name)), noted = await Asset.load(device, withoutJson(goldenBytes(name)));
  assert.equal(typeof whole.info.metadata, 'object');
  const { info } = noted;
  assert.deepEqual([info.objectCount, info.fileBytes], [whole.info.objectCount, whole.info.fileBytes]);
  assert.throws(() => info.metadata, (error) => is('NIF_ERROR_DAMAGED_NIF', /^the asset's metadata cannot be read as JSON: /)(error) && error.code === 32);
  whole.dispose(), noted.dispose();
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
  const both = { origins: f(6), directions: f(6) };
  assert.throws(() => scene.query({ ...both, mask: new Uint32Array(3) }), wrong(/^mask has 3 numbers for 2 rays/));
  assert.throws(() => scene.query({ ...both, mask: f(2) }), wrong(/^mask is no Uint32Array/));
  assert.throws(() => scene.query({ rays, mask: -1 }), wrong(/^mask is -1/));
  assert.throws(() => scene.queryOpen(rays, { seen: true }), wrong(/^there is no output 'seen'/));
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
  assert.throws(() => scene.setInstanceTransform(0, detached(new Float32Array(12))), wrong(/transform is detached/));
  await assert.rejects(Asset.load(device, detached(goldenBytes('v2-single.nif')).buffer), wrong(/asset is detached/));
  assert.deepEqual(scene.query(rays).visible, expected);
});

test('views of buffers that have shrunk', async () => {
  const shrunk = (Type, length, left) => {
    const buffer = new ArrayBuffer(length * (Type.BYTES_PER_ELEMENT ?? 1), { maxByteLength: 1e6 });
    const view = new Type(buffer, 0, length);
    buffer.resize(left);
    return view;
  };
  assert.throws(() => scene.query(shrunk(Float32Array, 80, 316)), wrong(/^the buffer of rays is detached or too small/));
  assert.throws(() => scene.query({ origins: shrunk(Float32Array, 3, 0), directions: shrunk(Float32Array, 3, 0) }), wrong(/^the buffer of origins is/));
  assert.throws(() => scene.query(new Float32Array(0), { visible: shrunk(Uint8Array, 9, 8) }), wrong(/^the buffer of visible is/));
  assert.throws(() => scene.setInstanceTransform(0, shrunk(Float32Array, 12, 40)), wrong(/^the buffer of the transform is/));
  await assert.rejects(Asset.load(device, shrunk(Uint8Array, 99, 98)), wrong(/^the buffer of the asset is/));
  await assert.rejects(Asset.load(device, shrunk(DataView, 99, 98)), wrong(/^the buffer of the asset is/));
  // What is as long as its buffer follows it.
  const buffer = new ArrayBuffer(64 * 4, { maxByteLength: 1e6 });
  const following = new Float32Array(buffer);
  buffer.resize(32 * 4);
  assert.equal(scene.query(following).visible.length, 4);
});

test('scenes that are wrong', () => {
  const empty = new Scene(device);
  assert.throws(() => empty.query(rays), is('NIF_ERROR_INVALID_OPERATION', /./));
  assert.throws(() => empty.addInstance(asset, 99), wrong(/./));
  assert.throws(() => empty.addInstance(asset, -1), wrong(/^object is -1/));
  assert.throws(() => empty.addInstance({}, 0), wrong(/no Asset/));
  assert.throws(() => empty.addAsset(asset, [1, 2, 3]), wrong(/12 numbers/));
  assert.throws(() => empty.addAsset(asset, new Float32Array(12)), is('NIF_ERROR_SINGULAR_TRANSFORM', /./));
  assert.throws(() => empty.addAsset(asset, Array(12).fill(NaN)), wrong(/finite/));
  assert.throws(() => empty.setInstanceTransform(0), wrong(/no instance 0/));
  assert.throws(() => asset.object(1000), wrong(/./));
  assert.throws(() => asset.instance(1000), wrong(/./));
  assert.throws(() => new Scene(), wrong(/no Device/));
  for (const call of [
    () => empty.removeInstance(0),
    () => empty.instance(0),
    () => empty.setInstanceTransforms(null, Array(12).fill(1)),
    () => empty.setInstanceTransforms([0, 1], Array(12).fill(1)),
    () => empty.setInstanceTransforms([-1], Array(12).fill(1)),
    () => empty.setInstanceTransforms(null, Array(13).fill(1)),
    () => empty.setInstanceOrigin(0, [0, 0, 0]),
    () => empty.setOrigin([0, NaN, 0]),
    () => empty.setOrigin([0, 0]),
    () => empty.setInstanceMask(0, 1),
    () => empty.setInstanceMask(0, 2 ** 32),
    () => empty.setInstanceFlags(0, 1),
    () => empty.setInstanceUser(0, 1),
    ...[-1, 0.5, 2n ** 64n, NaN, 'one', {}, undefined].map((user) => () => empty.setInstanceUser(0, user)),
  ])
    assert.throws(call, wrong(/./));
  assert.equal(empty.info.instanceCount, 0);
  empty.commit();
  assert.ok(empty.query(rays).visible.every((bit) => bit === 1));
  empty.dispose();
});

test('what has been disposed of', async () => {
  const device = await Device.create();
  const asset = await Asset.load(device, golden('v2-exact.nif'));
  const scene = new Scene(device);
  scene.addAsset(asset);
  scene.commit();
  device.dispose(), asset.dispose();
  // The scene keeps both alive.
  assert.deepEqual(scene.query(rays).visible, expected);
  assert.throws(() => new Scene(device), wrong(/^the device has been disposed of/));
  await assert.rejects(Asset.load(device, golden('v2-exact.nif')), wrong(/^the device has been disposed of/));
  assert.throws(() => asset.info, wrong(/^the asset has been disposed of/));
  assert.throws(() => scene.addAsset(asset), wrong(/^the asset has been disposed of/));
  scene.dispose(), scene.dispose();
  const transform = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
  const placing = [() => scene.addAsset(asset, transform), () => scene.addInstance(asset, 0, transform), () => scene.setInstanceTransform(0, transform)];
  const others = [() => scene.query(rays), () => scene.commit(), () => scene.info, () => scene.setOrigin(null), () => scene.instance(0)];
  for (const use of [...others, () => scene.setInstanceTransform(0), ...placing])
    assert.throws(use, wrong(/^the scene has been disposed of/));
  const other = await Device.create();
  const loading = Asset.load(other, golden('v2-exact.nif'));
  other.dispose();
  await assert.rejects(loading, wrong(/^the device has been disposed of/));
  assert.ok(device.disposed && asset.disposed && scene.disposed);
});

test('things that are not made by new', async () => {
  assert.throws(() => new Device(), wrong(/Device.create/));
  assert.throws(() => new Asset(), wrong(/Asset.load/));
  assert.throws(() => new Pool(), wrong(/Pool.create/));
  const other = await Device.create();
  const theirs = new Scene(other);
  assert.throws(() => theirs.addAsset(asset), wrong(/another device/));
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

test('a module that cannot be instantiated', async () => {
  const { instantiate } = WebAssembly;
  try {
    WebAssembly.instantiate = () => Promise.reject(new RangeError('Cannot allocate Wasm memory for new instance'));
    await assert.rejects(Device.create(), is('NIF_ERROR_OUT_OF_MEMORY', /^the module cannot be started: Cannot allocate/));
  } finally {
    WebAssembly.instantiate = instantiate;
  }
  (await Device.create()).dispose();
});

test('pools', async () => {
  await assert.rejects(Pool.create({}), wrong(/^assets is no list/));
  await assert.rejects(Pool.create({ workers: 0, assets: [golden('v2-single.nif')] }), wrong(/^workers is 0/));
  await assert.rejects(Pool.create({ workers: 1, assets: ['no/such.nif'] }), is('NIF_ERROR_FILE_NOT_FOUND', /^no\/such\.nif/));
  await assert.rejects(Pool.create({ workers: 1, assets: [new Uint8Array(99)] }), is('NIF_ERROR_NOT_A_NIF', /^memory: /));
  await assert.rejects(Pool.create({ workers: 1, assets: [golden('v2-single.nif')], instances: [{ asset: 1 }] }), wrong(/no asset 1/));
  for (const [instances, text] of [
    [5, /^instances is no list/],
    [[null], /^asset is undefined/],
    [[{ asset: () => 0 }], /^asset is /],
    [[{ asset: 0, object: () => 0 }], /^object is /],
    [[{ asset: 0, transform: () => 0 }], /12 numbers/],
    [[{ asset: 0, origin: [1, 2] }], /^an origin has 3 numbers/],
    [[{ asset: 0, mask: -1 }], /^mask is -1/],
    [[{ asset: 0, user: 0.5 }], /^user is 0.5/],
  ])
    await assert.rejects(Pool.create({ workers: 1, assets: [golden('v2-single.nif')], instances }), wrong(text));
  const pool = await Pool.create({ workers: 2, assets: [golden('v2-exact.nif')] });
  assert.deepEqual((await pool.query(rays)).visible, expected);
  await assert.rejects(pool.query(rays, { seen: true }), wrong(/no output 'seen'/));
  await assert.rejects(pool.setInstances([{ asset: 0, transform: new Float32Array(12) }]), is('NIF_ERROR_SINGULAR_TRANSFORM', /./));
  await assert.rejects(pool.setInstances(5), wrong(/^instances is no list/));
  await assert.rejects(pool.setOrigin([1]), wrong(/^an origin has 3 numbers/));
  await pool.setInstances([{ asset: 0, note: () => 0 }]);
  assert.deepEqual((await pool.query(rays)).visible, expected);
  const asked = pool.query(someRays(200000)), changed = pool.setInstances([{ asset: 0 }]);
  pool.dispose();
  await assert.rejects(asked, wrong(/^the pool has been disposed of/));
  await assert.rejects(changed, wrong(/^the pool has been disposed of/));
  await assert.rejects(pool.query(rays), wrong(/^the pool has been disposed of/));
});

test('a batch that fails is not written to any more', async () => {
  const pool = await Pool.create({ workers: 2, assets: [golden('v2-exact.nif')] });
  let writes = 0;
  class Failing extends Uint8Array {
    set(answers, first) {
      if (++writes === 1) throw new Error('no more');
      super.set(answers, first);
    }
  }
  await assert.rejects(pool.query(someRays(200000), { visible: new Failing(200000) }), /^Error: no more$/);
  const atEnd = writes;
  await pool.query(rays); // comes after all that was asked before
  assert.equal(writes, atEnd);
  pool.dispose();
});

test('pools take files that node reads into its shared buffers', async () => {
  const folder = mkdtempSync(join(tmpdir(), 'nifkit-'));
  try {
    const pipe = join(folder, 'pipe.nif');
    execFileSync('mkfifo', [pipe]);
    const writing = writeFile(pipe, goldenBytes('v2-single.nif'));
    const pool = await Pool.create({ workers: 1, assets: [pipe] });
    await writing;
    assert.equal((await pool.query(rays)).visible.length, 100);
    pool.dispose();
  } finally {
    rmSync(folder, { recursive: true });
  }
});
