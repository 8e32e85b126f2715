// A scene: instances of assets' objects, committed, then asked.
import { Asset } from './asset.js';
import { Device } from './device.js';
import { bytesIn, refuse, wholeNumber } from './errors.js';
import { ANSWERS, HITS, readOutputs, readRays } from './rays.js';

/** 12 numbers: a row-major 3x4 matrix. Null or undefined: none. */
export function readTransform(transform) {
  if (transform === undefined || transform === null) return undefined;
  if (ArrayBuffer.isView(transform)) bytesIn(transform, 'the transform');
  const numbers = Float32Array.from(transform);
  if (numbers.length !== 12) refuse(`a transform has 12 numbers, a row-major 3x4 matrix, not ${numbers.length}`);
  return numbers;
}

export class Scene {
  #device;
  #handle;

  constructor(device) {
    if (!(device instanceof Device)) refuse('the argument of new Scene() is no Device');
    device._check(device._use()._web_new_scene(device._handle));
    this.#handle = device._said()[0];
    this.#device = device;
    device._enter();
  }

  get device() {
    return this.#device;
  }

  add(asset, transform) {
    return this.#withTransform(transform, (at) => {
      this.#ask('_web_add_asset', this.#own(asset), at);
      const [first, count] = this.#device._said();
      return { first, count };
    });
  }

  addInstance(asset, object, transform) {
    wholeNumber(object, 'object');
    return this.#withTransform(transform, (at) => {
      this.#ask('_web_add_instance', this.#own(asset), object, at);
      return this.#device._said()[0];
    });
  }

  setTransform(instance, transform) {
    wholeNumber(instance, 'instance');
    this.#withTransform(transform, (at) => this.#ask('_web_set_transform', instance, at));
  }

  commit() {
    this.#ask('_web_commit');
  }

  get info() {
    this.#ask('_web_scene_info');
    const said = Array.from(this.#device._said());
    return {
      instances: said[0],
      committed: said[1] !== 0,
      boundsMin: said.slice(2, 5),
      boundsMax: said.slice(5, 8),
      residentBytes: said[8],
    };
  }

  query(rays, outputs = { visible: true }) {
    return this.#batches('_web_query', ANSWERS, rays, outputs);
  }

  intersect(rays, outputs = { hit: true, t: true }) {
    return this.#batches('_web_intersect', HITS, rays, outputs);
  }

  get disposed() {
    return this.#handle === 0;
  }

  dispose() {
    if (this.#handle === 0) return;
    this.#device._module._web_release_scene(this.#handle);
    this.#handle = 0;
    this.#device._leave();
  }

  [Symbol.dispose ?? Symbol.for('dispose')]() {
    this.dispose();
  }

  #own(asset) {
    if (!(asset instanceof Asset)) refuse('what is added to a scene is no Asset');
    if (asset.device !== this.#device) refuse('the asset belongs to another device than the scene');
    return asset._handle;
  }

  #use() {
    if (this.#handle === 0) refuse('the scene has been disposed of');
  }

  #withTransform(transform, use) {
    const numbers = readTransform(transform);
    this.#use(); // after the caller's own iterator
    return numbers ? this.#device._withBytes(numbers, use) : use(0);
  }

  #ask(call, ...more) {
    this.#use();
    this.#device._check(this.#device._module[call](this.#handle, ...more));
  }

  #batches(call, kinds, rays, outputs) {
    this.#use();
    const batch = readRays(rays);
    const arrays = readOutputs(kinds, outputs, batch.count);
    const staging = this.#device._staging();
    let first = 0;
    do {
      const count = staging.load(batch, first, kinds, arrays);
      this.#ask(call, staging.rays, staging.outputs);
      staging.store(first, count, kinds, arrays);
      first += count;
    } while (first < batch.count);
    return arrays;
  }
}
