// Rays in three.js: nodes for the materials of WebGPURenderer. The sun's shadow replaces a shadow map, and the sky's occlusion is a
// material's aoNode. What answers the rays is { code, words }: nodes of WGSL with nifVisible (rays.js), and the buffer that it
// reads, unless these nodes bind theirs themselves.
import { StorageBufferAttribute } from './three/three.webgpu.js';
import {
  Fn, instanceIndex, normalWorldGeometry, positionWorld, screenCoordinate, storage, uniform, wgsl, wgslFn,
} from './three/three.tsl.js';
import { kRays, kVisible } from './rays.js';

/** Answers by a .nif object, which is where its asset has it: words are in object space. */
export function assetAnswers(object) {
  const words = storage(new StorageBufferAttribute(object.words, 1), 'uint', object.words.length).toReadOnly().setName('nifWords');
  return { code: [wgsl(object.textReading('nifWords.value[i]') + kVisible)], words };
}

/** A function node. Words are an argument so that three.js binds them; the text reads them by their name. */
function makeFunction({ code, words }, more, name, parameters, type, body) {
  const all = words ? `words : ptr<storage, array<u32>, read>, ${parameters}` : parameters;
  const call = wgslFn(`fn ${name}(${all}) -> ${type} { return ${body}; }`, [...code, ...more]);
  return (inputs) => call(words ? { words, ...inputs } : inputs);
}

/** Uniforms that nodes share: the sun's direction and disc (its radius at distance 1), rays to the sky, the frame's number. */
export function makeUniforms(sun, bias) {
  return { sun: uniform(sun), sunRadius: uniform(0), bias: uniform(bias), skyRays: uniform(2, 'uint'), frame: uniform(0, 'uint') };
}

/** { shadow, occlusion }: give `shadow` to a light as light.shadow.shadowNode, and `occlusion` to materials as aoNode. */
export function makeNodes(answers, { sun, sunRadius, bias, skyRays, frame }) {
  const code = [wgsl(kRays)];
  const common = { point: positionWorld, normal: normalWorldGeometry, bias, pixel: screenCoordinate.xy, frame };
  const shadow = makeFunction(answers, code, 'nifSunNode',
    'point : vec3<f32>, normal : vec3<f32>, sun : vec3<f32>, radius : f32, bias : f32, pixel : vec2<f32>, frame : u32', 'f32',
    'nifSun(point, normal, sun, radius, bias, pixel, frame)');
  const occlusion = makeFunction(answers, code, 'nifSkyNode',
    'point : vec3<f32>, normal : vec3<f32>, rays : u32, bias : f32, pixel : vec2<f32>, frame : u32', 'f32',
    'nifSky(point, normal, rays, bias, pixel, frame)');
  return { shadow: shadow({ ...common, sun, radius: sunRadius }), occlusion: occlusion({ ...common, rays: skyRays }) };
}

/** Rays answered in a compute pass of three.js. They are rays of nif.js' Asker, but every one goes from 0 to infinity. */
export class RayPass {
  #renderer;
  #pass;
  #visible;

  constructor(renderer, answers, rays) {
    const count = rays.length / 8;
    this.#renderer = renderer;
    this.#visible = new StorageBufferAttribute(new Uint32Array(count), 1);
    const input = storage(new StorageBufferAttribute(rays, 4), 'vec4', 2 * count).toReadOnly();
    const output = storage(this.#visible, 'uint', count);
    const ask = makeFunction(answers, [], 'nifVisibleNode', 'origin : vec3<f32>, direction : vec3<f32>', 'u32',
      'select(0u, 1u, nifVisible(origin, direction))');
    this.#pass = Fn(() => {
      const origin = input.element(instanceIndex.mul(2)).xyz, direction = input.element(instanceIndex.mul(2).add(1)).xyz;
      output.element(instanceIndex).assign(ask({ origin, direction }));
    })().compute(count);
  }

  /** Answers all, so many times. Returns milliseconds, which include compiling the first time. */
  async run(times = 1) {
    const { queue } = this.#renderer.backend.device;
    await queue.onSubmittedWorkDone();
    const start = performance.now();
    for (let i = 0; i < times; ++i) this.#renderer.compute(this.#pass);
    await queue.onSubmittedWorkDone();
    return performance.now() - start;
  }

  /** 1 for each ray that nothing blocks. */
  async visible() {
    return new Uint32Array(await this.#renderer.getArrayBufferAsync(this.#visible));
  }
}
