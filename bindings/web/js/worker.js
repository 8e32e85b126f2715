// A worker of a Pool: a device, the pool's assets, and a scene of them.
import { Asset } from './asset.js';
import { Device } from './device.js';
import { refuse } from './errors.js';
import { ownPort } from './host.js';
import { Scene } from './scene.js';

let device, scene, origin;
const assets = [];

/** Each asset once if no instances are named. */
function setInstances(instances) {
  const next = new Scene(device);
  try {
    next.setOrigin(origin);
    for (const { asset, object, transform, origin: place, mask, flags, user } of instances ?? assets.map((_, asset) => ({ asset }))) {
      if (!assets[asset]) refuse(`there is no asset ${asset}; the pool has ${assets.length}`);
      const one = object !== undefined;
      const { first, count } = one
        ? { first: next.addInstance(assets[asset], object, transform), count: 1 }
        : next.addAsset(assets[asset], transform);
      for (let i = first; i < first + count; ++i) {
        if (place) next.setInstanceOrigin(i, place);
        if (mask !== undefined) next.setInstanceMask(i, mask);
        if (flags !== undefined) next.setInstanceFlags(i, flags);
        if (user !== undefined) next.setInstanceUser(i, user);
      }
    }
    next.commit();
  } catch (error) {
    next.dispose();
    throw error;
  }
  scene?.dispose();
  scene = next;
}

/** Only a commit finds an instance that is too far from a new origin: then the old one stays. */
function setOrigin(to) {
  try {
    scene.setOrigin(to);
    scene.commit();
  } catch (error) {
    scene.setOrigin(origin);
    scene.commit();
    throw error;
  }
  origin = to;
}

const tasks = {
  async open({ simd, assets: sources, instances, origin: place }) {
    origin = place;
    device = await Device.create({ simd });
    for (const { name, bytes } of sources) assets.push(await Asset.load(device, { name, arrayBuffer: async () => bytes.buffer }));
    setInstances(instances);
  },
  setInstances,
  setOrigin,
  query: ({ rays, wanted }) => scene.query(rays, wanted),
  queryOpen: ({ rays, wanted }) => scene.queryOpen(rays, wanted),
  intersect: ({ rays, wanted }) => scene.intersect(rays, wanted),
};

const port = await ownPort();
port.onmessage = async ({ data: { id, task, message } }) => {
  try {
    const result = await tasks[task](message);
    port.postMessage({ id, result }, result ? Object.values({ ...result, ...result.answers }).flatMap((array) => array.buffer ?? []) : []);
  } catch (error) {
    port.postMessage({ id, error: { code: error.code ?? 1, codeName: error.codeName ?? 'NIF_ERROR_UNKNOWN', message: error.message } });
  }
};
