// Answers a case of shader_cases by nif.wgsl in WebGPU, and counts the answers that are not the CPU's.
//
//   node answer.mjs NIF.wgsl FILE.case    with Dawn, from npm's webgpu
//   deno run -A answer.mjs NIF.wgsl FILE.case    with wgpu and naga
//
// Without a case it only compiles the text.
//
// Where a case has triangles, the text is asked with proofs, as GLSL has them: rounding decides some of these rays, and the text
// must know which. Prints one line: "triangles" or "planes", the case, its rays, those whose visibility or first hit differs, those
// that the shader calls certain, those of them that differ, those whose logit differs, and the device. Ends with 1 and a sentence if there is no device, or the text does not compile.
import { readFileSync } from 'node:fs';
import { basename } from 'node:path';
import process from 'node:process';

const kMain = `
@group(0) @binding(1) var<storage, read> rays : array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> answers : array<vec4<u32>>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id : vec3<u32>) {
  let i = id.x;
  if (i >= arrayLength(&answers)) {
    return;
  }
  let start = rays[2u * i];
  let way = rays[2u * i + 1u];
  let answer = QUERY;
  answers[i] = vec4<u32>(FOUND);
}`;
/** At once: devices limit buffers and workgroups. */
const kMostRays = 1 << 20;
// By what is asked for, and whether it is a scene.
const kQueries = [
  ['nif_query(0u, start.xyz, way.xyz, start.w, way.w)', 'nif_query_scene(0u, start.xyz, way.xyz, start.w, way.w, 0xffffffffu)'],
  ['nif_first_hit(0u, start.xyz, way.xyz, start.w, way.w)',
    'nif_first_hit_scene(0u, start.xyz, way.xyz, start.w, way.w, 0xffffffffu)'],
];
const kFound = [
  'select(0u, 1u, answer.visible), select(0u, 1u, answer.certain), bitcast<u32>(answer.logit), 0u',
  'select(0u, 1u, answer.hit), select(0u, 1u, answer.certain), answer.triangle, bitcast<u32>(answer.t)',
];

async function openDevice() {
  let gpu = globalThis.navigator?.gpu;
  if (!globalThis.Deno) {
    const { create, globals } = await import('webgpu');
    Object.assign(globalThis, globals);
    gpu = globalThis.gpu = create([]); // kept: Dawn ends with it
  }
  const adapter = await gpu?.requestAdapter();
  if (!adapter) throw new Error('WebGPU has no device');
  return { device: await adapter.requestDevice(), name: adapter.info.description || adapter.info.device };
}

/** Words that a layer's inputs take: the largest of the objects, found by their headers' first two words. */
function networkWords(words) {
  let most = 1;
  for (let i = 0; i + 21 < words.length; ++i)
    if (words[i] === 0x5346494e && words[i + 20] <= 4) most = Math.max(most, words[i + 21]);
  return most;
}

/** The text as a module; throws if it does not compile. */
async function compiled(device, textFile, code) {
  const module = device.createShaderModule({ code });
  const { messages } = await module.getCompilationInfo();
  for (const { type, lineNum, message } of messages) if (type === 'error') throw new Error(`${textFile}:${lineNum}: ${message}`);
  return module;
}

async function main([textFile, caseFile]) {
  if (!caseFile) return void (await compiled((await openDevice()).device, textFile, readFileSync(textFile, 'utf8')));
  const bytes = readFileSync(caseFile);
  const all = new Uint32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
  const [magic, scene, wordCount, count, triangles, hits] = all;
  if (magic !== 0x4353494e || all.length !== 8 + wordCount + 11 * count) throw new Error(`${caseFile} is not a case`);
  const words = all.subarray(8, 8 + wordCount), rays = all.subarray(8 + wordCount, 8 + wordCount + 8 * count);
  const expected = all.subarray(8 + wordCount + 8 * count);
  const text = readFileSync(textFile, 'utf8');
  const most = 'const NIF_NETWORK_WORDS : u32 = 12u;';
  if (text.includes('nif_evaluate') && !text.includes(most)) throw new Error(`${textFile} has no line '${most}'`);
  const enough = `const NIF_NETWORK_WORDS : u32 = ${Math.max(12, networkWords(words))}u;`;
  const proves = 'NIF_PROVES : bool = ', own = `${proves}false;`;
  const main = kMain.replace('QUERY', kQueries[hits][scene]).replace('FOUND', kFound[hits]);
  const code = text.replace(most, enough).replace(own, triangles ? `${proves}true;` : own) + main;

  const { device, name } = await openDevice();
  const module = await compiled(device, textFile, code);
  device.pushErrorScope('validation');
  const pipeline = await device.createComputePipelineAsync({ layout: 'auto', compute: { module, entryPoint: 'main' } });
  const make = (size, usage) => device.createBuffer({ size, usage });
  const room = 16 * Math.min(count, kMostRays);
  const buffers = [
    make(words.byteLength, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST),
    make(2 * room, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST),
    make(room, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC),
  ];
  const read = make(room, GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST);
  device.queue.writeBuffer(buffers[0], 0, words);
  const entries = buffers.map((buffer, binding) => ({ binding, resource: { buffer } }));
  const group = device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries });
  const answers = new Uint32Array(4 * count);
  for (let first = 0; first < count; first += kMostRays) {
    const some = Math.min(count - first, kMostRays);
    device.queue.writeBuffer(buffers[1], 0, rays.subarray(8 * first, 8 * (first + some)));
    const commands = device.createCommandEncoder(), pass = commands.beginComputePass();
    pass.setPipeline(pipeline);
    pass.setBindGroup(0, group);
    pass.dispatchWorkgroups(Math.ceil(some / 64));
    pass.end();
    commands.copyBufferToBuffer(buffers[2], 0, read, 0, 16 * some);
    device.queue.submit([commands.finish()]);
    await read.mapAsync(GPUMapMode.READ);
    answers.set(new Uint32Array(read.getMappedRange(0, 16 * some)), 4 * first);
    read.unmap();
  }
  const error = await device.popErrorScope();
  if (error) throw new Error(error.message);

  const t = [new Float32Array(expected.buffer, expected.byteOffset, expected.length), new Float32Array(answers.buffer)];
  let differs = 0, certain = 0, wrong = 0, logit = 0;
  for (let i = 0; i < count; ++i) {
    const [found, isCertain, number] = answers.subarray(4 * i, 4 * i + 3), cpu = expected.subarray(3 * i, 3 * i + 3);
    const near = !hits || !found || Math.abs(t[0][3 * i + 2] - t[1][4 * i + 3]) <= 1e-3 * Math.max(Math.abs(t[0][3 * i + 2]), 1e-3);
    const other = found !== (cpu[0] & 1) || (hits && found && (number !== cpu[1] || !near));
    differs += other;
    certain += isCertain;
    wrong += isCertain && other;
    logit += !hits && number !== cpu[1];
  }
  const kind = triangles ? 'triangles' : 'planes';
  console.log(`${kind} ${basename(caseFile, '.case')} ${count} ${differs} ${certain} ${wrong} ${logit} ${name}`);
}

try {
  await main(process.argv.slice(2));
  process.exit(0); // Dawn's threads would keep node from ending
} catch (error) {
  console.error(`answer.mjs: ${error?.message ?? error}`);
  process.exit(1);
}
