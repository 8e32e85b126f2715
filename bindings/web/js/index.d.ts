/**
 * nifkit: load .nif assets, and ask whether rays are blocked. The calls are those of nif.h, whose rules hold: which rays are
 * invalid, what is certain, what each output means. Numbers are 32-bit floats; points are x, y, z; lengths are in the units of
 * the scene.
 *
 * A device, with all its assets and scenes, is used on the thread that made it. Each of them keeps memory until dispose();
 * calling that twice does nothing, any other call after it throws. Assets and scenes keep their device alive.
 */

declare global {
  interface SymbolConstructor {
    /** As in TypeScript's own esnext.disposable, which few projects name. */
    readonly dispose: unique symbol;
  }
}

/** Thrown when a call fails: `message` is one sentence. */
export class NifError extends Error {
  /** Its number in nif.h, e.g. 32. */
  readonly code: number;
  /** Its name there, e.g. "NIF_ERROR_DAMAGED_NIF". */
  readonly codeName: string;
}

/** Does this engine have vectors of 128 bits in WebAssembly? */
export function hasSimd(): boolean;

export interface DeviceOptions {
  /** Use vectors of 128 bits; by default if the engine has them. The answers are the same. */
  simd?: boolean;
}

/** One instance of the runtime, with its own memory. */
export class Device {
  private constructor();
  /** Loads the module, 138 kB compressed (without vectors 106 kB), unless another device has loaded it. */
  static create(options?: DeviceOptions): Promise<Device>;
  /** "wasm" (vectors) or "scalar". */
  readonly isa: string;
  /** Bytes of the module's memory. It grows as needed, up to 4 GB, and never shrinks. */
  readonly memoryBytes: number;
  readonly disposed: boolean;
  dispose(): void;
  [Symbol.dispose](): void;
}

/** Where an asset comes from: a URL (in node also a path), bytes, a File or Blob, a Response. Bytes are copied. */
export type Source = string | URL | ArrayBufferLike | ArrayBufferView | { arrayBuffer(): Promise<ArrayBuffer> };

export interface AssetInfo {
  /** The source's name; "memory" for bytes. */
  name: string;
  objectCount: number;
  instanceCount: number;
  /** True: the file places no object. False: without instances in the file, each object is placed once. */
  placesNothing: boolean;
  networkCount: number;
  formatVersion: number;
  /** The revisions of the arithmetic by which the asset is answered, and of what proved its planes. */
  arithmetic: number;
  prover: number;
  /** False: no answer about its objects is certain. */
  proves: boolean;
  fileBytes: number;
  residentBytes: number;
  /** The baker's metadata, parsed; undefined if there is none. Throws NIF_ERROR_DAMAGED_NIF if it is not JSON. */
  readonly metadata: unknown;
}

export interface ObjectInfo {
  name: string;
  encoding: 'segment' | 'spherical' | 'bvh' | 'exact' | 'proof' | 'cutout' | 'unsupported';
  network: number;
  /** Of the source mesh, in object space. */
  boundsMin: number[];
  boundsMax: number[];
  /** Start shadow rays this far from the surface, in object units. */
  bias: number;
  triangles: number;
  residentBytes: number;
  proves: boolean;
  /** 0: the object does not have the source mesh's numbers of triangles. */
  sourceTriangles: number;
  colors: boolean;
  /** Above 0: a coarser stand-in for the next object, which is a level below. */
  level: number;
  /** The largest distance of its surface from the source's, in object units; 0: none or unknown. */
  error: number;
  /** Why this version cannot answer the object, which cannot be placed then; '' for all others. */
  unsupported: string;
}

/** A placement of an object in the asset's file. */
export interface AssetInstanceInfo {
  name: string;
  object: number;
  /** 12 numbers, as a Transform. */
  transform: number[];
  /** The number of an earlier instance of the file that takes this one along when it moves. */
  parent: number | undefined;
  /** This and the next two are set by Scene.addAsset(). */
  mask: number;
  flags: number;
  user: bigint;
}

export interface SignalOptions {
  /**
   * Ends the call early: its promise is rejected with the signal's reason, unless it was already done. Work that a worker has
   * already started is finished first, which takes some milliseconds.
   */
  signal?: AbortSignal;
}

/** An immutable asset, for any number of scenes of its device. */
export class Asset {
  private constructor();
  /** Safe on untrusted bytes: damaged files are refused. */
  static load(device: Device, source: Source, options?: SignalOptions): Promise<Asset>;
  readonly device: Device;
  readonly info: AssetInfo;
  object(object: number): ObjectInfo;
  instance(instance: number): AssetInstanceInfo;
  readonly disposed: boolean;
  dispose(): void;
  [Symbol.dispose](): void;
}

/** 12 numbers, a row-major 3x4 matrix: world x = t[0] x + t[1] y + t[2] z + t[3], and so on. */
export type Transform = ArrayLike<number>;

