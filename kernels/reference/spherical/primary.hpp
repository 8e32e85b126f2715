// Answers a primary ray of one object with a network over the coordinates of `spherical`: hit or miss, where,
// and the surface's normal there (docs/encodings/spherical.md).
//
// Single precision in the order written, as in kernels/reference/spherical/spherical_query.hpp: the same bits
// everywhere.
#pragma once

#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::kernels {

struct PrimaryAnswer {
  bool hit;
  float t;          ///< of the hit, on the ray; 0 if there is none
  float start;      ///< where secondary rays start: the margin before t
  float normal[3];  ///< unit length, object space; 0 if there is no hit
};

/// The first hit of the ray with the object, in object space. The network gets the point where the ray enters
/// the AABB (or its start, if that lies within) and its direction. A hit beyond tmax does not count.
inline PrimaryAnswer query_primary(const PrimaryField& field, const Segment& segment) {
  PrimaryAnswer answer{};
  const SphericalRay ray = prepare_spherical(field, segment);
  if (ray.kind == SphericalKind::none) return answer;
  float inputs[kMaxSphericalInputs], outputs[kPrimaryOutputs];
  look_up_angles(field.position, ray.at.position_theta, ray.at.position_phi,
                 [&](uint32_t f, float value) { inputs[f] = value; });
  look_up_angles(field.direction, ray.at.direction_theta, ray.at.direction_phi,
                 [&](uint32_t f, float value) { inputs[field.position.features + f] = value; });
  evaluate_spherical(field.network, field.slope, inputs, outputs);
  if (!(outputs[0] >= 0)) return answer;
  const auto length = [](const float v[3]) { return std::sqrt((v[0] * v[0] + v[1] * v[1]) + v[2] * v[2]); };
  const float *d = segment.direction, speed = length(d), diagonal = 2 / field.distance_scale;
  const float depth = max_of(min_of(outputs[1], 1), 0) * diagonal;
  const float t = ray.enter + depth / speed;
  if (!(t <= segment.tmax)) return answer;
  float normal[3];
  for (int a = 0; a < 3; ++a) normal[a] = bounded_output(outputs[2 + a]);
  const float size = length(normal);
  answer.hit = true;
  answer.t = t;
  answer.start = max_of(t - field.margin * diagonal / speed, ray.enter);
  // If the network gives no usable normal, the surface faces the ray.
  constexpr float kShortest = 0x1p-40f;
  for (int a = 0; a < 3; ++a) answer.normal[a] = size >= kShortest ? normal[a] / size : -d[a] / speed;
  return answer;
}

}  // namespace nif::kernels
