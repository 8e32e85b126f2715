// What a page or a Node program may import from the npm package: one line for each module that exports a
// public name. The types of all of it are in index.d.ts. Whatever is left out here is internal.
export { Asset } from './asset.js';
export { Device } from './device.js';
export { NifError } from './errors.js';
export { hasSimd } from './module.js';
export { Pool } from './pool.js';
export { INSTANCE_DISABLED, LOGIT_CERTAIN, NONE, Scene } from './scene.js';
