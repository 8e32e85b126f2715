export { Asset } from './asset.js';
export { Device } from './device.js';
export { NifError } from './errors.js';
export { hasSimd } from './module.js';
export { Pool } from './pool.js';
export { Scene } from './scene.js';
