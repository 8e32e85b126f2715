// Decides in exact arithmetic where a ray meets a mesh, and says of an answer what is wrong with it. It
// shares no code with what it judges.
//
// Signs are exact: in double precision with a bound of its error, else in whole numbers of GMP's. Distances
// are worked out with 113 bits, 2^60 times finer than the tolerances that they are compared with.
#pragma once

#include <nif/nif.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::test {

/// A number with 113 bits.
#ifdef __SIZEOF_FLOAT128__
using Quad = __float128;
#else
using Quad = long double;
#endif

inline constexpr float kEndless = std::numeric_limits<float>::infinity();

struct Quad3 {
  Quad x, y, z;
};

/// Where an exact line meets a triangle.
struct Meeting {
  uint32_t triangle;
  Quad t;
  Quad height, rate;  ///< of the origin above the triangle's plane, and its change with t
  /// The triangle is seen wide enough, and hit far enough from its edges, that no answer may miss it.
  bool sure;
};

/// An answer may belong to a ray moved by less than `aside`; all of it must be true for such a ray.
struct Look {
  Quad3 origin, direction;
  float tmin, tmax;
  Quad aside;
  std::vector<Meeting> meetings;
};

class Judge {
 public:
  /// Copies its arguments.
  Judge(const mesh::Mesh& mesh, bool closed);

  /// The largest magnitude of a coordinate.
  float extent() const { return extent_; }

  /// For a valid, untransformed ray. Answers may be off by 2^-40 of the largest coordinate of origin and mesh
  /// (docs/encodings/bvh.md).
  Look look(const NifRay& ray) const;
  /// For a ray through an object-to-world transform. Answers may be off by `aside` in object space, or by as
  /// much as above if that is more. `remainder` is added to the translation.
  Look look(const NifRay& ray, const std::array<float, 12>& transform, double aside,
            const std::array<float, 3>& remainder = {}) const;

  /// Whether the ray starts inside the mesh, farther than `aside` from its surface. Only for closed meshes.
  bool starts_inside(const Look& look) const;

  // Each returns what is wrong, or an empty text.
  std::string visible(const Look& look) const;   ///< nothing is met
  std::string occluded(const Look& look) const;  ///< something is
  /// Something is met at t, within a float's accuracy, and nothing before.
  std::string first_hit(const Look& look, float t, const mesh::Float3 corners[3]) const;
  /// Nothing is met before `low`.
  std::string nothing_before(const Look& look, float low) const;
  /// Something is met at `high` or before.
  std::string something_until(const Look& look, float high) const;
  /// Nothing is met before `begin` or after `end`.
  std::string only_between(const Look& look, float begin, float end) const;

 private:
  struct Corners {
    double at[3][3];
    Quad3 normal;                              ///< of unit length; 0 if the triangle has no area
    double area = 0, centre[3]{}, radius = 0;  ///< `area` is twice the area
  };
  Quad rounding(const Look& look) const;
  void meet(Look& look, bool exact, const NifRay& ray) const;
  bool sure_within(const Look& look, const Meeting& meeting, float from, float to) const;
  const Meeting* first_sure(const Look& look, float from, float to) const;
  Quad distance(const Look& look, Quad from, Quad to, const Corners& triangle) const;
  bool near_any(const Look& look, Quad from, Quad to) const;
  Quad end_of(const Look& look, float t) const;

  std::vector<Corners> triangles_;
  float extent_ = 0;
  bool closed_;
};

/// The ray as text with hexadecimal floats, as in docs and tests.
std::string in_hex(const NifRay& ray);

}  // namespace nif::test
