// An engine that answers rays in its own workers: a .nif asset with nifkit, or triangles with three-mesh-bvh.

/** A worker, and the promises of its pending requests. */
class Helper {
  #worker;
  #waiting = new Map();
  #next = 0;

  constructor(kind) {
    this.#worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module', name: kind });
    this.#worker.onmessage = ({ data: { id, result, error } }) => {
      const { resolve, reject } = this.#waiting.get(id) ?? {};
      this.#waiting.delete(id);
      if (error) reject?.(new Error(error));
      else resolve?.(result);
    };
    this.#worker.onerror = (event) => {
      event.preventDefault?.();
      this.stop(event.message ? `a worker has failed: ${event.message}` : 'a worker could not be started');
    };
  }

  ask(task, message, transfer = []) {
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, task, message }, transfer);
    });
  }

  stop(why) {
    this.#worker.terminate();
    for (const { reject } of this.#waiting.values()) reject(new Error(why));
    this.#waiting.clear();
  }
}

export class Engine {
  #helpers;

  /**
   * kind: 'asset' or 'triangles'. source: { url } or { file }. Rejects with a sentence for users; then nothing is left running.
   * Each worker has its own copy of the object in memory.
   */
  static async open(kind, source, { workers = 1, simd } = {}) {
    if (typeof Worker !== 'function') throw new Error('This browser has no web workers, and this page traces its rays in them.');
    const engine = new Engine();
    engine.kind = kind;
    engine.source = source;
    engine.#helpers = Array.from({ length: workers }, () => new Helper(kind));
    try {
      const opened = await Promise.all(engine.#helpers.map((helper) => helper.ask('open', { source, simd })));
      /** fileBytes, memoryBytes, milliseconds, bounds: [low, high], longest: the longest side, note: a remark about it */
      engine.info = opened[0];
    } catch (error) {
      engine.close();
      throw error;
    }
    return engine;
  }

  get workers() {
    return this.#helpers.length;
  }

  /** Sets the view of the following pictures; see tracer.js. */
  start(view) {
    return Promise.all(this.#helpers.map((helper) => helper.ask('start', view)));
  }

  /** One more sample of each pixel in some rows, by the worker `which`, which has the earlier samples. */
  trace(which, band) {
    return this.#helpers[which].ask('trace', band);
  }

  /** Shadow rays that start on the object, for at most this many pixels of a view, as a Float32Array of 8 numbers each. */
  rays(view, pixels) {
    return this.#helpers[0].ask('rays', { view, pixels });
  }

  /** { visible, milliseconds } for rays: on one thread, without the time for messages. */
  answer(rays) {
    return this.#helpers[0].ask('answer', rays);
  }

  close() {
    for (const helper of this.#helpers) helper.stop('closed');
  }
}
