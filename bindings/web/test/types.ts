// What TypeScript makes of the package's types: npm's users see no more of the code. types.test.mjs compiles this file.
import { Asset, Device, INSTANCE_DISABLED, NifError, Pool, Scene, hasSimd, type AssetInfo, type InstanceInfo, type ObjectInfo, type Rays } from 'nifkit';

type Same<A, B> = (<T>() => T extends A ? 1 : 2) extends <T>() => T extends B ? 1 : 2 ? true : false;
function same<A, B>(_: Same<A, B>): void {}

export async function inOneThread(url: URL, bytes: Uint8Array, file: Blob): Promise<number> {
  const device = await Device.create({ simd: hasSimd() });
  const asset: Asset = await Asset.load(device, url);
  for (const source of ['statue.nif', bytes, bytes.buffer, file, new Response(file)]) await Asset.load(device, source);
  const info: AssetInfo = asset.info;
  const object: ObjectInfo = asset.object(0);
  const scene = new Scene(device);
  const { first, count } = scene.addAsset(asset);
  scene.addInstance(asset, 0, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);
  scene.setInstanceTransform(first + count - 1, new Float32Array(12));
  scene.setInstanceFlags(first, INSTANCE_DISABLED);
  scene.setInstanceUser(first, 5n);
  const placed: InstanceInfo = scene.instance(first);
  same<typeof placed.user, bigint>(true);
  scene.commit();

  const rays: Rays = { origins: new Float32Array(3), directions: Float32Array.of(0, 0, 1), tmin: object.bias };
  const plain = scene.query(rays);
  same<typeof plain, { visible: Uint8Array }>(true);
  // Only what is asked for comes back, with its own type.
  const some = scene.query(new Float32Array(8), { probability: true, certain: new Uint8Array(1) });
  same<typeof some.probability, Float32Array>(true);
  same<keyof typeof some, 'probability' | 'certain'>(true);
  const hits = scene.intersect({ rays: new Float32Array(8) }, { t: true, triangle: true });
  same<typeof hits.triangle, Uint32Array>(true);
  const exact = scene.queryWithFallback(rays, { visible: true }, 2, (numbers, visible) => visible.fill(numbers[0]! % 2));
  same<keyof typeof exact, 'visible'>(true);
  const open = scene.queryOpen(rays, { certain: true });
  same<typeof open.answers.certain, Uint8Array>(true);
  same<typeof open.tmin, Float32Array>(true);

  // @ts-expect-error It was not asked for.
  some.visible;
  // @ts-expect-error There is no such output.
  scene.query(rays, { distance: true });
  // @ts-expect-error An output has one type of array.
  scene.query(rays, { visible: new Float32Array(1) });
  // @ts-expect-error Rays have directions, too.
  scene.query({ origins: new Float32Array(3) });
  // @ts-expect-error Devices are made by Device.create().
  new Device();
  // @ts-expect-error It is the library's to say.
  asset.info = info;

  scene[Symbol.dispose]();
  asset.dispose();
  device.dispose();
  return info.residentBytes;
}

export async function inWorkers(asset: string): Promise<Uint8Array> {
  const pool = await Pool.create({ workers: 2, assets: [asset], instances: [{ asset: 0, object: 0, origin: [0, 1, 2] }], origin: new Float64Array(3) });
  try {
    await pool.setOrigin(null);
    const { visible } = await pool.query({ rays: new Float32Array(8) }, { visible: true }, { signal: new AbortController().signal });
    // @ts-expect-error Answers come later.
    pool.query(new Float32Array(8)).visible;
    return visible;
  } catch (error) {
    if (error instanceof NifError) throw new Error(`${error.codeName} (${error.code.toFixed()}): ${error.message}`);
    throw error;
  } finally {
    pool.dispose();
  }
}
