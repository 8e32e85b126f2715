// Shared by the tests: the built package, and golden assets.
import { existsSync, readdirSync, readFileSync } from 'node:fs';

export const root = new URL('../../../', import.meta.url);
export const nifkit = await import(new URL('build/web/nifkit/index.js', root).href);
export const { Asset, Device, NifError, Pool, Scene } = nifkit;

const folder = new URL('tests/golden/', root);
export const goldenNames = readdirSync(folder)
  .filter((name) => name.endsWith('.nif'))
  .sort();
export const golden = (name) => new URL(name, folder);
export const goldenBytes = (name) => new Uint8Array(readFileSync(golden(name)));

/** The two builds of the module. */
export const builds = [{ simd: true }, { simd: false }];
export const nameOf = ({ simd }) => (simd ? 'vectors' : 'scalar');

/** What bindings/web/test/native has written about an asset; see native.cpp. */
export function nativeAnswers(name) {
  const file = new URL(`build/web/native/${name}.answers`, root);
  if (!existsSync(file)) throw new Error(`${file.pathname} is missing: bindings/web/test/run.sh makes it`);
  return readFileSync(file).buffer;
}
export const nativeRays = 40000;

/** Reads typed arrays off the front of a buffer. */
export class Cursor {
  #at = 0;
  constructor(buffer) {
    this.buffer = buffer;
  }
  take(Type, length) {
    const array = new Type(this.buffer, this.#at, length);
    this.#at += array.byteLength;
    return array;
  }
  get done() {
    return this.#at === this.buffer.byteLength;
  }
}

/** Rays through and about a box, the same ones each time. */
export function someRays(count) {
  const rays = new Float32Array(8 * count);
  let state = 1;
  for (let i = 0; i < rays.length; ++i) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    rays[i] = i % 8 === 3 ? 0 : i % 8 === 7 ? Infinity : (state / 2 ** 32) * 4 - 2;
  }
  return rays;
}
