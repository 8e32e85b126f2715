// Combines the first hits of several instances into one, independent of their order, and computes the normal
// in world space.
#pragma once

#include "kernels/reference/hit.hpp"
#include "kernels/reference/instance.hpp"

namespace nif::kernels {

inline constexpr uint32_t kNoInstance = 0xffffffff;

/// One ray's hits so far.
struct SceneHit : Hit {
  uint32_t instance = kNoInstance;

  /// Starts with: nothing is met, for certain.
  NIF_HOST_DEVICE SceneHit() { low = kNoHit; }

  /// Keeps the hit with the least t; of several equal ones, the one in the first instance. Bounds of -0 become 0,
  /// or their sign would depend on the order.
  NIF_HOST_DEVICE NIF_INLINE void add(const Hit& hit, uint32_t in) {
    const float least = min_of(hit.low, low) + 0.0f, most = min_of(hit.high, high) + 0.0f;
    if (hit.t < t || (hit.t == t && in < instance && hit.t < kNoHit)) {
      static_cast<Hit&>(*this) = hit;
      instance = in;
    }
    low = least;
    high = most;
  }
};

/// Drops the proofs that do not survive an instance's transform.
NIF_HOST_DEVICE inline void forget_proof(Hit& hit) { hit.low = -kNoHit, hit.high = kNoHit; }

/// Nothing of an instance is met before its box, which the ray enters at `enter`. So an instance whose box
/// begins beyond a proven hit changes nothing and can be skipped. If the box begins farther away than a float
/// can say, nothing is proven about it.
NIF_HOST_DEVICE inline void begin_in_box(Hit& hit, float enter) {
  if (!(enter < kMostT)) return;
  hit.low = max_of(hit.low, enter);
  if (hit.t < kNoHit) hit.t = max_of(hit.t, enter);
}

/// Turns a hit's normal in object space into one in world space, of unit length, on the side that the ray
/// comes from. If the normal is 0, the result is the direction towards the ray's origin. `transform`: null
/// for the identity.
NIF_HOST_DEVICE inline void world_normal(const WorldToObject* transform, const float (&normal)[3],
                                         const float (&direction)[3], float (&result)[3]) {
  double n[3], square = 0, along = 0;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    // Normals transform by the transpose of the inverse.
    n[a] = !transform ? double(normal[a])
                      : (double(transform->inverse[a]) * double(normal[0]) +
                         double(transform->inverse[3 + a]) * double(normal[1])) +
                            double(transform->inverse[6 + a]) * double(normal[2]);
    square += n[a] * n[a];
  }
  if (!(square > 0)) {
    square = 0;
    NIF_UNROLL
    for (int a = 0; a < 3; ++a) {
      n[a] = -double(direction[a]);
      square += n[a] * n[a];
    }
  }
  const double length = square_root(square);
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) along += n[a] * double(direction[a]);
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) result[a] = static_cast<float>((along > 0 ? -n[a] : n[a]) / length);
}

}  // namespace nif::kernels
