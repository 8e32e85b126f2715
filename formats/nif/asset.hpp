// An asset as the baker makes it: everything that a .nif file holds, in memory that it owns.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/nif/parts.hpp"
#include "formats/nif/planes/colors.hpp"
#include "formats/nif/spherical/primary.hpp"
#include "formats/nif/triangles/source_triangles.hpp"

namespace nif::format {

struct Object {
  std::string name;
  std::array<float, 3> aabb_min{}, aabb_max{};
  float bias = 0;
  uint32_t triangle_count = 0;  ///< triangles of the source mesh, after cleaning
  // Its parts. There must be an encoding with exactly these (kernels/reference/encodings.hpp).
  std::optional<PlanesData> planes;
  std::optional<TrianglesData> triangles;
  std::optional<NetworkData> network;
  std::optional<SphericalData> spherical;

  std::optional<Primary> primary;  ///< with any parts
  /// Only with triangles; without it, triangles are identified by their index in the object.
  std::optional<SourceTriangles> source_triangles;
  std::optional<Colors> colors;  ///< only with planes

  Bounds bounds() const { return {aabb_min, aabb_max}; }
};

struct Instance {
  std::string name;
  uint32_t object = 0;
  std::array<float, 12> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< object to world, row-major 3x4
  std::array<float, 3> remainder{};  ///< what rounding took from its translation
};

struct Asset {
  std::vector<Mlp> mlps;                              ///< shared by objects with a network
  std::vector<SphericalNetworks> spherical_networks;  ///< shared by `spherical` objects
  std::vector<Object> objects;
  std::vector<Instance> instances;  ///< if empty, each object is placed once, unless the asset places nothing
  bool places_nothing = false;      ///< only without instances
  std::string metadata;             ///< JSON
};

/// The kernels' view of an object; valid while the asset lives and does not change. kernels::set_bounds()
/// must accept the bounds of a `spherical` object.
kernels::AnyField field_of(const Asset& asset, const Object& object);
/// The same for an object with planes and this network.
kernels::SegmentField field_of(const Object& object, const Mlp& mlp);

}  // namespace nif::format
