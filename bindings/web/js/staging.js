// Copies batches into and out of the module's memory, chunk by chunk, through a buffer that is allocated once.
import { refuse } from './errors.js';
import { ANSWERS, HITS, OPEN, RAY } from './rays.js';

/** Rays per chunk: few enough for phones (a buffer of 3 MB). A multiple of 8. */
const kPiece = 32768;

/** Words of the structure Rays in src/module.cpp. */
const kRaysWords = 11;

const align = (bytes) => (bytes + 15) & ~15;
const bytesOf = ([Type, each]) => align(Math.ceil(kPiece * each) * Type.BYTES_PER_ELEMENT);
const roomOf = (kinds) => Object.values(kinds).reduce((sum, kind) => sum + bytesOf(kind), 0);

export class Staging {
  #module;
  #start;
  #numbers;
  #answers;

  constructor(module) {
    this.#module = module;
    const head = 256;
    const room = head + kPiece * (RAY + 1) * 4 + Math.max(roomOf(ANSWERS) + roomOf(OPEN), roomOf(HITS));
    this.#start = module._malloc(room) >>> 0;
    if (this.#start === 0) refuse('out of memory', 'OUT_OF_MEMORY');
    this.rays = this.#start;
    this.outputs = this.#start + align(kRaysWords * 4);
    this.#numbers = this.#start + head;
    this.#answers = this.#numbers + kPiece * (RAY + 1) * 4;
  }

  free() {
    this.#module._free(this.#start);
  }

  /** Copies rays into the buffer, from number `first` on; returns how many. */
  load(batch, first, kinds, arrays) {
    const { HEAPF32, HEAPU32 } = this.#module;
    const count = Math.min(kPiece, batch.count - first);
    let at = this.#numbers;
    const put = (array, each, heap = HEAPF32) => {
      const forAll = array.length === each && batch.count !== 1;
      heap.set(forAll ? array.subarray(0, each) : array.subarray(first * each, (first + count) * each), at / 4);
      const place = [at, forAll ? 0 : each * 4];
      at += kPiece * each * 4;
      return place;
    };
    let places;
    if (batch.rays) {
      const [start, stride] = put(batch.rays, RAY);
      places = [16, 12, 28].reduce((all, offset) => [...all, [start + offset, stride]], [[start, stride]]);
      // origin, direction, tmin, tmax
    } else {
      places = [put(batch.origins, 3), put(batch.directions, 3), put(batch.tmin, 1), put(batch.tmax, 1)];
    }
    places.push(batch.mask ? put(batch.mask, 1, HEAPU32) : [0, 0]);
    HEAPU32[this.rays / 4] = count;
    places.forEach(([start, stride], i) => {
      HEAPU32[this.rays / 4 + 1 + i] = start;
      HEAPU32[this.rays / 4 + 6 + i] = stride;
    });
    let to = this.#answers;
    Object.keys(kinds).forEach((name, i) => {
      HEAPU32[this.outputs / 4 + i] = arrays[name] ? to : 0;
      to += bytesOf(kinds[name]);
    });
    return count;
  }

  /** Copies `count` answers of these kinds out of the buffer, from `from` on; returns where they end. */
  store(first, count, kinds, arrays, from = this.#answers) {
    const buffer = this.#module.HEAPU8.buffer;
    for (const [name, kind] of Object.entries(kinds)) {
      const [Type, each] = kind;
      arrays[name]?.set(new Type(buffer, from, Math.ceil(count * each)), first * each);
      from += bytesOf(kind);
    }
    return from;
  }
}
