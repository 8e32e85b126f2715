// Answers a case of shader_cases by nif.wgsl in WebGPU, and counts the answers that are not the CPU's.
//
//   node answer.mjs NIF.wgsl FILE.case    with Dawn, from npm's webgpu
//   deno run -A answer.mjs NIF.wgsl FILE.case    with wgpu and naga
//
// Prints one line: the case, its rays, those whose visibility differs, those that the shader calls certain, those whose logit
// differs, and the device. Ends with 1 and a sentence if there is no device, or the text does not compile.
import { readFileSync } from 'node:fs';
import { basename } from 'node:path';
import process from 'node:process';

const kMain = `
@group(0) @binding(1) var<storage, read> rays : array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> answers : array<vec2<u32>>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id : vec3<u32>) {
  let i = id.x;
  if (i >= arrayLength(&answers)) {
    return;
  }
  let start = rays[2u * i];
  let way = rays[2u * i + 1u];
  let answer = QUERY;
  answers[i] = vec2<u32>(select(0u, 1u, answer.visible) | select(0u, 2u, answer.certain), bitcast<u32>(answer.logit));
}`;
const kQueries = [
  'nif_query(0u, start.xyz, way.xyz, start.w, way.w)',
  'nif_query_scene(0u, start.xyz, way.xyz, start.w, way.w, 0xffffffffu)',
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

async function main([textFile, caseFile]) {
  const bytes = readFileSync(caseFile);
  const all = new Uint32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
  const [magic, scene, wordCount, count] = all;
  if (magic !== 0x4353494e || all.length !== 8 + wordCount + 10 * count) throw new Error(`${caseFile} is not a case`);
  const words = all.subarray(8, 8 + wordCount), rays = all.subarray(8 + wordCount, 8 + wordCount + 8 * count);
  const expected = all.subarray(8 + wordCount + 8 * count);
  const text = readFileSync(textFile, 'utf8');
  const room = 'const NIF_NETWORK_WORDS : u32 = 12u;';
  if (!text.includes(room)) throw new Error(`${textFile} has no line '${room}'`);
  const enough = `const NIF_NETWORK_WORDS : u32 = ${Math.max(12, networkWords(words))}u;`;
  const code = text.replace(room, enough) + kMain.replace('QUERY', kQueries[scene]);

  const { device, name } = await openDevice();
  const module = device.createShaderModule({ code });
  const { messages } = await module.getCompilationInfo();
  for (const { type, lineNum, message } of messages) if (type === 'error') throw new Error(`${textFile}:${lineNum}: ${message}`);
  device.pushErrorScope('validation');
  const pipeline = await device.createComputePipelineAsync({ layout: 'auto', compute: { module, entryPoint: 'main' } });
  const input = (data) => {
    const buffer = device.createBuffer({ size: data.byteLength, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
    device.queue.writeBuffer(buffer, 0, data);
    return buffer;
  };
  const size = 8 * count;
  const output = device.createBuffer({ size, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC });
  const read = device.createBuffer({ size, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
  const entries = [input(words), input(rays), output].map((buffer, binding) => ({ binding, resource: { buffer } }));
  const commands = device.createCommandEncoder(), pass = commands.beginComputePass();
  pass.setPipeline(pipeline);
  pass.setBindGroup(0, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
  pass.dispatchWorkgroups(Math.ceil(count / 64));
  pass.end();
  commands.copyBufferToBuffer(output, 0, read, 0, size);
  device.queue.submit([commands.finish()]);
  await read.mapAsync(GPUMapMode.READ);
  const answers = new Uint32Array(read.getMappedRange().slice(0));
  const error = await device.popErrorScope();
  if (error) throw new Error(error.message);

  let visible = 0, certain = 0, logit = 0;
  for (let i = 0; i < count; ++i) {
    visible += (answers[2 * i] ^ expected[2 * i]) & 1;
    certain += answers[2 * i] >> 1;
    logit += answers[2 * i + 1] !== expected[2 * i + 1];
  }
  console.log(`${basename(caseFile, '.case')} ${count} ${visible} ${certain} ${logit} ${name}`);
}

try {
  await main(process.argv.slice(2));
  process.exit(0); // Dawn's threads would keep node from ending
} catch (error) {
  console.error(`answer.mjs: ${error?.message ?? error}`);
  process.exit(1);
}
