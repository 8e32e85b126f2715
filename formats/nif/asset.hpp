// An asset as the baker makes it: everything that a .nif file holds, in memory that it owns.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/nif/bvh/source_triangles.hpp"
#include "formats/nif/encodings.hpp"
#include "formats/nif/proof/colors.hpp"
#include "formats/nif/spherical/primary.hpp"

namespace nif::format {

struct Object {
  std::string name;
  std::array<float, 3> aabb_min{}, aabb_max{};
  float bias = 0;
  uint32_t triangles = 0;
  AnyData content;                 ///< what answers it, in one of the encodings
  std::optional<Primary> primary;  ///< of any encoding
  /// Of encodings with a BVH; without it, triangles are known by their place in the object.
  std::optional<SourceTriangles> source_triangles;
  std::optional<Colors> colors;  ///< of encodings with a grid

  Bounds bounds() const { return {aabb_min, aabb_max}; }
  /// The content, which must be of this encoding: as<SegmentData>(), as<Bvh>() ...
  template <class Data>
  Data& as() {
    return std::get<Data>(content);
  }
  template <class Data>
  const Data& as() const {
    return std::get<Data>(content);
  }
  template <class Data>
  bool is() const {
    return std::holds_alternative<Data>(content);
  }
};

struct Instance {
  std::string name;
  uint32_t object = 0;
  std::array<float, 12> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< object to world, row-major 3x4
  std::array<float, 3> remainder{};  ///< what rounding took from its translation
};

/// With what its objects share: `networks`, `spherical_networks`.
struct Asset : Shared {
  std::vector<Object> objects;
  std::vector<Instance> instances;  ///< none: each object is placed once, unless the asset places nothing
  bool places_nothing = false;      ///< only without instances
  std::string metadata;             ///< JSON
};

/// The kernels' view of an object; valid while the asset lives and is not changed. The bounds of a
/// `spherical` object must be such as kernels::set_bounds() takes.
kernels::AnyField field_of(const Asset& asset, const Object& object);

}  // namespace nif::format
