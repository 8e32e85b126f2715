// The calls that change instances, and those for rays that need more than networks: masks, origins, user values, fallbacks,
// open rays, and cancelling.
import assert from 'node:assert/strict';
import { createServer } from 'node:http';
import { test } from 'node:test';

import { Asset, Device, NifError, Pool, Scene, builds, golden, nameOf, nifkit, someRays } from './common.mjs';

const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
const learned = golden('v2-shapes.nif'); // its object 1 leaves many rays uncertain

/** A pool that is left when a test fails would keep the process. */
async function withPool(options, use) {
  const pool = await Pool.create(options);
  try {
    await use(pool);
  } finally {
    pool.dispose();
  }
}

async function withScene(source, object, use, build) {
  const device = await Device.create(build);
  const asset = await Asset.load(device, source);
  const scene = new Scene(device);
  scene.addInstance(asset, object);
  scene.commit();
  try {
    await use(scene, asset, device);
  } finally {
    scene.dispose(), asset.dispose(), device.dispose();
  }
}

test('masks', () =>
  withScene(golden('v2-exact.nif'), 0, (scene) => {
    const rays = someRays(40000);
    const { visible } = scene.query(rays);
    scene.setInstanceMask(0, 0b110);
    scene.commit();
    assert.deepEqual(scene.query({ rays, mask: 2 }).visible, visible);
    assert.ok(scene.query({ rays, mask: 1 }).visible.every(Boolean) && !scene.intersect({ rays, mask: 1 }).hit.some(Boolean));
    const mask = Uint32Array.from({ length: 40000 }, (_, i) => i % 4);
    assert.deepEqual(scene.query({ rays, mask }).visible, visible.map((bit, i) => (i % 4 < 2 ? 1 : bit)));
    assert.ok(visible.includes(0) && visible.includes(1));
    scene.setInstanceMask(0, 0xffffffff);
    scene.setInstanceFlags(0, nifkit.INSTANCE_DISABLED);
    scene.commit();
    assert.ok(scene.query(rays).visible.every(Boolean));
  }));

test('instances keep their numbers, and what was set is told', () =>
  withScene(golden('v2-exact.nif'), 0, (scene, asset) => {
    const rays = someRays(1000);
    const before = scene.intersect(rays, { t: true, user: true });
    assert.deepEqual([scene.addInstance(asset, 1), scene.addInstance(asset, 1), scene.addInstance(asset, 1)], [1, 2, 3]);
    scene.removeInstance(2), scene.removeInstance(0);
    assert.deepEqual([scene.info.instanceCount, scene.info.instanceEnd], [2, 4]);
    assert.equal(scene.addInstance(asset, 0), 0);
    scene.removeInstance(1), scene.removeInstance(3);
    const far = identity.with(3, 5);
    scene.setInstanceTransforms(null, far);
    scene.setInstanceTransforms([], []);
    scene.setInstanceTransforms(Uint32Array.of(0), Float32Array.from(far));
    scene.setInstanceUser(0, 2n ** 64n - 1n);
    scene.setInstanceMask(0, 5);
    // In double precision: no 32-bit float is near.
    scene.setInstanceOrigin(0, [2 ** 40 + 0.125, -3, 0]);
    scene.setOrigin(Float64Array.of(2 ** 40 + 5.125, -3, 0));
    const told = { asset, object: 0, mask: 5, flags: 0, user: 2n ** 64n - 1n, origin: [2 ** 40 + 0.125, -3, 0], transform: far };
    assert.deepEqual(scene.instance(0), told);
    assert.throws(() => scene.instance(2), NifError);
    assert.deepEqual(scene.info.origin, [2 ** 40 + 5.125, -3, 0]);
    scene.commit();
    const after = scene.intersect(rays, { hit: true, t: true, user: true });
    assert.deepEqual(after.t, before.t);
    assert.ok(after.user.every((user, i) => user === (after.hit[i] ? 2n ** 64n - 1n : 0n)) && after.hit.includes(1));
    assert.ok(before.user.every((user) => user === 0n));
    scene.setOrigin(null), scene.setInstanceOrigin(0, null), scene.setInstanceUser(0, 7);
    assert.deepEqual([scene.info.origin, scene.instance(0).origin, scene.instance(0).user], [[0, 0, 0], [0, 0, 0], 7n]);
  }));

