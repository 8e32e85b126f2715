// A .nif object in WebGPU: its words in a buffer, and nif.wgsl in front of your own text. Nothing here knows of an engine.

const kMagic = 0x5346494e, kVersion = 2; // words 0 and 1
const kBinding = /^@group\(0\) @binding\(0\) .*\n/m, kRead = /^fn nif_word\(.*\n/m;

async function read(url) {
  const response = await fetch(url).catch(() => null);
  if (!response?.ok) throw new Error(`${url} cannot be read${response ? `: the server answers with ${response.status}` : ''}`);
  return response.arrayBuffer();
}

/** The content of a file that gzip has packed, and how many bytes went over the wire. */
async function unpack(url) {
  const packed = await read(url);
  try {
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
    return { bytes: await new Response(stream).arrayBuffer(), wire: packed.byteLength };
  } catch {
    throw new Error(`${url} is damaged: it cannot be unpacked`);
  }
}

/** Words from their bytes, of which the file has all lowest ones first (pack.py). */
function joined(buffer) {
  const bytes = new Uint8Array(buffer), count = bytes.length >> 2, words = new Uint8Array(4 * count);
  for (let i = 0; i < count; ++i) for (let k = 0; k < 4; ++k) words[4 * i + k] = bytes[k * count + i];
  return words.buffer;
}

/**
 * Loads the words of an object, packed by pack.py, and the text of the functions, packed by gzip; `nif export-shader` writes both.
 * A shader cannot report errors, so the words are checked here.
 */
export async function loadObject(wordsUrl, textUrl) {
  const [words, text] = await Promise.all([unpack(wordsUrl), unpack(textUrl)]);
  const object = new NifObject(joined(words.bytes), new TextDecoder().decode(text.bytes), wordsUrl);
  object.wire = { words: words.wire, text: text.wire };
  return object;
}

export class NifObject {
  constructor(bytes, text, name) {
    if (bytes.byteLength < 256 || bytes.byteLength % 4 !== 0) throw new Error(`${name} is too short for the words of an object`);
    const words = new Uint32Array(bytes), numbers = new Float32Array(bytes);
    if (words[0] !== kMagic) throw new Error(`${name} does not have the words of an object`);
    if (words[1] !== kVersion) throw new Error(`${name} has words of version ${words[1]}; nif.wgsl reads version ${kVersion}`);
    if (words[2] !== words.length) throw new Error(`${name} has ${words.length} words of ${words[2]}`);
    const room = Number(/NIF_NETWORK_WORDS : u32 = (\d+)u/.exec(text)?.[1] ?? 0); // a text without networks has none
    if (!kBinding.test(text) || !kRead.test(text)) throw new Error('nif.wgsl is not as this page knows it');
    if (words[21] > room) throw new Error(`${name} needs NIF_NETWORK_WORDS ${words[21]}; nif.wgsl has ${room}`);
    this.words = words;
    this.text = text;
    this.bounds = [Array.from(numbers.subarray(40, 43)), Array.from(numbers.subarray(43, 46))];
    /** Shadow rays start so far above the surface. */
    this.bias = numbers[46];
  }

  /** Throws if a device cannot have the words in a buffer. */
  checkLimits({ maxStorageBufferBindingSize: most }) {
    const needed = this.words.byteLength;
    if (needed > most) throw new Error(`The device allows ${most} bytes in a storage buffer, and the object needs ${needed}`);
  }

  /** The text for an engine that binds the buffer itself: `expression` reads word i, e.g. 'buffer.value[i]'. */
  textReading(expression) {
    return this.text.replace(kBinding, '').replace(kRead, `fn nif_word(i : u32) -> u32 { return ${expression}; }\n`);
  }
}

const kAsk = `
@group(0) @binding(1) var<storage, read> rays : array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> visible : array<u32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id : vec3<u32>) {
  let i = id.x;
  if (i < arrayLength(&visible)) {
    let start = rays[2u * i];
    let way = rays[2u * i + 1u];
    visible[i] = select(0u, 1u, nif_query(0u, start.xyz, way.xyz, start.w, way.w).visible);
  }
}`;

/** Rays answered in a compute pass: WebGPU itself, without an engine. */
export class Asker {
  #device;
  #pipeline;
  #words;
  #bounds;

  static async create(device, object) {
    const asker = new Asker();
    asker.#device = device;
    const module = device.createShaderModule({ code: object.text + kAsk });
    asker.#pipeline = await device.createComputePipelineAsync({ layout: 'auto', compute: { module, entryPoint: 'main' } });
    asker.#words = asker.#input(object.words);
    asker.#bounds = object.bounds;
    return asker;
  }

  #input(data) {
    const buffer = this.#device.createBuffer({ size: data.byteLength, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
    this.#device.queue.writeBuffer(buffer, 0, data);
    return buffer;
  }

  /** rays: 8 floats each: origin, tmin, direction, tmax; at most 4 million. Returns 1 for each that nothing blocks; the time. */
  async visible(rays) {
    const count = rays.length / 8, size = 4 * count, device = this.#device;
    const input = this.#input(rays);
    const output = device.createBuffer({ size, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC });
    const read = device.createBuffer({ size, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
    const entries = [this.#words, input, output].map((buffer, binding) => ({ binding, resource: { buffer } }));
    const commands = device.createCommandEncoder(), pass = commands.beginComputePass();
    pass.setPipeline(this.#pipeline);
    pass.setBindGroup(0, device.createBindGroup({ layout: this.#pipeline.getBindGroupLayout(0), entries }));
    pass.dispatchWorkgroups(Math.ceil(count / 64));
    pass.end();
    await device.queue.onSubmittedWorkDone();
    const start = performance.now();
    device.queue.submit([commands.finish()]);
    await device.queue.onSubmittedWorkDone();
    const milliseconds = performance.now() - start;
    const copy = device.createCommandEncoder();
    copy.copyBufferToBuffer(output, 0, read, 0, size);
    device.queue.submit([copy.finish()]);
    await read.mapAsync(GPUMapMode.READ);
    const visible = new Uint32Array(read.getMappedRange().slice(0));
    for (const buffer of [input, output, read]) buffer.destroy();
    return { visible, milliseconds };
  }

  /** Rays a second, for lines between random points of the object's box, as many as take a while. */
  async rate() {
    for (let count = 1 << 14; ; count *= 4) {
      const { milliseconds } = await this.visible(randomRays(count, this.#bounds));
      if (milliseconds > 30 || count >= 1 << 20) return (count / milliseconds) * 1000;
    }
  }
}

/** Lines between random points of a box, as Asker takes rays. */
export function randomRays(count, [low, high]) {
  const rays = new Float32Array(8 * count);
  for (let i = 0; i < rays.length; i += 8) {
    for (let a = 0; a < 3; ++a) {
      const from = low[a] + Math.random() * (high[a] - low[a]), to = low[a] + Math.random() * (high[a] - low[a]);
      rays[i + a] = from;
      rays[i + 4 + a] = to - from;
    }
    rays[i + 7] = 1e30;
  }
  return rays;
}
