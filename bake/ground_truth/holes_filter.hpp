// Lets rays pass the holes of triangles: Embree asks a filter about each hit, and goes on if it was in a hole.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "bake/ground_truth/embree_object.hpp"

struct RTCGeometryTy;

namespace nif::bake {

/// How accurately the place where a ray meets a triangle is computed.
enum class HoleTest : uint8_t {
  exact,  ///< in double precision, from the ray and the vertices: the ground truth
  fast,   ///< in single precision, from the weights that Embree found: what renderers do
};

/// Whether a triangle blocks light at a point, given by the weights of its second and third corner: the texel there
/// decides. `map` is that of the holes.
bool blocks(const mesh::TriangleHoles& holes, const mesh::AlphaMap& map,
            const std::array<double, 2>& weights);

/// The filter of one geometry, which answers for any of Embree's calls.
class HolesFilter {
 public:
  /// Null if no triangle has holes, so that such a geometry costs nothing more. Copies holes, shares maps.
  static std::unique_ptr<HolesFilter> make(const EmbreeObject& object, HoleTest test);
  virtual ~HolesFilter() = default;
  HolesFilter(const HolesFilter&) = delete;
  HolesFilter& operator=(const HolesFilter&) = delete;

  /// Takes effect when the geometry is next committed. The geometry must have the object's triangles; its
  /// vertices may have been transformed. The filter must outlive it.
  virtual void attach(RTCGeometryTy* geometry) = 0;
  /// What it holds, including the maps.
  virtual size_t bytes() const = 0;

 protected:
  HolesFilter() = default;
};

}  // namespace nif::bake
