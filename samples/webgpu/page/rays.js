// WGSL for any engine: shadows of the sun and occlusion of the sky, by rays from a point that a material draws. What answers them
// is a function that the text in front of this one has: `fn nifVisible(origin : vec3<f32>, direction : vec3<f32>) -> bool`.

/** nifVisible by an asset: append it to an object's text (nif.js). The point and the direction are in the object's space. */
export const kVisible = `
fn nifVisible(origin : vec3<f32>, direction : vec3<f32>) -> bool {
  return nif_query(0u, origin, direction, 0.0, 1.0e30).visible;
}
`;

export const kRays = `
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
// Whether a point sees the sun, whose disc has this radius at distance 1. The engine itself darkens what faces away.
fn nifSun(point : vec3<f32>, normal : vec3<f32>, sun : vec3<f32>, radius : f32, bias : f32, pixel : vec2<f32>, frame : u32) -> f32 {
  nifSeed(pixel, frame, 1u);
  let ball = nifSphere();
  let off = ball - dot(ball, sun) * sun;  // in the disc's plane, but not yet even
  let direction = sun + (radius * sqrt(nifRandom()) / max(length(off), 1e-6)) * off;
  if (dot(direction, normal) <= 0.0 || direction.y <= 0.0) {
    return 0.0;
  }
  return select(0.0, 1.0, nifVisible(point + bias * normal, direction));
}
// How much of the sky a point sees, from some rays. The ground hides what is below the horizon.
fn nifSky(point : vec3<f32>, normal : vec3<f32>, rays : u32, bias : f32, pixel : vec2<f32>, frame : u32) -> f32 {
  nifSeed(pixel, frame, 2u);
  var seen = 0.0;
  for (var k = 0u; k < rays; k++) {
    let direction = normal + nifSphere();  // distributed by the cosine
    if (direction.y > 0.0 && nifVisible(point + bias * normal, direction)) {
      seen += 1.0;
    }
  }
  return seen / f32(rays);
}
`;
