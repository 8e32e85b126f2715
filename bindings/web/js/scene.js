// A scene: instances of assets' objects; build it, commit it, query it.
import { Asset } from './asset.js';
import { Device } from './device.js';
import { bytesIn, refuse, wholeNumber } from './errors.js';
import { ANSWERS, HITS, OPEN, readOutputs, readRays } from './rays.js';

/** A flag of an instance: no ray meets it. */
export const INSTANCE_DISABLED = 1;
/** Number of what is not there, in hits and open rays. */
export const NONE = 0xffffffff;
/** Logit of rays that no network decided: this if visible, its negative if occluded. */
export const LOGIT_CERTAIN = 0x7fffffff;

/** Numbers in a list or a typed array, as an array of this class. */
function numbersIn(Type, list, name) {
  if (ArrayBuffer.isView(list)) bytesIn(list, name);
  return Type.from(list);
}

/** 12 numbers: a row-major 3x4 matrix. Null or undefined: none. */
export function readTransform(transform) {
  if (transform === undefined || transform === null) return undefined;
  const numbers = numbersIn(Float32Array, transform, 'the transform');
  if (numbers.length !== 12) refuse(`a transform has 12 numbers, a row-major 3x4 matrix, not ${numbers.length}`);
  return numbers;
}

/** Three numbers. Null or undefined: 0 0 0. */
export function readOrigin(origin) {
  const numbers = numbersIn(Float64Array, origin ?? [0, 0, 0], 'the origin');
  if (numbers.length !== 3) refuse(`an origin has 3 numbers, not ${numbers.length}`);
  return numbers;
}

/** An unsigned integer of 64 bits. */
export function readUser(user) {
  let value;
  try {
    value = BigInt(user);
  } catch {
    // what it is is said below
  }
  if (value === undefined || BigInt.asUintN(64, value) !== value) refuse(`user is ${String(user)}, not a whole number from 0 to 2^64 - 1`);
  return value;
}

export class Scene {
  #device;
  #handle;
  #assets = []; // of each instance

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

