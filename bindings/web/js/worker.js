// A worker of a Pool: a device, the pool's assets, and a scene of them.
import { Asset } from './asset.js';
import { Device } from './device.js';
import { refuse } from './errors.js';
import { ownPort } from './host.js';
import { Scene } from './scene.js';

let device, scene;
const assets = [];

/** Each asset once where no instances are named. */
function setInstances(instances) {
  const next = new Scene(device);
  try {
    for (const { asset, object, transform } of instances ?? assets.map((_, asset) => ({ asset }))) {
      if (!assets[asset]) refuse(`there is no asset ${asset}; the pool has ${assets.length}`);
      if (object === undefined) next.add(assets[asset], transform);
      else next.addInstance(assets[asset], object, transform);
    }
    next.commit();
  } catch (error) {
    next.dispose();
    throw error;
  }
  scene?.dispose();
  scene = next;
}

const tasks = {
  async open({ simd, assets: sources, instances }) {
    device = await Device.create({ simd });
    for (const { name, bytes } of sources) assets.push(await Asset.load(device, { name, arrayBuffer: async () => bytes.buffer }));
    setInstances(instances);
  },
  instances: ({ instances }) => setInstances(instances),
  query: ({ rays, names }) => scene.query(rays, Object.fromEntries(names.map((name) => [name, true]))),
  intersect: ({ rays, names }) => scene.intersect(rays, Object.fromEntries(names.map((name) => [name, true]))),
};

const port = await ownPort();
port.onmessage = async ({ data: { id, task, message } }) => {
  try {
    const result = await tasks[task](message);
    port.postMessage({ id, result }, result ? Object.values(result).map((array) => array.buffer) : []);
  } catch (error) {
    port.postMessage({ id, error: { code: error.code ?? 1, codeName: error.codeName ?? 'NIF_ERROR_UNKNOWN', message: error.message } });
  }
};
