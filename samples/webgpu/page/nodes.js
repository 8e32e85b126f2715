// A .nif object in three.js: nodes for the materials of WebGPURenderer. The sun's shadow replaces a shadow map, and the sky's
// occlusion is a material's aoNode.
import { StorageBufferAttribute } from './three/three.webgpu.js';
import { normalWorldGeometry, positionWorld, screenCoordinate, storage, uniform, wgsl, wgslFn } from './three/three.tsl.js';

const kText = `
var<private> nifState : u32;
fn nifRandom() -> f32 {
  nifState = nifState * 747796405u + 2891336453u;
  let word = ((nifState >> ((nifState >> 28u) + 4u)) ^ nifState) * 277803737u;
  return f32(((word >> 22u) ^ word) >> 8u) * 5.9604644775390625e-8;
}
fn nifSeed(pixel : vec2<f32>, frame : u32, salt : u32) {
  nifState = (u32(pixel.x) * 1973u + u32(pixel.y) * 9277u + frame * 26699u + salt) | 1u;
  nifState ^= nifState >> 13u;
  nifState *= 2246822519u;
  nifState ^= nifState >> 16u;
  let first = nifRandom();
}
// A point of the unit sphere.
fn nifSphere() -> vec3<f32> {
  let z = 2.0 * nifRandom() - 1.0;
  let angle = 6.2831853 * nifRandom();
  let r = sqrt(max(0.0, 1.0 - z * z));
  return vec3<f32>(r * cos(angle), r * sin(angle), z);
}
`;

// Whether a point sees the sun, whose disc has this radius at distance 1. Three.js itself darkens what faces away.
const kSun = `
fn nifSun(words : ptr<storage, array<u32>, read>, point : vec3<f32>, normal : vec3<f32>, sun : vec3<f32>, radius : f32, bias : f32,
          pixel : vec2<f32>, frame : u32) -> f32 {
  nifSeed(pixel, frame, 1u);
  let ball = nifSphere();
  let off = ball - dot(ball, sun) * sun;  // in the disc's plane, but not yet even
  let direction = sun + (radius * sqrt(nifRandom()) / max(length(off), 1e-6)) * off;
  if (dot(direction, normal) <= 0.0 || direction.y <= 0.0) {
    return 0.0;
  }
  return select(0.0, 1.0, nif_query(0u, point + bias * normal, direction, 0.0, 1.0e30).visible);
}
`;

// How much of the sky a point sees, from some rays. The ground hides what is below the horizon.
const kSky = `
fn nifSky(words : ptr<storage, array<u32>, read>, point : vec3<f32>, normal : vec3<f32>, rays : u32, bias : f32, pixel : vec2<f32>,
          frame : u32) -> f32 {
  nifSeed(pixel, frame, 2u);
  var seen = 0.0;
  for (var k = 0u; k < rays; k++) {
    let direction = normal + nifSphere();  // distributed by the cosine
    if (direction.y > 0.0 && nif_query(0u, point + bias * normal, direction, 0.0, 1.0e30).visible) {
      seen += 1.0;
    }
  }
  return seen / f32(rays);
}
`;

/**
 * { shadow, occlusion, sun, sunRadius, skyRays, frame }: give `shadow` to a light as light.shadow.shadowNode, and `occlusion` to
 * materials as aoNode. The others are uniforms. The object is where its asset has it: words are in object space.
 */
export function makeNodes(object, sunDirection) {
  const words = storage(new StorageBufferAttribute(object.words, 1), 'uint', object.words.length).toReadOnly().setName('nifWords');
  const text = wgsl(object.textReading('nifWords.value[i]') + kText);
  const sun = uniform(sunDirection), sunRadius = uniform(0), bias = uniform(object.bias);
  const skyRays = uniform(2, 'uint'), frame = uniform(0, 'uint');
  const common = { words, point: positionWorld, normal: normalWorldGeometry, bias, pixel: screenCoordinate.xy, frame };
  return {
    shadow: wgslFn(kSun, [text])({ ...common, sun, radius: sunRadius }),
    occlusion: wgslFn(kSky, [text])({ ...common, rays: skyRays }),
    sun, sunRadius, skyRays, frame,
  };
}
