// Requests the object before anything else, so that it loads in workers while the page still loads three.js.
import { Engine } from './engine.js';

/** For those who try: ?simd=off takes the build of nifkit without vectors. */
export const simd = new URLSearchParams(location.search).get('simd') === 'off' ? false : undefined;

/** How many workers trace at the same time, with an asset each: one thread is the page's own. */
export const workers = Math.max(1, Math.min((navigator.hardwareConcurrency ?? 2) - 1, 4));

export const started = Engine.open('asset', { url: 'object.nif' }, { workers, simd });
started.catch(() => {}); // app.js reports errors
