// Answers one query of one `spherical` object: where the ray meets the AABB, spherical coordinates, latent
// vectors, network.
//
// Everything is IEEE single precision in the order written, without contraction, so that a kernel with one
// ray per lane gets the same bits.
#pragma once

#include "kernels/reference/half.hpp"
#include "kernels/reference/hit.hpp"
#include "kernels/reference/ray.hpp"
#include "kernels/reference/spherical/spherical_field.hpp"

namespace nif::kernels {

/// Which of an object's two networks a ray uses.
enum class SphericalKind : uint8_t {
  none,   ///< the ray is invalid or misses the AABB: visible
  outer,  ///< origin + tmin direction lies outside of the AABB, which is entered later
  inner,  ///< the point lies inside
};

/// Where a ray looks up its latent vectors. Angles are 0 to 1, theta over [0, pi] from the z axis and phi
/// over [-pi, pi] about it: of the point where the ray starts to count, as seen from the AABB's centre, and
/// of the direction. Inner rays also use that point's distance from the centre, 0 to 1 at the AABB's corners.
struct SphericalCoordinates {
  float position_theta, position_phi;
  float direction_theta, direction_phi;
  float distance;
};

struct SphericalRay {
  SphericalKind kind;
  bool certain;  ///< if the kind is none
  float enter;   ///< the ray's t where it starts to count: its entry into the AABB, or tmin within it
  SphericalCoordinates at;
};

inline constexpr float kPi = 3.14159274f, kHalfPi = 1.57079637f;
inline constexpr float kPerPi = 0.318309886f, kPerTwoPi = 0.159154943f;
/// Coefficient of x^(2 i), i = 0 to 8, of the polynomial for atan x / x in x^2 (Abramowitz and Stegun
/// 4.4.49), which is off by at most 2e-8.
NIF_HOST_DEVICE constexpr float atan_coefficient(int i) {
  constexpr float kCoefficients[] = {1.0f,          -.3333314528f, .1999355085f,  -.1420889944f, .1065626393f,
                                     -.0752896400f, .0429096138f,  -.0161657367f, .0028662257f};
  return kCoefficients[i];
}

/// The angle of (x, y), -pi to pi; 0 at the origin. The numbers and their squares must be finite.
NIF_HOST_DEVICE inline float angle_of(float y, float x) {
  const float ax = magnitude(x), ay = magnitude(y);
  const float large = max_of(ax, ay), small = min_of(ax, ay);
  const float ratio = large > 0 ? small / large : 0;
  const float square = ratio * ratio;
  float sum = atan_coefficient(8);
  NIF_UNROLL
  for (int i = 7; i >= 0; --i) sum = sum * square + atan_coefficient(i);
  float angle = sum * ratio;
  if (ay > ax) angle = kHalfPi - angle;
  if (x < 0) angle = kPi - angle;
  return y < 0 ? -angle : angle;
}

NIF_HOST_DEVICE inline void to_angles(const float v[3], float& theta, float& phi) {
  const float across = square_root(v[0] * v[0] + v[1] * v[1]);
  theta = angle_of(across, v[2]) * kPerPi;
  phi = angle_of(v[1], v[0]) * kPerTwoPi + 0.5f;
}

/// Tells what becomes of a segment. As with `bvh` objects (kernels/reference/triangles/triangles_query.hpp)
/// the AABB's planes are seen from a little nearer on the way in and from a little farther on the way out,
/// which outweighs all rounding.
NIF_HOST_DEVICE inline SphericalRay prepare_spherical(const SphericalBounds& bounds, const Segment& segment) {
  constexpr float kPadding = 0x1p-20f, kFlattest = 0x1p-30f;
  const float *o = segment.origin, *d = segment.direction;
  SphericalRay ray{SphericalKind::none, segment.tmin > segment.tmax, segment.tmin, {}};
  float reach = bounds.extent, steepest = 0;
  bool finite = true, inside = true;
  float start[3];
  for (int a = 0; a < 3; ++a) {
    finite = finite && is_finite(o[a]) && is_finite(d[a]);
    reach = max_of(magnitude(o[a]), reach);
    steepest = max_of(magnitude(d[a]), steepest);
    start[a] = o[a] + segment.tmin * d[a];
    inside = inside && start[a] >= bounds.low[a] && start[a] <= bounds.high[a];
  }
  if (!finite || !(reach <= kMaxSphericalCoordinate) || !(steepest >= kMinDirection) ||
      !(steepest <= kMaxDirection) || !(segment.tmin <= segment.tmax))
    return ray;

  if (inside) {
    ray.kind = SphericalKind::inner;
  } else {
    const float padding = reach * kPadding + bounds.margin, flattest = steepest * kFlattest;
    const float farthest = 8 * reach / steepest;
    float enter = max_of(segment.tmin, -farthest), leave = min_of(segment.tmax, farthest);
    for (int a = 0; a < 3; ++a) {
      const bool negative = d[a] < 0;
      const float outward = negative ? -padding : padding, size = max_of(magnitude(d[a]), flattest);
      const float inverse = 1.0f / (negative ? -size : size);
      enter = max_of(((negative ? bounds.high[a] : bounds.low[a]) - (o[a] + outward)) * inverse, enter);
      leave = min_of(((negative ? bounds.low[a] : bounds.high[a]) - (o[a] - outward)) * inverse, leave);
    }
    if (!(enter <= leave)) {
      ray.certain = reach * bounds.reach_scale <= kCertainReach;
      return ray;
    }
    ray.kind = SphericalKind::outer;
    ray.enter = enter;
    for (int a = 0; a < 3; ++a) start[a] = min_of(max_of(o[a] + enter * d[a], bounds.low[a]), bounds.high[a]);
  }
  for (int a = 0; a < 3; ++a) start[a] = start[a] - bounds.centre[a];
  to_angles(start, ray.at.position_theta, ray.at.position_phi);
  to_angles(d, ray.at.direction_theta, ray.at.direction_phi);
  const float square = (start[0] * start[0] + start[1] * start[1]) + start[2] * start[2];
  ray.at.distance = square_root(square) * bounds.distance_scale;
  return ray;
}

/// Where a coordinate lies between two entries of a grid.
struct SphericalCell {
  uint32_t low, high;
  float fraction;  ///< 0 to 1 from the first to the second
};
/// Phi is periodic: the first entry follows the last.
NIF_HOST_DEVICE inline SphericalCell around(float phi, uint32_t resolution) {
  const float top = static_cast<float>(resolution), x = min_of(max_of(phi * top, 0), top);
  const uint32_t low = uint32_t(to_index(x, int32_t(resolution) - 1));
  return {low, low + 1 == resolution ? 0 : low + 1, x - static_cast<float>(low)};
}
/// Theta and distances have ends: the first entry is at 0, the last one at 1.
NIF_HOST_DEVICE inline SphericalCell along(float at, uint32_t resolution) {
  const float top = static_cast<float>(resolution - 1), x = min_of(max_of(at * top, 0), top);
  const uint32_t low = uint32_t(to_index(x, int32_t(resolution) - 2));
  return {low, low + 1, x - static_cast<float>(low)};
}

NIF_HOST_DEVICE inline float value_of(const SphericalValues& values, size_t i) {
  return values.half ? from_half(static_cast<const uint16_t*>(values.data)[i])
                     : static_cast<const float*>(values.data)[i];
}

/// Bilinear; calls put(feature, value) for each feature.
template <class Put>
NIF_HOST_DEVICE void look_up_angles(const SphericalGrid& grid, float theta, float phi, const Put& put) {
  const SphericalCell row = along(theta, grid.resolution), column = around(phi, grid.resolution);
  for (uint32_t f = 0; f < grid.features; ++f) {
    const auto at = [&](uint32_t r, uint32_t c) {
      return value_of(grid.values, (size_t(r) * grid.resolution + c) * grid.features + f);
    };
    const float a = at(row.low, column.low), b = at(row.high, column.low);
    const float upper = a + column.fraction * (at(row.low, column.high) - a);
    const float lower = b + column.fraction * (at(row.high, column.high) - b);
    put(f, upper + row.fraction * (lower - upper));
  }
}

/// Linear; likewise.
template <class Put>
NIF_HOST_DEVICE void look_up_distance(const SphericalGrid& grid, float distance, const Put& put) {
  const SphericalCell cell = along(distance, grid.resolution);
  for (uint32_t f = 0; f < grid.features; ++f) {
    const float a = value_of(grid.values, size_t(cell.low) * grid.features + f);
    put(f, a + cell.fraction * (value_of(grid.values, size_t(cell.high) * grid.features + f) - a));
  }
}

/// The inputs of a ray whose kind is not none, in the network's order: calls put(input, value) for each.
template <class Put>
NIF_HOST_DEVICE void look_up_inputs(const SphericalField& field, const SphericalRay& ray, const Put& put) {
  const auto look_up_both = [&](const SphericalGrid& position, const SphericalGrid& direction) {
    look_up_angles(position, ray.at.position_theta, ray.at.position_phi, put);
    look_up_angles(direction, ray.at.direction_theta, ray.at.direction_phi,
                   [&](uint32_t f, float value) { put(position.features + f, value); });
  };
  // Branches rather than selecting a reference: for that, compilers for AMD copy both grids.
  if (ray.kind == SphericalKind::outer) {
    look_up_both(field.outer_position, field.outer_direction);
  } else {
    look_up_both(field.inner_position, field.inner_direction);
    look_up_distance(field.distance, ray.at.distance,
                     [&](uint32_t f, float value) { put(2 * field.inner_position.features + f, value); });
  }
}

/// `results` receives [network.outputs].
NIF_HOST_DEVICE inline void evaluate_spherical(const SphericalNetwork& network, float slope,
                                               const float* inputs, float* results) {
  float buffers[2][kMaxSphericalWidth];
  const float* x = inputs;
  uint32_t width = network.inputs;
  size_t at = 0;
  for (uint32_t l = 0;; ++l) {
    const bool last = l == network.hidden_layers;
    const uint32_t outputs = last ? network.outputs : network.width;
    float* y = last ? results : buffers[l & 1];
    for (uint32_t o = 0; o < outputs; ++o) y[o] = 0;
    for (uint32_t i = 0; i < width; ++i, at += outputs) {
      if (network.weights.half) {
        for (uint32_t o = 0; o < outputs; ++o) y[o] = y[o] + value_of(network.weights, at + o) * x[i];
      } else {
        const float* weights = static_cast<const float*>(network.weights.data) + at;
        for (uint32_t o = 0; o < outputs; ++o) y[o] = y[o] + weights[o] * x[i];
      }
    }
    if (last) return;
    for (uint32_t o = 0; o < outputs; ++o) y[o] = max_of(y[o], slope * y[o]);
    x = y;
    width = outputs;
  }
}

NIF_HOST_DEVICE inline float bounded_output(float output) {
  return max_of(min_of(output, kMaxSphericalOutput), -kMaxSphericalOutput);
}

/// Occluded exactly if the output is below 0, that is, if the probability of visible is below 1/2.
NIF_HOST_DEVICE inline int32_t spherical_logit(float output) {
  return static_cast<int32_t>(round_down(bounded_output(output) * kSphericalLogitUnit));
}

NIF_HOST_DEVICE inline Answer query(const SphericalField& field, const Segment& segment) {
  const SphericalRay ray = prepare_spherical(field, segment);
  if (ray.kind == SphericalKind::none) return {true, ray.certain, kCertainLogit};
  const bool outer = ray.kind == SphericalKind::outer;
  float inputs[kMaxSphericalInputs];
  look_up_inputs(field, ray, [&](uint32_t i, float value) { inputs[i] = value; });
  float output = 0;
  evaluate_spherical(outer ? field.outer : field.inner, field.slope, inputs, &output);
  const int32_t logit = spherical_logit(output);
  return {logit >= 0, false, logit};
}

// The first hit of one `spherical` object. Its networks know whether there is one, but not where: t is where
// the segment enters the object's AABB, and there is no normal.

/// The hit of a segment with this answer: a visible one has none.
NIF_HOST_DEVICE inline Hit hit_on_box(const SphericalBounds& bounds, const Segment& segment, bool visible,
                                      bool certain) {
  if (visible) return no_hit(certain);
  Hit hit;
  float enter = max_of(segment.tmin, -kMaxSphericalCoordinate), leave = segment.tmax;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float d = segment.direction[a];
    if (d == 0) continue;
    const float near = ((d < 0 ? bounds.high[a] : bounds.low[a]) - segment.origin[a]) / d;
    if (is_finite(near)) enter = max_of(near, enter);
  }
  hit.t = min_of(enter, leave);
  return hit;
}

inline Hit intersect(const SphericalField& field, const Segment& segment, float = kNoHit) {
  const Answer answer = query(field, segment);
  return hit_on_box(field, segment, answer.visible, answer.certain);
}

}  // namespace nif::kernels
