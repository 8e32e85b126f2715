// Lets several workers answer batches together. Each has its own module and assets, so this needs neither shared
// memory nor the HTTP headers for it.
import { readSource } from './asset.js';
import { NifError, failure, readSignal, refuse, wholeNumber } from './errors.js';
import { startWorker } from './host.js';
import { hasSimd } from './module.js';
import { ANSWERS, HITS, OPEN, RAY, readOutputs, readRays } from './rays.js';
import { readOrigin, readTransform, readUser } from './scene.js';

/** Rays per message: some milliseconds of work, so that all workers finish at about the same time. */
const kPiece = 16384;

const kBrand = Symbol('nifkit');

/** Copies the part of `array` for these rays; single numbers for all rays stay as they are. */
function part(array, each, count, first, rays) {
  return array.length === each && count !== 1 ? array.slice() : array.slice(first * each, (first + rays) * each);
}

/** The instances for workers: plain numbers, copied now. */
function readInstances(instances) {
  if (instances === undefined || instances === null) return undefined;
  if (!Array.isArray(instances)) refuse('instances is no list');
  return instances.map((instance) => ({
    asset: wholeNumber(instance?.asset, 'asset'),
    object: instance.object === undefined ? undefined : wholeNumber(instance.object, 'object'),
    transform: readTransform(instance.transform),
    origin: instance.origin && readOrigin(instance.origin),
    mask: instance.mask === undefined ? undefined : wholeNumber(instance.mask, 'mask'),
    flags: instance.flags === undefined ? undefined : wholeNumber(instance.flags, 'flags'),
    user: instance.user === undefined ? undefined : readUser(instance.user),
  }));
}

class Helper {
  #worker;
  #waiting = new Map();
  #next = 0;
  #stopped;

  static async start(onFailure) {
    const helper = new Helper();
    helper.#worker = await startWorker(new URL('./worker.js', import.meta.url));
    helper.#worker.listen(
      ({ id, result, error }) => {
        if (helper.#stopped) return; // it had answered before it was stopped
        const { resolve, reject } = helper.#waiting.get(id);
        helper.#waiting.delete(id);
        if (error) reject(new NifError(error.code, error.codeName, error.message));
        else resolve(result);
      },
      (error) => onFailure(failure(`a worker of the pool has failed: ${error.message}`, 'NOT_AVAILABLE')),
    );
    return helper;
  }

  ask(task, message, transfer = []) {
    if (this.#stopped) return Promise.reject(this.#stopped);
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.post({ id, task, message }, transfer);
    });
  }

  stop(error) {
    this.#stopped = error;
    for (const { reject } of this.#waiting.values()) reject(error);
    this.#waiting.clear();
    return this.#worker.stop();
  }
}

export class Pool {
  #helpers = [];
  #idle = [];
  #queue = [];
  #failure;
  #running = new Set();
  #changed = Promise.resolve();

  /** Use Pool.create(). */
  constructor(brand) {
    if (brand !== kBrand) refuse('a pool is made by await Pool.create()');
  }