  addAsset(asset, transform) {
    return this.#withTransform(transform, (at) => {
      this.#ask('_web_add_asset', this.#own(asset), at);
      const [first, count] = this.#device._said();
      for (let i = 0; i < count; ++i) this.#assets[first + i] = asset;
      return { first, count };
    });
  }

  addInstance(asset, object, transform) {
    wholeNumber(object, 'object');
    return this.#withTransform(transform, (at) => {
      this.#ask('_web_add_instance', this.#own(asset), object, at);
      const instance = this.#device._said()[0];
      this.#assets[instance] = asset;
      return instance;
    });
  }

  removeInstance(instance) {
    this.#ask('_web_remove_instance', wholeNumber(instance, 'instance'));
    delete this.#assets[instance];
  }

  setInstanceTransform(instance, transform) {
    wholeNumber(instance, 'instance');
    this.#withTransform(transform, (at) => this.#ask('_web_set_transform', instance, at));
  }

  setInstanceTransforms(instances, transforms) {
    const matrices = numbersIn(Float32Array, transforms, 'transforms');
    const count = matrices.length / 12;
    const set = (numbers, at) => this.#ask('_web_set_transforms', count, numbers, at);
    let numbers;
    if (instances !== undefined && instances !== null) {
      numbers = numbersIn(Uint32Array, instances, 'instances');
      for (const instance of instances) wholeNumber(instance, 'instance');
    }
    const given = numbers?.length ?? count;
    if (given !== count) refuse(`transforms has ${matrices.length} numbers for ${given} instances, not ${12 * given}`);
    this.#use();
    if (count === 0) return;
    this.#device._withBytes(matrices, (at) => (numbers ? this.#device._withBytes(numbers, (list) => set(list, at)) : set(0, at)));
  }

  setInstanceOrigin(instance, origin) {
    this.#ask('_web_set_instance_origin', wholeNumber(instance, 'instance'), ...readOrigin(origin));
  }

  setOrigin(origin) {
    this.#ask('_web_set_origin', ...readOrigin(origin));
  }

  setInstanceMask(instance, mask) {
    this.#ask('_web_set_mask', wholeNumber(instance, 'instance'), wholeNumber(mask, 'mask'));
  }

  setInstanceFlags(instance, flags) {
    this.#ask('_web_set_flags', wholeNumber(instance, 'instance'), wholeNumber(flags, 'flags'));
  }

  setInstanceUser(instance, user) {
    const value = readUser(user);
    this.#ask('_web_set_user', wholeNumber(instance, 'instance'), Number(value & 0xffffffffn), Number(value >> 32n));
  }

  instance(instance) {
    this.#ask('_web_instance_info', wholeNumber(instance, 'instance'));
    const said = Array.from(this.#device._said());
    return {
      asset: this.#assets[instance],
      object: said[0],
      mask: said[1],
      flags: said[2],
      user: (BigInt(said[4]) << 32n) | BigInt(said[3]),
      origin: said.slice(5, 8),
      transform: said.slice(8, 20),
    };
  }

  commit() {
    this.#ask('_web_commit');
  }

  get info() {
    this.#ask('_web_scene_info');
    const said = Array.from(this.#device._said());
    return {
      instanceCount: said[0],
      committed: said[1] !== 0,
      boundsMin: said.slice(2, 5),
      boundsMax: said.slice(5, 8),
      residentBytes: said[8],
      instanceEnd: said[9],
      origin: said.slice(10, 13),
    };
  }

  query(rays, outputs = { visible: true }) {
    return this.#batches('_web_query', ANSWERS, rays, outputs);
  }

  queryWithFallback(rays, outputs, confidence, fallback) {
    if (typeof confidence !== 'number') refuse('confidence is no number');
    if (typeof fallback !== 'function') refuse('the fallback is no function');
    this.#use();
    const device = this.#device;
    const module = device._module;
    let failure, first;
    // Exceptions must not pass through the module.
    module.fallback = (count, numbers, visible) => {
      if (failure) return;
      try {
        const asked = Uint32Array.from({ length: count }, (_, i) => first + module.HEAPU32[(numbers >>> 2) + 2 * i]);
        const answers = module.HEAPU8.slice(visible >>> 0, (visible >>> 0) + count);
        if (typeof fallback(asked, answers)?.then === 'function') refuse('a fallback cannot be asynchronous');
        module.HEAPU8.set(answers.map(Boolean), visible >>> 0);
      } catch (error) {
        failure = { error };
      }
    };
    const ask = (staging, at) => {
      first = at;
      device._inFallback = true;
      try {
        return module._web_query_with_fallback(this.#handle, staging.rays, staging.outputs, confidence);
      } finally {
        device._inFallback = false;
        if (failure) throw failure.error;
      }
    };
    return this.#batches(ask, ANSWERS, rays, outputs);
  }

  queryOpen(rays, outputs = { visible: true }) {
    this.#use();
    const batch = readRays(rays);
    const answers = readOutputs(ANSWERS, outputs, batch.count);
    const open = Object.fromEntries(Object.entries(OPEN).map(([name, [Type]]) => [name, new Type(batch.count)]));
    let found = 0;
    this.#pieces('_web_query_open', { ...ANSWERS, ...OPEN }, batch, { ...answers, ...open }, (staging, first, count) => {
      const more = this.#device._said()[0];
      staging.store(found, more, OPEN, open, staging.store(first, count, ANSWERS, answers));
      for (const end = found + more; found < end; ++found) open.rays[found] += first;
    });
    for (const name of Object.keys(open)) open[name] = open[name].slice(0, found);
    return { ...open, answers };
  }

  intersect(rays, outputs = { hit: true, t: true }) {
    return this.#batches('_web_intersect', HITS, rays, outputs);
  }

  get disposed() {
    return this.#handle === 0;
  }

  dispose() {
    if (this.#handle === 0) return;
    this.#use();
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
    if (this.#device._inFallback) refuse('a fallback cannot use scenes of the device that called it', 'INVALID_OPERATION');
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
    this.#pieces(call, kinds, batch, arrays, (staging, first, count) => staging.store(first, count, kinds, arrays));
    return arrays;
  }

  /** Queries chunk by chunk. `call`: of the module, or a function that makes it; `store` takes the answers. */
  #pieces(call, kinds, batch, arrays, store) {
    const staging = this.#device._staging();
    let first = 0;
    do {
      const count = staging.load(batch, first, kinds, arrays);
      if (typeof call === 'function') this.#device._check(call(staging, first));
      else this.#ask(call, staging.rays, staging.outputs);
      store(staging, first, count);
      first += count;
    } while (first < batch.count);
  }
}