/**
 * A batch of rays. Either 8 numbers per ray: origin x, y, z, tmin, direction x, y, z, tmax. Or separate arrays, each with one
 * value for all rays, or one per ray. A ray meets the instances whose own mask has a bit in common with its mask; without a
 * mask, all.
 */
export type Rays =
  | Float32Array
  | { rays: Float32Array; mask?: number | Uint32Array }
  | {
      origins: Float32Array;
      directions: Float32Array;
      /** 0 if it is not given. */
      tmin?: number | Float32Array;
      /** Infinity if it is not given. */
      tmax?: number | Float32Array;
      mask?: number | Uint32Array;
      /** Needed if origins and directions do not determine it. */
      count?: number;
    };

/** A typed array to fill, or true for a new one. */
export type Wanted<T> = T | true;

export interface Answers {
  /** 1: visible, 0: occluded. */
  visible: Uint8Array;
  /** The same as bits, the lowest first. */
  visibleBits: Uint8Array;
  /** Calibrated probability that the ray is visible. */
  probability: Float32Array;
  /** 1: proven. */
  certain: Uint8Array;
  /** The smallest network output of all instances: below 0 means occluded. LOGIT_CERTAIN or its negative if no network decided. */
  logit: Int32Array;
}

export interface Hits {
  /** 1: the ray hits something. */
  hit: Uint8Array;
  /** Where, in units of the direction; Infinity if nothing is hit. */
  t: Float32Array;
  /** [3] Of unit length, in world space, on the side that the ray comes from. */
  normal: Float32Array;
  /** The scene's number of the instance; NONE if nothing is hit. */
  instance: Uint32Array;
  /** That instance's object, as numbered in its asset; NONE if nothing is hit. */
  object: Uint32Array;
  /** The triangle, if the object has triangles (see ObjectInfo.sourceTriangles); else NONE. */
  triangle: Uint32Array;
  /** Weights of the triangle's second and third vertex. */
  u: Float32Array;
  v: Float32Array;
  /** 1: it is proven whether the ray hits something. */
  certain: Uint8Array;
  /** Proven: nothing is hit before tLow, and something at or before tHigh. */
  tLow: Float32Array;
  tHigh: Float32Array;
  /** [3] Linear red, green and blue. */
  color: Float32Array;
  /** The value that setInstanceUser() gave the instance; 0 if nothing is hit. */
  user: BigUint64Array;
}

/** Rays that proofs leave open: entry k is about ray number rays[k]; only its interval from tmin[k] to tmax[k] matters. */
export interface OpenRays {
  rays: Uint32Array;
  tmin: Float32Array;
  tmax: Float32Array;
  /** The instance, if only one of them leaves the ray open; NONE if several do. */
  instance: Uint32Array;
}

/** An instance, as it was last set, committed or not. */
export interface InstanceInfo {
  asset: Asset;
  object: number;
  mask: number;
  /** A sum of flags, such as INSTANCE_DISABLED. */
  flags: number;
  user: bigint;
  origin: number[];
  /** 12 numbers, as a Transform. */
  transform: number[];
}

/** A flag of an instance: no ray meets it. */
export const INSTANCE_DISABLED: 1;
/** The number of what is not there, in hits and open rays. */
export const NONE: 0xffffffff;
/** The logit of rays that no network decided: this if they are visible, its negative if occluded. */
export const LOGIT_CERTAIN: 0x7fffffff;

/**
 * Answers rays exactly: sets visible[k] to 1 or 0 for ray number rays[k] of the query. At first visible[k] is the learned
 * answer. Gets 1 to 1,024 rays, in ascending order. It must not use scenes of the device that calls it, and is not asynchronous.
 * If it throws, the query throws the same.
 */
export type Fallback = (rays: Uint32Array, visible: Uint8Array) => void;

type Wanting<All> = { [Name in keyof All]?: Wanted<All[Name]> };
type Given<All, Some> = { [Name in keyof Some & keyof All]: All[Name] };

