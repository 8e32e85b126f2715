// Rays answered by a .nif asset, with nifkit.
import { Asset, Device, Scene } from './nifkit/index.js';

const kShown = ['segment', 'exact', 'bvh'];

/** The distance from a hit at which shadow rays start: a thousandth of an instance's size, in the scene's units. */
function biasOf(object, [a, b, c, , d, e, f, , g, h, i]) {
  const determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
  return object.bias * Math.cbrt(Math.abs(determinant));
}

/** The bounds of all placed objects. Those of a scene would be a little larger, with room for learned answers. */
function boundsOf(asset, placed) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const { object, transform } of placed) {
    const { boundsMin, boundsMax } = asset.object(object);
    for (let corner = 0; corner < 8; ++corner) {
      const point = [0, 1, 2].map((a) => (corner & (1 << a) ? boundsMax[a] : boundsMin[a]));
      for (let a = 0; a < 3; ++a) {
        const value = transform[4 * a] * point[0] + transform[4 * a + 1] * point[1] + transform[4 * a + 2] * point[2] + transform[4 * a + 3];
        low[a] = Math.min(low[a], value);
        high[a] = Math.max(high[a], value);
      }
    }
  }
  return [low, high];
}

/** Throws nifkit's error if the bytes are not an asset. */
export async function open(bytes, name, { simd }) {
  const device = await Device.create(simd === undefined ? {} : { simd });
  const asset = await Asset.load(device, { name, arrayBuffer: async () => bytes.buffer }); // so that errors contain the name
  const scene = new Scene(device);
  scene.addAsset(asset);
  scene.commit();
  const { objectCount, instanceCount, residentBytes } = asset.info;
  for (let i = 0; i < objectCount; ++i) {
    const { encoding } = asset.object(i);
    if (!kShown.includes(encoding)) throw new Error(`${name} has a ${encoding} object, which does not report where rays hit it; this page shows ${kShown.join(', ')}`);
  }
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
  const placed =
    instanceCount > 0 ? Array.from({ length: instanceCount }, (_, i) => asset.instance(i)) : Array.from({ length: objectCount }, (_, object) => ({ object, transform: identity }));
  const bias = placed.map(({ object, transform }) => biasOf(asset.object(object), transform));
  return {
    bounds: boundsOf(asset, placed),
    memoryBytes: residentBytes,
    note: device.isa === 'scalar' ? 'Without vectors (SIMD) in WebAssembly: nifkit is some ten times slower.' : '',
    /** First hits. Fills t (Infinity if nothing is hit), normals towards the ray's origin, and the biases of shadow rays. */
    intersect(rays, count, { t, normal, bias: off }) {
      const used = { t: t.subarray(0, count), normal: normal.subarray(0, 3 * count), instance: new Uint32Array(count) };
      scene.intersect(rays.subarray(0, 8 * count), used);
      for (let i = 0; i < count; ++i) if (t[i] < Infinity) off[i] = bias[used.instance[i]];
    },
    /** 1 for each ray that nothing blocks. */
    visible(rays, count, visible) {
      scene.query(rays.subarray(0, 8 * count), { visible: visible.subarray(0, count) });
    },
  };
}
