// Loads one of the two builds of the runtime, and keeps what is compiled for the next device.
import { NifError, failure, refuse } from './errors.js';
import { bytesOf, open } from './host.js';

/** A module of one function that returns a vector. */
const withVectors = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11);

/** Does this engine have vectors of 128 bits? */
export const hasSimd = () => typeof WebAssembly === 'object' && WebAssembly.validate(withVectors);

const compiled = new Map();

function compile(url) {
  const key = String(url);
  if (!compiled.has(key)) {
    const compiling = (async () => {
      const opened = await open(url);
      const isStream = !(opened instanceof Uint8Array) && opened.headers.get('content-type')?.startsWith('application/wasm');
      return isStream ? WebAssembly.compileStreaming(opened) : WebAssembly.compile(await bytesOf(opened, key));
    })();
    compiled.set(key, compiling);
    compiling.catch(() => compiled.delete(key));
  }
  return compiled.get(key);
}

const builds = {
  nifkit: { glue: () => import('./nifkit.mjs'), wasm: () => new URL('./nifkit.wasm', import.meta.url) },
  'nifkit-simd': { glue: () => import('./nifkit-simd.mjs'), wasm: () => new URL('./nifkit-simd.wasm', import.meta.url) },
};

/** Makes an instance of the module, with its own memory. */
export async function instantiate(simd) {
  if (typeof WebAssembly !== 'object') refuse('this engine has no WebAssembly', 'NOT_AVAILABLE');
  if (simd && !hasSimd()) refuse('this engine has no vectors of 128 bits in WebAssembly: create the device with simd: false', 'NOT_AVAILABLE');
  const build = builds[simd ? 'nifkit-simd' : 'nifkit'];
  const [glue, wasm] = await Promise.all([build.glue(), compile(build.wasm())]);
  // Makes a new promise, because the glue's never settles if there is no instance.
  return new Promise((resolve, reject) => {
    const instantiateWasm = (imports, done) => {
      WebAssembly.instantiate(wasm, imports)
        .then((instance) => done(instance, wasm))
        .catch(reject);
      return {};
    };
    glue.default({ instantiateWasm }).then(resolve, reject);
  }).catch((error) => {
    throw error instanceof NifError ? error : failure(`the module cannot be started: ${error.message}`, 'OUT_OF_MEMORY');
  });
}
