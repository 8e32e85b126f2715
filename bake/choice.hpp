// What encodings cost an object, and what "auto" makes exact where no wish decides.
//
// The choice weighs bytes, triangles and counted work. Nothing is timed, so that a bake's bytes depend on no
// machine; how well counted work foretells times is measured in docs/results/work.md.
#pragma once

#include <cstdint>

namespace nif::bake {

/// What the answers of an encoding are.
enum class AnswerKind {
  exact,    ///< never wrong
  learned,  ///< after training; wrong for some rays
  open      ///< never wrong, but for some rays there is none
};

/// What an encoding costs an object.
struct EncodingCost {
  uint64_t bytes = 0;     ///< in a file
  uint64_t resident = 0;  ///< in memory; only of exact forms
  double work = 0;        ///< of a ray, in nanoseconds of the machine that the weights were measured on
};

/// With so many triangles objects are learned.
inline constexpr uint64_t kMostExactTriangles = 200'000;

/// With fewer triangles "auto" takes a BVH without planes: it lies in a processor's cache, there are often
/// very many such objects, and few rays at a time are for each.
inline constexpr uint64_t kLeastForPlanes = 10'000;

/// The least that a compact BVH of Embree takes on the meshes of docs/results/exact.md, without the vertices
/// and indices that it needs besides. Embree's own count depends on the machine and on threads, and so would
/// the choice.
inline constexpr uint64_t kEmbreeBytesPerTriangle = 34;

}  // namespace nif::bake