test('pools in large worlds', async () => {
  const rays = someRays(40000), all = { hit: true, t: true, instance: true };
  const [source, far] = [golden('v2-exact.nif'), [2 ** 40 + 0.125, -3, 0]]; // no 32-bit float is near
  const near = (x) => [far[0] + x, far[1], far[2]];
  await withScene(source, 0, (scene) => {
    const expected = scene.intersect(rays, all);
    assert.ok(expected.hit.includes(1) && expected.hit.includes(0));
    assert.ok(expected.instance.every((instance, i) => instance === (expected.hit[i] ? 0 : nifkit.NONE)));
    return withPool({ workers: 2, assets: [source], instances: [{ asset: 0, object: 0, origin: far }], origin: far }, async (pool) => {
      assert.deepEqual(await pool.intersect(rays, all), expected);
      await pool.setOrigin(near(5));
      assert.notDeepEqual(await pool.intersect(rays, all), expected);
      // A new list of instances keeps the scene's origin, and an origin that fails changes nothing.
      await pool.setInstances([{ asset: 0, object: 0, origin: near(5) }]);
      assert.deepEqual(await pool.intersect(rays, all), expected);
      for (const wrong of [[NaN, 0, 0], [1e300, 0, 0]]) await assert.rejects(pool.setOrigin(wrong), NifError);
      assert.deepEqual(await pool.intersect(rays, all), expected);
      const before = pool.intersect(rays, all), moved = pool.setOrigin(null);
      assert.deepEqual(await before, expected);
      await moved;
      await pool.setInstances([{ asset: 0, object: 0 }]);
      assert.deepEqual(await pool.intersect(rays, all), expected);
    });
  });
});

for (const build of builds)
  test(`fallbacks: ${nameOf(build)}`, () =>
    withScene(learned, 1, (scene, asset, device) => {
      const rays = someRays(100000);
      const all = { visible: true, visibleBits: true, probability: true, certain: true, logit: true };
      const first = scene.query(rays, all);
      const numbers = [...first.certain.keys()].filter((i) => !first.certain[i]);
      assert.ok(numbers.length > 1000 && numbers.at(-1) > 65536); // in several pieces
      const asked = [];
      const exact = scene.queryWithFallback(rays, all, 2, (some, visible) => {
        assert.ok(some.length === visible.length && some.length <= 1024);
        some.forEach((ray, k) => {
          assert.equal(visible[k], first.visible[ray]);
          visible[k] = 1 - visible[k];
          asked.push(ray);
        });
      });
      assert.deepEqual(asked, numbers); // one thread, so in order
      assert.ok(exact.certain.every(Boolean));
      assert.deepEqual(exact.visible, first.visible.map((bit, i) => (first.certain[i] ? bit : 1 - bit)));
      assert.ok(exact.probability.every((p, i) => p === exact.visible[i]));
      assert.ok(exact.logit.every((logit, i) => logit === (exact.visible[i] ? 1 : -1) * nifkit.LOGIT_CERTAIN));
      assert.deepEqual(scene.queryWithFallback(rays, all, 0.5, assert.fail), first);

      // What it throws comes out, and harms nothing.
      const mine = new RangeError('mine');
      const throwing = (error) => () => {
        throw error;
      };
      const one = { visible: true };
      const refused = (fallback, what) => assert.throws(() => scene.queryWithFallback(rays, one, 2, fallback), what);
      refused(throwing(mine), (error) => error === mine);
      refused(throwing(undefined), (error) => error === undefined);
      for (const use of [() => scene.query(rays), () => scene.commit(), () => scene.dispose(), () => scene.info, () => new Scene(device).addAsset(asset)])
        refused(use, (error) => error instanceof NifError && error.codeName === 'NIF_ERROR_INVALID_OPERATION');
      refused(async () => {}, /cannot be asynchronous/);
      refused(undefined, /is no function/);
      for (const confidence of [-1, NaN, '2']) assert.throws(() => scene.queryWithFallback(rays, one, confidence, () => {}), NifError);
      assert.deepEqual(scene.query(rays, all), first);
    }, build));