/** Instances of objects: build, commit, query; after a change, commit again. */
export class Scene {
  constructor(device: Device);
  readonly device: Device;
  /** Adds all instances of the asset's file, or, if it has none, each object once (unless it placesNothing). Returns their numbers. */
  addAsset(asset: Asset, transform?: Transform | null): { first: number; count: number };
  /** Returns the instance's number: the lowest free one. */
  addInstance(asset: Asset, object: number, transform?: Transform | null): number;
  /** Its number becomes free for the next addInstance(); the others keep theirs. */
  removeInstance(instance: number): void;
  setInstanceTransform(instance: number, transform?: Transform | null): void;
  /** 12 numbers for each instance. Null: instances 0, 1, ... All or nothing. */
  setInstanceTransforms(instances: ArrayLike<number> | null, transforms: ArrayLike<number>): void;
  /** Three numbers, added to the transform's translation in double precision. Null: 0 0 0. */
  setInstanceOrigin(instance: number, origin: ArrayLike<number> | null): void;
  /** Rays, hits and bounds are relative to it. Move it with the camera, in worlds too large for 32-bit floats. */
  setOrigin(origin: ArrayLike<number> | null): void;
  /** A ray meets the instance only if their masks have a bit in common. 0xffffffff for a new one. */
  setInstanceMask(instance: number, mask: number): void;
  setInstanceFlags(instance: number, flags: number): void;
  /** A value for your own use, 0 to 2^64 - 1, which hits return. */
  setInstanceUser(instance: number, user: number | bigint): void;
  instance(instance: number): InstanceInfo;
  commit(): void;
  readonly info: {
    instanceCount: number;
    /** All their numbers are below this. */
    instanceEnd: number;
    committed: boolean;
    boundsMin: number[];
    boundsMax: number[];
    residentBytes: number;
    origin: number[];
  };
  /** Finds which rays are visible. Returns the arrays; by default { visible: true }. */
  query(rays: Rays): { visible: Uint8Array };
  query<Some extends Wanting<Answers>>(rays: Rays, outputs: Some): Given<Answers, Some>;
  /**
   * As query(), but `fallback` answers rays that are not certain and whose probability p has max(p, 1 - p) < confidence: 0.5 or
   * less passes none, a number above 1 every ray that is not certain. Its answers count as certain.
   */
  queryWithFallback<Some extends Wanting<Answers>>(rays: Rays, outputs: Some, confidence: number, fallback: Fallback): Given<Answers, Some>;
  /** Answers the rays that have a proof and lists the others, without networks. Listed rays get visible 0 and certain 0. */
  queryOpen(rays: Rays): OpenRays & { answers: { visible: Uint8Array } };
  queryOpen<Some extends Wanting<Answers>>(rays: Rays, outputs: Some): OpenRays & { answers: Given<Answers, Some> };
  /** Finds where rays first hit the scene; by default { hit: true, t: true }. */
  intersect(rays: Rays): { hit: Uint8Array; t: Float32Array };
  intersect<Some extends Wanting<Hits>>(rays: Rays, outputs: Some): Given<Hits, Some>;
  readonly disposed: boolean;
  dispose(): void;
  [Symbol.dispose](): void;
}

export interface PoolInstance {
  /** Its index in the pool's assets. */
  asset: number;
  /** One object; without it all instances of the asset. */
  object?: number;
  transform?: Transform | null;
  /** Of each of its instances, as in Scene.setInstanceOrigin(). */
  origin?: ArrayLike<number> | null;
  mask?: number;
  flags?: number;
  user?: number | bigint;
}

export interface PoolOptions extends SignalOptions {
  /** 1 to 64; by default as many as the machine has threads, at most 8. */
  workers?: number;
  assets: Source[];
  /** By default each asset once. */
  instances?: PoolInstance[];
  /** As in Scene.setOrigin(). */
  origin?: ArrayLike<number> | null;
  simd?: boolean;
}

/**
 * Web Workers (in node, worker threads) that answer batches together, off the calling thread. Needs no shared memory. There is
 * no queryWithFallback(), because functions cannot be sent to workers: use queryOpen().
 */
export class Pool {
  private constructor();
  static create(options: PoolOptions): Promise<Pool>;
  readonly workers: number;
  /** Replaces all instances. Earlier batches use the earlier instances. */
  setInstances(instances: PoolInstance[]): Promise<void>;
  /** As Scene.setOrigin() and a commit. Earlier batches use the earlier origin, which also stays if this fails. */
  setOrigin(origin: ArrayLike<number> | null): Promise<void>;
  /** As Scene.query(). Rays are copied before it returns; do not touch arrays to fill until it is done, or has failed. */
  query(rays: Rays): Promise<{ visible: Uint8Array }>;
  query<Some extends Wanting<Answers>>(rays: Rays, outputs: Some, options?: SignalOptions): Promise<Given<Answers, Some>>;
  /** As Scene.queryOpen(). */
  queryOpen(rays: Rays): Promise<OpenRays & { answers: { visible: Uint8Array } }>;
  queryOpen<Some extends Wanting<Answers>>(rays: Rays, outputs: Some, options?: SignalOptions): Promise<OpenRays & { answers: Given<Answers, Some> }>;
  /** As Scene.intersect(). */
  intersect(rays: Rays): Promise<{ hit: Uint8Array; t: Float32Array }>;
  intersect<Some extends Wanting<Hits>>(rays: Rays, outputs: Some, options?: SignalOptions): Promise<Given<Hits, Some>>;
  readonly disposed: boolean;
  /** Ends the workers. Running queries fail. */
  dispose(): void;
  [Symbol.dispose](): void;
}
