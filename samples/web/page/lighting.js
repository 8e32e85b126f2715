// Refines the picture: a coarse one immediately after each change, then sample after sample of all pixels, in bands of rows, so
// that a change need not wait.

const kSamples = 256;
const kBandPixels = 12000;
const kCoarseMilliseconds = 60; // time for a coarse picture
const kFirstScale = 8; // for an engine's first picture: coarser by this factor in each direction
const kStill = 150; // milliseconds without a change before all pixels are traced

export class Lighting {
  #engine;
  #makeView;
  #onShow;
  #onError;
  #changes = 0;
  #changed = -Infinity;
  #wake = () => {};
  #scale = kFirstScale;
  #sums;
  #tasks = [];

  /**
   * makeView(scale): the view for tracer.js, with that many times fewer pixels in each direction. onShow(sums, view, samples, goal)
   * gets each picture; samples is 0 for a coarse one. onError(error): tracing has stopped until the next change.
   */
  constructor({ makeView, onShow, onError }) {
    this.#makeView = makeView;
    this.#onShow = onShow;
    this.#onError = onError;
    this.#run();
  }

  /** Starts again, with this engine if one is given. */
  change(engine) {
    if (engine && engine !== this.#engine) {
      this.#engine = engine;
      this.#scale = kFirstScale;
    }
    ++this.#changes;
    this.#changed = performance.now();
    this.#wake();
  }

  /** Runs a task between two samples, while nothing else is traced; resolves with its result. */
  between(task) {
    return new Promise((resolve, reject) => {
      this.#tasks.push(async () => {
        try {
          resolve(await task());
        } catch (error) {
          reject(error);
        }
      });
      this.#wake();
    });
  }

  async #run() {
    for (;;) {
      const changes = this.#changes;
      try {
        if (this.#engine) await this.#refine(changes);
      } catch (error) {
        if (changes === this.#changes) this.#onError(error);
      }
      while (this.#tasks.length > 0) await this.#tasks.shift()();
      if (changes === this.#changes) await this.#sleep(Infinity);
    }
  }

  #sleep(milliseconds) {
    return new Promise((resolve) => {
      const timer = milliseconds < Infinity ? setTimeout(resolve, milliseconds) : undefined;
      this.#wake = () => {
        clearTimeout(timer);
        resolve();
      };
    });
  }

  async #refine(changes) {
    const isSame = () => changes === this.#changes;
    const coarse = this.#makeView(this.#scale);
    const start = performance.now();
    // Completes the picture even if there are changes meanwhile, so that dragging is visible.
    await this.#sample(coarse, 0, () => true, 0);
    // The next one is as fine as the time allows.
    const ratio = (performance.now() - start) / kCoarseMilliseconds;
    this.#scale = Math.min(10, Math.max(2, this.#scale * Math.sqrt(ratio)));
    while (isSame() && performance.now() < this.#changed + kStill) await this.#sleep(this.#changed + kStill - performance.now());
    if (!isSame()) return;
    const view = this.#makeView(1);
    for (let pass = 0; pass < kSamples && isSame(); ++pass) {
      if (!(await this.#sample(view, pass, isSame, pass + 1))) return;
      // Tasks wait until there is a picture to see.
      while (pass >= 3 && this.#tasks.length > 0 && isSame()) await this.#tasks.shift()();
    }
  }

  /** Traces one sample of each pixel. Returns false if there was a change meanwhile. */
  async #sample(view, pass, isSame, samples) {
    const engine = this.#engine, { width, height } = view;
    const rows = Math.max(1, Math.floor(kBandPixels / width));
    if (pass === 0) {
      await engine.start(view);
      this.#sums = new Float32Array(4 * width * height);
    }
    const sums = this.#sums;
    await Promise.all(
      Array.from({ length: engine.workers }, async (_, which) => {
        for (let first = which * rows; first < height && isSame(); first += engine.workers * rows)
          sums.set(await engine.trace(which, { first, rows: Math.min(rows, height - first), pass }), 4 * first * width);
      }),
    );
    if (!isSame()) return false;
    this.#onShow(sums, view, samples, kSamples);
    return true;
  }
}
