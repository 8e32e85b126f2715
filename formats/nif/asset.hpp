// An asset as the baker makes it: everything that a .nif file holds, in memory that it owns.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/nif/optional.hpp"
#include "formats/nif/parts.hpp"

namespace nif::format {

template <class... Part>
struct PartsOfObject : Part::template Member<std::optional<typename Part::Data>>... {};

/// Its parts are members `planes`, `triangles` and so on. There must be an encoding with exactly these
/// (kernels/reference/field_list.hpp).
struct Object : OfParts<PartsOfObject> {
  std::string name;
  std::array<float, 3> aabb_min{}, aabb_max{};
  float bias = 0;
  uint32_t triangle_count = 0;  ///< triangles of the source mesh, after cleaning
  uint32_t level = 0;           ///< above 0: a coarser stand-in for the next object, which is a level below
  float error = 0;              ///< as in ObjectRecord
  std::optional<Primary> primary;  ///< with any parts
  /// By NumbersKind, only with triangles. Without kSourceTriangles, triangles are identified by their index in
  /// the object.
  std::map<uint32_t, Numbers> numbers;
  std::optional<Colors> colors;  ///< only with planes
  std::optional<Skin> skin;      ///< only of `bvh` objects with kSourceVertices

  Bounds bounds() const { return {aabb_min, aabb_max}; }
};

struct Instance {
  std::string name;
  uint32_t object = 0;
  std::array<float, 12> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< object to world, row-major 3x4
  std::array<float, 3> remainder{};  ///< what rounding took from its translation
  uint64_t user = 0;
  uint32_t mask = 0xffffffff;
  uint32_t flags = 0;           ///< InstanceFlags
  uint32_t parent = kNoParent;  ///< as in InstanceRecord
};

/// A section that this build does not know, which is to be kept.
struct KeptSection {
  uint32_t type = 0, flags = 0, record_size = 0;
  std::vector<std::byte> bytes;
};

struct Asset {
  std::vector<Mlp> mlps;                              ///< shared by objects with a network
  std::vector<SphericalNetworks> spherical_networks;  ///< shared by `spherical` objects
  AlphaMaps alpha_maps;                               ///< shared by objects with holes
  std::vector<Object> objects;
  /// If empty, each object of level 0 is placed once, unless the asset places nothing.
  std::vector<Instance> instances;
  bool places_nothing = false;  ///< only without instances
  uint32_t prover = kProver;    ///< as in the header
  std::string metadata;         ///< JSON
  std::vector<KeptSection> kept;
};

/// The kernels' view of an object; valid while the asset lives and does not change. kernels::set_bounds()
/// must accept the bounds of a `spherical` object.
kernels::AnyField field_of(const Asset& asset, const Object& object);
/// The same for an object with planes and this network.
kernels::SegmentField field_of(const Object& object, const Mlp& mlp);

}  // namespace nif::format
