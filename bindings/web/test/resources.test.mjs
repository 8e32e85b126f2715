// Nothing leaks, and disposed objects stay disposed.
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Asset, Device, Pool, Scene, golden, goldenBytes, someRays } from './common.mjs';

test('10,000 loads and disposals keep memory flat', async () => {
  const device = await Device.create();
  const bytes = goldenBytes('v2-single.nif');
  const damaged = bytes.slice();
  damaged[bytes.length - 1] ^= 1;
  const rays = someRays(64);
  let flat;
  for (let i = 0; i < 10000; ++i) {
    const asset = await Asset.load(device, bytes);
    const scene = new Scene(device);
    scene.addAsset(asset);
    scene.commit();
    scene.query(rays);
    scene.dispose();
    asset.dispose();
    await assert.rejects(Asset.load(device, damaged));
    if (i === 100) flat = device.memoryBytes;
  }
  assert.equal(device.memoryBytes, flat);
  // In 32 bits a slot serves for 8,192 handles, and then stays empty: old handles do not come again.
  const asset = await Asset.load(device, bytes);
  assert.equal(asset.info.objectCount > 0, true);
  asset.dispose();
  device.dispose();
});

test('devices and pools come and go', async () => {
  const before = process.memoryUsage.rss();
  for (let i = 0; i < 100; ++i) {
    const device = await Device.create();
    (await Asset.load(device, golden('v2-single.nif'))).dispose();
    device.dispose();
  }
  for (let i = 0; i < 10; ++i) (await Pool.create({ workers: 2, assets: [golden('v2-single.nif')] })).dispose();
  await new Promise((resolve) => setTimeout(resolve, 500));
  assert.ok(process.memoryUsage.rss() - before < 400e6, `${(process.memoryUsage.rss() - before) / 1e6} MB more`);
});
