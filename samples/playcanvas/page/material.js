// A .nif object in PlayCanvas: three chunks of its StandardMaterial. Every directional light is shadowed by the asset, and the
// ambient light, whatever its source, is occluded by it. (Lamps would be shadowed by what is behind them as well.)
import { BUFFERUSAGE_COPY_DST, SHADERLANGUAGE_WGSL, ShaderChunks, StorageBuffer } from './playcanvas.mjs';
import { kRays, kVisible } from './rays.js';

const kDeclarations = `
var<storage, read> nif_words : array<u32>;
uniform nif_bias : f32;
uniform nif_sunRadius : f32;
uniform nif_skyRays : u32;
uniform nif_frame : u32;
`;

// What the engine asks for each light. Rays start along the surface's own normal, which has no normal map.
const kDiffuse = `
fn getLightDiffuse(worldNormal : vec3f, viewDir : vec3f, lightDirNorm : vec3f) -> f32 {
  let cosine = dot(worldNormal, -lightDirNorm);
  if (cosine <= 0.0) {
    return 0.0;
  }
  return cosine * nifSun(vPositionW, dVertexNormalW, -lightDirNorm, uniform.nif_sunRadius, uniform.nif_bias, pcPosition.xy,
                         uniform.nif_frame);
}
`;

const kAmbient = `
fn addAmbient(worldNormal : vec3f) {
  addUnoccluded(worldNormal);
  dDiffuseLight *= nifSky(vPositionW, dVertexNormalW, uniform.nif_skyRays, uniform.nif_bias, pcPosition.xy, uniform.nif_frame);
}
`;

/**
 * Gives the words of an object, and what rays need, to the shaders of a device: all materials that `light` has changed. Returns
 * set(name, value) for the uniforms sunRadius (the radius of the sun's disc at distance 1), skyRays and frame.
 */
export function bindObject(device, object) {
  const words = new StorageBuffer(device, object.words.byteLength, BUFFERUSAGE_COPY_DST);
  words.write(0, object.words);
  const set = (name, value) => device.scope.resolve(`nif_${name}`).setValue(value);
  set('words', words);
  set('bias', object.bias);
  set('sunRadius', 0);
  set('skyRays', 2);
  set('frame', 0);
  return set;
}

/** Lets an object light a StandardMaterial. The object stands where its asset has it: words are in object space. */
export function light(material, device, object) {
  const engines = ShaderChunks.get(device, SHADERLANGUAGE_WGSL).get('ambientPS');
  const ambient = engines?.replace('fn addAmbient(', 'fn addUnoccluded(');
  if (!ambient || ambient === engines) throw new Error('This PlayCanvas has another ambientPS than material.js knows');
  const chunks = material.getShaderChunks(SHADERLANGUAGE_WGSL);
  chunks.set('litUserDeclarationPS', kDeclarations + object.textReading('nif_words[i]') + kVisible + kRays);
  chunks.set('lightDiffuseLambertPS', kDiffuse);
  chunks.set('ambientPS', ambient + kAmbient);
  material.update();
}