for (const build of builds)
  test(`open rays: ${nameOf(build)}`, () =>
    withScene(learned, 1, async (scene) => {
      const rays = someRays(100000);
      for (let i = 0; i < 100000; ++i) rays[8 * i + 7] = 5;
      const { certain, visible } = scene.query(rays, { certain: true, visible: true });
      const open = scene.queryOpen(rays, { certain: true, visible: true });
      const numbers = [...certain.keys()].filter((i) => !certain[i]);
      assert.deepEqual([...open.rays].sort((a, b) => a - b), numbers);
      for (const list of [open.tmin, open.tmax, open.instance]) assert.equal(list.length, numbers.length);
      assert.ok(open.tmin.every((t, k) => t >= 0 && t <= open.tmax[k] && open.tmax[k] <= 5));
      assert.ok(open.instance.every((instance) => instance === 0));
      assert.deepEqual(open.answers.certain, certain);
      assert.deepEqual(open.answers.visible, visible.map((bit, i) => (certain[i] ? bit : 0)));
      assert.deepEqual([scene.queryOpen(new Float32Array(0)).rays.length, Object.keys(scene.queryOpen(rays).answers)], [0, ['visible']]);
      if (!build.simd) return;
      await withPool({ workers: 2, assets: [learned], instances: [{ asset: 0, object: 1 }] }, async (pool) => {
        const theirs = await pool.queryOpen(rays, { certain: true, visible: true });
        assert.deepEqual(theirs.answers, open.answers);
        const sorted = (lists) => [...lists.rays.keys()].map((k) => [lists.rays[k], lists.tmin[k], lists.tmax[k], lists.instance[k]]).sort((a, b) => a[0] - b[0]);
        assert.deepEqual(sorted(theirs), sorted(open));
        assert.equal((await pool.queryOpen(new Float32Array(0))).rays.length, 0);
        await pool.setInstances([{ asset: 0, object: 1, mask: 2, user: 9n, flags: 0 }]);
        assert.ok((await pool.query({ rays, mask: 1 })).visible.every(Boolean));
        const mask = Uint32Array.from({ length: 100000 }, (_, i) => (i < 99999 ? 1 : 2));
        assert.equal((await pool.query({ rays, mask })).visible[99999], visible[99999]);
        const { hit, user } = await pool.intersect(rays, { hit: true, user: true });
        assert.ok(hit.includes(1) && user.every((value, i) => value === (hit[i] ? 9n : 0n)));
      });
    }, build));

test('ending early', async () => {
  const device = await Device.create();
  const reason = new Error('no longer wanted');
  const isReason = (error) => error === reason;
  await assert.rejects(Asset.load(device, learned, { signal: AbortSignal.abort(reason) }), isReason);
  await assert.rejects(Asset.load(device, learned, { signal: 'now' }), NifError);
  // A server that never answers, and a source that answers too late.
  const server = createServer(() => {}).listen(0, '127.0.0.1');
  await new Promise((resolve) => server.once('listening', resolve));
  const url = `http://127.0.0.1:${server.address().port}/a.nif`;
  for (const load of [(signal) => Asset.load(device, url, { signal }), (signal) => Pool.create({ assets: [url], signal })]) {
    const controller = new AbortController();
    setTimeout(() => controller.abort(reason), 20);
    await assert.rejects(load(controller.signal), isReason);
  }
  server.closeAllConnections(), server.close();
  const late = new AbortController();
  const slow = { arrayBuffer: async () => (late.abort(reason), new ArrayBuffer(9)) };
  await assert.rejects(Asset.load(device, slow, { signal: late.signal }), isReason);
  device.dispose();

  await withPool({ workers: 1, assets: [learned] }, async (pool) => {
    const rays = someRays(400000);
    const wanted = { visible: true };
    const { visible } = await pool.query(rays);
    for (const ask of [
      (signal) => pool.query(rays, wanted, { signal }),
      (signal) => pool.queryOpen(rays, wanted, { signal }),
      (signal) => pool.intersect(rays, { t: true }, { signal }),
    ]) {
      await assert.rejects(ask(AbortSignal.abort(reason)), isReason);
      const controller = new AbortController();
      const asked = ask(controller.signal);
      controller.abort(reason);
      await assert.rejects(asked, isReason);
    }
    // Others that wait are answered, and a signal that comes too late changes nothing.
    const controller = new AbortController();
    const ended = pool.query(rays, wanted, { signal: controller.signal }), other = pool.query(rays, wanted, { signal: new AbortController().signal });
    controller.abort(reason);
    await assert.rejects(ended, isReason);
    assert.deepEqual((await other).visible, visible);
  });
});
