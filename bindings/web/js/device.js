// A device: one instance of the module, its memory, and the way to call it.
import { NifError, refuse } from './errors.js';
import { hasSimd, instantiate } from './module.js';
import { Staging } from './staging.js';

const kBrand = Symbol('nifkit');

export class Device {
  #module;
  #handle = 0;
  #staging;
  #users = 1;
  #disposed = false;
  _inFallback = false; // while a fallback runs, scenes are not to be used

  /** Use Device.create(). */
  constructor(brand, module) {
    if (brand !== kBrand) refuse('a device is made by await Device.create()');
    this.#module = module;
  }

  static async create({ simd = hasSimd() } = {}) {
    const device = new Device(kBrand, await instantiate(Boolean(simd)));
    device._check(device.#module._web_new_device());
    const said = device._said();
    device.#handle = said[0];
    device.isa = device._text(said[1]);
    return device;
  }

  /** Bytes of the module's memory. It grows, and is freed when the device is no longer used. */
  get memoryBytes() {
    return this._use().HEAPU8.buffer.byteLength;
  }

  get disposed() {
    return this.#disposed;
  }

  dispose() {
    if (this.#disposed) return;
    this.#disposed = true;
    this._leave();
  }

  [Symbol.dispose ?? Symbol.for('dispose')]() {
    this.dispose();
  }

  // The members below are internal.

  /** The module, for one who may use it. */
  _use() {
    if (this.#disposed) refuse('the device has been disposed of');
    return this.#module;
  }
  get _handle() {
    this._use();
    return this.#handle;
  }
  /** The module, even after the device was disposed of: its assets and scenes keep it. */
  get _module() {
    return this.#module;
  }
  _enter() {
    ++this.#users;
  }
  _leave() {
    if (--this.#users > 0) return;
    this.#staging?.free();
    this.#module._web_release_device(this.#handle);
    this.#module = undefined;
  }

  _staging() {
    this.#staging ??= new Staging(this.#module);
    return this.#staging;
  }

  /** Throws if the code is an error. `name`: what an asset in memory is called. */
  _check(code, name) {
    if (code === 0) return;
    let message = this._text(this.#module._web_message());
    if (name !== undefined && message.startsWith('memory: ')) message = name + message.slice('memory'.length);
    throw new NifError(code, this._text(this.#module._web_error_name(code)), message);
  }
  /** The results of the last call. */
  _said() {
    const at = this.#module._web_said() / 8;
    return this.#module.HEAPF64.subarray(at, at + 24);
  }
  _text(at, bytes) {
    const heap = this.#module.HEAPU8;
    const end = bytes === undefined ? heap.indexOf(0, at) : at + bytes;
    return new TextDecoder().decode(heap.slice(at, end));
  }
  /** Calls use(pointer) with these bytes in the module's memory. */
  _withBytes(bytes, use) {
    if (!this.#module) this._use();
    const at = this.#module._malloc(Math.max(bytes.byteLength, 1)) >>> 0;
    if (at === 0) refuse('out of memory', 'OUT_OF_MEMORY');
    try {
      this.#module.HEAPU8.set(new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength), at);
      return use(at);
    } finally {
      this.#module._free(at);
    }
  }
}