  static async create({ workers = Math.min(globalThis.navigator?.hardwareConcurrency ?? 2, 8), assets, instances, origin, simd = hasSimd(), signal } = {}) {
    wholeNumber(workers, 'workers', 64);
    if (workers === 0) refuse('workers is 0');
    if (!Array.isArray(assets) || assets.length === 0) refuse('assets is no list of sources');
    const placed = readInstances(instances);
    const place = readOrigin(origin);
    readSignal(signal);
    const sources = await Promise.all(assets.map((source) => readSource(source, signal)));
    const pool = new Pool(kBrand);
    try {
      pool.#helpers = await Promise.all(Array.from({ length: workers }, () => Helper.start((error) => pool.#stop(error))));
      const message = { simd, instances: placed, origin: place, assets: sources.map(({ name, bytes }) => ({ name, bytes: new Uint8Array(bytes) })) };
      signal?.throwIfAborted();
      await Promise.all(pool.#helpers.map((helper) => helper.ask('open', message)));
      signal?.throwIfAborted();
    } catch (error) {
      pool.#stop(error);
      throw error;
    }
    pool.#idle = [...pool.#helpers];
    return pool;
  }

  get workers() {
    return this.#helpers.length;
  }

  /** Replaces all instances; see Pool.create(). */
  async setInstances(instances) {
    await this.#change('setInstances', readInstances(instances));
  }

  /** Replaces the scene's origin. */
  async setOrigin(origin) {
    await this.#change('setOrigin', readOrigin(origin));
  }

  query(rays, outputs = { visible: true }, { signal } = {}) {
    return this.#batches('query', ANSWERS, rays, outputs, signal);
  }

  async queryOpen(rays, outputs = { visible: true }, { signal } = {}) {
    const pieces = [];
    const answers = await this.#batches('queryOpen', ANSWERS, rays, outputs, signal, (piece, first) => {
      for (let i = 0; i < piece.rays.length; ++i) piece.rays[i] += first;
      pieces[first / kPiece] = piece;
    });
    const open = {};
    for (const [name, [Type]] of Object.entries(OPEN)) {
      open[name] = new Type(pieces.reduce((sum, piece) => sum + piece[name].length, 0));
      let at = 0;
      for (const piece of pieces) open[name].set(piece[name], (at += piece[name].length) - piece[name].length);
    }
    return { ...open, answers };
  }

  intersect(rays, outputs = { hit: true, t: true }, { signal } = {}) {
    return this.#batches('intersect', HITS, rays, outputs, signal);
  }

  get disposed() {
    return this.#failure !== undefined;
  }

  dispose() {
    this.#stop(failure('the pool has been disposed of'));
  }

  [Symbol.dispose ?? Symbol.for('dispose')]() {
    this.dispose();
  }

  #use() {
    if (this.#failure) throw this.#failure;
  }

  #stop(error) {
    if (this.#failure) return;
    this.#failure = error;
    for (const { reject } of this.#queue) reject(error);
    this.#queue = [];
    for (const helper of this.#helpers) helper.stop(error);
  }

  async #change(task, message) {
    this.#use();
    const before = [this.#changed, ...this.#running];
    const change = Promise.allSettled(before).then(() => Promise.all(this.#helpers.map((helper) => helper.ask(task, message))));
    this.#changed = change.catch(() => {}); // what is asked from now on waits for it
    await change;
  }

  /** `take`, if given, gets the remaining results of each chunk. */
  async #batches(task, kinds, rays, outputs, signal, take) {
    this.#use();
    readSignal(signal);
    const batch = readRays(rays);
    const arrays = readOutputs(kinds, outputs, batch.count);
    const names = Object.keys(arrays);
    const wanted = Object.fromEntries(names.map((name) => [name, true]));
    const pieces = [];
    for (let first = 0; first < batch.count; first += kPiece) {
      const count = Math.min(kPiece, batch.count - first);
      const piece = batch.rays
        ? { rays: batch.rays.slice(first * RAY, (first + count) * RAY) }
        : {
            count,
            origins: part(batch.origins, 3, batch.count, first, count),
            directions: part(batch.directions, 3, batch.count, first, count),
            tmin: part(batch.tmin, 1, batch.count, first, count),
            tmax: part(batch.tmax, 1, batch.count, first, count),
          };
      if (batch.mask) piece.mask = part(batch.mask, 1, batch.count, first, count);
      const transfer = Object.values(piece).flatMap((array) => array.buffer ?? []);
      const answered = this.#changed
        .then(() => this.#ask(task, { rays: piece, wanted }, transfer, signal))
        .then((result) => {
          take?.(result, first);
          const answers = result.answers ?? result;
          for (const name of names) arrays[name].set(answers[name], first * kinds[name][1]);
        })
        .finally(() => this.#running.delete(answered));
      this.#running.add(answered);
      pieces.push(answered);
    }
    await Promise.allSettled(pieces); // until then the arrays are written to
    await Promise.all(pieces);
    return arrays;
  }

  /** Gives the task to the next idle helper, unless the signal has been given by then. */
  #ask(task, message, transfer, signal) {
    this.#use();
    return new Promise((resolve, reject) => {
      this.#queue.push({ task, message, transfer, signal, resolve, reject });
      this.#serve();
    });
  }

  #serve() {
    while (this.#idle.length > 0 && this.#queue.length > 0) {
      const { task, message, transfer, signal, resolve, reject } = this.#queue.shift();
      if (signal?.aborted) {
        reject(signal.reason);
        continue;
      }
      const helper = this.#idle.pop();
      helper
        .ask(task, message, transfer)
        .then(resolve, reject)
        .finally(() => {
          if (this.#failure) return;
          this.#idle.push(helper);
          this.#serve();
        });
    }
  }
}
