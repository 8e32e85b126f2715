// A worker: an engine that answers rays, and the tracer that queries it. Each message gets one reply. The worker's name is the
// engine: asset or triangles.
import { Tracer } from './tracer.js';

// Only what is needed is loaded, and at once: three-mesh-bvh and three.js are large.
const module = import(self.name === 'asset' ? './asset.js' : './triangles.js');
module.catch(() => {}); // open() reports it

let answerer, tracer;

const tasks = {
  async open({ source, simd }) {
    const [{ open }, bytes] = await Promise.all([module, read(source)]);
    const name = source.file?.name ?? source.url;
    const start = performance.now();
    answerer = await open(bytes, name, { simd });
    tracer = new Tracer(answerer);
    const [low, high] = answerer.bounds;
    const longest = Math.max(...high.map((value, a) => value - low[a]));
    if (!(longest > 0 && longest < 1e18)) throw new Error(`${name} has no size, or one that is not a number`);
    tracer.try();
    return {
      fileBytes: bytes.byteLength,
      memoryBytes: answerer.memoryBytes,
      milliseconds: performance.now() - start,
      bounds: answerer.bounds,
      longest,
      note: answerer.note,
    };
  },
  start: (view) => tracer.start(view),
  trace: (band) => tracer.trace(band),
  rays: ({ view, pixels }) => tracer.rays(view, pixels),
  answer(rays) {
    const visible = new Uint8Array(rays.length / 8);
    const start = performance.now();
    answerer.visible(rays, visible.length, visible);
    return { visible, milliseconds: performance.now() - start };
  },
};

async function read({ url, file }) {
  try {
    if (file) return new Uint8Array(await file.arrayBuffer());
    const response = await fetch(url);
    if (!response.ok) throw new Error(`the server answers with ${response.status}`);
    return new Uint8Array(await response.arrayBuffer());
  } catch (error) {
    throw new Error(`${file?.name ?? url} cannot be read: ${error.message}`);
  }
}

self.onmessage = async ({ data: { id, task, message } }) => {
  try {
    const result = await tasks[task](message);
    const buffer = result?.buffer ?? result?.visible?.buffer;
    self.postMessage({ id, result }, buffer ? [buffer] : []);
  } catch (error) {
    self.postMessage({ id, error: String(error?.message ?? error) });
  }
};
