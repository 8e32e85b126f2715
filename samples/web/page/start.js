// Requests the object before anything else, so that it loads in workers while the page still loads three.js.
import { Engine } from './engine.js';

/** For experiments: ?simd=off uses the build of nifkit without SIMD. */
export const simd = new URLSearchParams(location.search).get('simd') === 'off' ? false : undefined;

/** Number of workers that trace at the same time, each with its own asset: one thread is left for the page. */
export const workers = Math.max(1, Math.min((navigator.hardwareConcurrency ?? 2) - 1, 4));

export const started = Engine.open('asset', { url: 'object.nif' }, { workers, simd });
started.catch(() => {}); // app.js reports errors
