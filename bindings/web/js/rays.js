// Checks batches of rays, and makes typed arrays for the answers.
import { refuse, typedArray, wholeNumber } from './errors.js';

/** The outputs of queries: class of the array, and numbers per ray. In the order of the C++ structures. */
export const ANSWERS = {
  visible: [Uint8Array, 1],
  visibleBits: [Uint8Array, 1 / 8],
  probability: [Float32Array, 1],
  certain: [Uint8Array, 1],
  logit: [Int32Array, 1],
};
export const HITS = {
  hit: [Uint8Array, 1],
  t: [Float32Array, 1],
  normal: [Float32Array, 3],
  instance: [Uint32Array, 1],
  object: [Uint32Array, 1],
  triangle: [Uint32Array, 1],
  u: [Float32Array, 1],
  v: [Float32Array, 1],
  certain: [Uint8Array, 1],
  tLow: [Float32Array, 1],
  tHigh: [Float32Array, 1],
  color: [Float32Array, 3],
  user: [BigUint64Array, 1],
};
/** Lists of the rays that queryOpen() leaves open. */
export const OPEN = { rays: [Uint32Array, 1], tmin: [Float32Array, 1], tmax: [Float32Array, 1], instance: [Uint32Array, 1] };

/** Numbers of a ray in the layout of NifRay: origin, tmin, direction, tmax. */
export const RAY = 8;

/** One number for all rays, or one for each. */
function limits(value, name, fallback) {
  if (value === undefined || value === null) return Float32Array.of(fallback);
  if (typeof value === 'number') return Float32Array.of(value);
  return typedArray(value, Float32Array, name);
}

/** One mask for all rays, or one for each; undefined if there is none. */
function masks(value) {
  if (value === undefined || value === null) return undefined;
  return typeof value === 'number' ? Uint32Array.of(wholeNumber(value, 'mask')) : typedArray(value, Uint32Array, 'mask');
}

/** Checks a batch. Returns `count`, `mask` (may be undefined), and either `rays`, or origins, directions, tmin and tmax. */
export function readRays(batch) {
  if (batch instanceof Float32Array) batch = { rays: batch };
  if (typeof batch !== 'object' || batch === null) refuse('rays are a Float32Array, or { origins, directions, tmin, tmax, mask }');
  const mask = masks(batch.mask);
  const one = (count) => {
    if (mask && mask.length !== 1 && mask.length !== count && count > 0) refuse(`mask has ${mask.length} numbers for ${count} rays, neither 1 for all nor ${count}`);
    return { count, mask };
  };
  if (batch.rays !== undefined) {
    const rays = typedArray(batch.rays, Float32Array, 'rays');
    if (rays.length % RAY !== 0) refuse(`rays has ${rays.length} numbers, which is no multiple of ${RAY}`);
    return { ...one(rays.length / RAY), rays };
  }
  const arrays = {
    origins: typedArray(batch.origins, Float32Array, 'origins'),
    directions: typedArray(batch.directions, Float32Array, 'directions'),
    tmin: limits(batch.tmin, 'tmin', 0),
    tmax: limits(batch.tmax, 'tmax', Infinity),
  };
  const each = { origins: 3, directions: 3, tmin: 1, tmax: 1 };
  const count = batch.count === undefined ? Math.max(arrays.origins.length, arrays.directions.length) / 3 : wholeNumber(batch.count, 'count');
  if (!Number.isInteger(count)) refuse('origins or directions are no whole number of points: three numbers each');
  for (const [name, array] of Object.entries(arrays))
    if (array.length !== each[name] && array.length !== each[name] * count && count > 0)
      refuse(`${name} has ${array.length} numbers for ${count} rays, neither ${each[name]} for all nor ${each[name] * count}`);
  return { ...one(count), ...arrays };
}

/** Returns the arrays to fill, by name: those given, and new ones for `true`. */
export function readOutputs(kinds, outputs, count) {
  if (typeof outputs !== 'object' || outputs === null) refuse('outputs are an object: a typed array, or true for a new one, under each name');
  const arrays = {};
  for (const [name, wanted] of Object.entries(outputs)) {
    if (wanted === undefined || wanted === false || wanted === null) continue;
    if (!Object.hasOwn(kinds, name)) refuse(`there is no output '${name}'; there are ${Object.keys(kinds).join(', ')}`);
    const [Type, each] = kinds[name];
    const length = Math.ceil(count * each);
    arrays[name] = wanted === true ? new Type(length) : typedArray(wanted, Type, name);
    if (arrays[name].length < length) refuse(`${name} has room for ${arrays[name].length} numbers, and ${length} are needed`);
  }
  if (Object.keys(arrays).length === 0) refuse(`no output is wanted; there are ${Object.keys(kinds).join(', ')}`);
  return arrays;
}
