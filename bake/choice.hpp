// What encodings cost for an object, and when "auto" takes exact ones if no option decides.
//
// The choice weighs bytes, triangles and counted work. Nothing is timed, so that a bake's bytes do not depend
// on the machine; docs/results/work.md measures how well counted work predicts times.
#pragma once

#include <cstdint>

namespace nif::bake {

/// What kind of answers an encoding gives.
enum class AnswerKind {
  exact,    ///< never wrong
  learned,  ///< after training; wrong for some rays
  open      ///< never wrong, but some rays get no answer
};

/// What decides between the exact encodings of an object. Without a preference, "auto" takes the one with less
/// work that takes no more memory than kEmbreeBytesPerTriangle, and planes only from kLeastForPlanes on.
enum class Preference {
  speed,  ///< the least counted work, whatever memory it takes
  bytes   ///< the smallest: no planes
};

/// The cost of an encoding for an object.
struct EncodingCost {
  uint64_t bytes = 0;     ///< in a file
  uint64_t resident = 0;  ///< in memory; only for exact forms
  double work = 0;        ///< per ray, in nanoseconds on the machine that the weights were measured on
};

/// Objects with this many triangles are learned.
inline constexpr uint64_t kMostExactTriangles = 200'000;

/// With fewer triangles "auto" takes a BVH without planes, unless it has a preference: it fits in a processor's
/// cache, such objects often are very many, and each gets few rays at a time.
inline constexpr uint64_t kLeastForPlanes = 10'000;

/// The least that a compact BVH of Embree takes on the meshes of docs/results/exact.md, without the vertices
/// and indices that it also needs. Embree's own count depends on the machine and on threads, and so would the
/// choice.
inline constexpr uint64_t kEmbreeBytesPerTriangle = 34;

}  // namespace nif::bake
