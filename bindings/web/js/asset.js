// An asset: a .nif file, loaded.
import { Device } from './device.js';
import { bytesIn, readSignal, refuse, wholeNumber } from './errors.js';
import { bytesOf, open } from './host.js';

const kBrand = Symbol('nifkit');
const encodings = { 1: 'segment', 2: 'spherical', 3: 'bvh', 4: 'exact', 5: 'proof', 6: 'cutout', 0: 'unsupported' };

/** The bytes of a source, and its name for messages. */
export async function readSource(source, signal) {
  if (typeof source === 'string' || source instanceof URL)
    return { name: String(source), bytes: await bytesOf(await open(source, signal), String(source), signal) };
  const isBuffer = source instanceof ArrayBuffer || source instanceof (globalThis.SharedArrayBuffer ?? ArrayBuffer);
  if (isBuffer || ArrayBuffer.isView(source)) return { name: 'memory', bytes: bytesIn(source, 'the asset') };
  if (typeof source?.arrayBuffer === 'function') {
    const name = source.name ?? (source.url || 'memory'); // of a File, a Blob or a Response
    return { name, bytes: await bytesOf(source, name, signal) };
  }
  return refuse('an asset is loaded from a URL, an ArrayBuffer, a typed array, a Blob or a Response');
}

export class Asset {
  #device;
  #handle;
  #name;

  /** Use Asset.load(). */
  constructor(brand, device, handle, name) {
    if (brand !== kBrand) refuse('an asset is made by await Asset.load()');
    this.#device = device;
    this.#handle = handle;
    this.#name = name;
    device._enter();
  }

  static async load(device, source, { signal } = {}) {
    if (!(device instanceof Device)) refuse('the first argument of Asset.load() is no Device');
    device._use();
    const { name, bytes } = await readSource(source, readSignal(signal));
    signal?.throwIfAborted();
    const handle = device._withBytes(bytes, (at) => {
      device._check(device._use()._web_load_asset(device._handle, at, bytes.byteLength), name);
      return device._said()[0];
    });
    return new Asset(kBrand, device, handle, name);
  }

  get device() {
    return this.#device;
  }

  get info() {
    this.#ask('_web_asset_info');
    const [objectCount, instanceCount, networkCount, formatVersion, fileBytes, residentBytes, metadata, metadataBytes, placesNothing, arithmetic, prover, proves] =
      this.#device._said();
    const text = this.#device._text(metadata, metadataBytes);
    return {
      name: this.#name,
      objectCount,
      instanceCount,
      placesNothing: placesNothing !== 0,
      networkCount,
      formatVersion,
      arithmetic,
      prover,
      proves: proves !== 0,
      fileBytes,
      residentBytes,
      // Refused only when it is read: the rest of the asset is valid whatever the metadata is.
      get metadata() {
        try {
          return text ? JSON.parse(text) : undefined;
        } catch (error) {
          return refuse(`the asset's metadata cannot be read as JSON: ${error.message}`, 'DAMAGED_NIF');
        }
      },
    };
  }

  object(object) {
    this.#ask('_web_object_info', wholeNumber(object, 'object'));
    const said = Array.from(this.#device._said());
    return {
      name: this.#device._text(said[0]),
      encoding: encodings[said[1]] ?? String(said[1]),
      network: said[2],
      boundsMin: said.slice(3, 6),
      boundsMax: said.slice(6, 9),
      bias: said[9],
      triangles: said[10],
      residentBytes: said[11],
      proves: said[12] !== 0,
      sourceTriangles: said[13],
      colors: said[14] !== 0,
      level: said[15],
      error: said[16],
      unsupported: this.#device._text(said[17]),
    };
  }

  instance(instance) {
    this.#ask('_web_asset_instance_info', wholeNumber(instance, 'instance'));
    const said = Array.from(this.#device._said());
    return {
      name: this.#device._text(said[0]),
      object: said[1],
      transform: said.slice(2, 14),
      parent: said[14] === 0xffffffff ? undefined : said[14],
      mask: said[15],
      flags: said[16],
      user: (BigInt(said[18]) << 32n) | BigInt(said[17]),
    };
  }

  get disposed() {
    return this.#handle === 0;
  }

  dispose() {
    if (this.#handle === 0) return;
    this.#device._module._web_release_asset(this.#handle);
    this.#handle = 0;
    this.#device._leave();
  }

  [Symbol.dispose ?? Symbol.for('dispose')]() {
    this.dispose();
  }

  /** Internal. */
  get _handle() {
    if (this.#handle === 0) refuse('the asset has been disposed of');
    return this.#handle;
  }

  #ask(call, ...more) {
    this.#device._check(this._handle && this.#device._module[call](this.#handle, ...more), this.#name);
  }
}
