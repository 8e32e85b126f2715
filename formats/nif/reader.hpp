// Reads a .nif file in place: checks all of it, then hands out views. Nothing of the payload is copied, and
// nothing here needs more than a C++20 compiler.
//
// Safe on untrusted bytes: whatever is accepted can be queried by every kernel without touching memory
// outside the file and without integer overflow; whatever is not is refused with a nif::Error that names the
// file and the place. Memory taken is bounded by a small multiple of the file's size.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <string_view>
#include <vector>

#include "formats/nif/container.hpp"
#include "kernels/reference/bvh/field.hpp"
#include "kernels/reference/segment/field.hpp"
#include "kernels/reference/spherical/field.hpp"

namespace nif::format {

/// The file's first byte must lie at a multiple of this, because its 64-bit words are read in place.
inline constexpr size_t kAddressAlignment = 8;

/// What of fields is not of its object's encoding is empty.
struct ObjectView {
  Encoding encoding = kSegment;
  std::string_view name;  ///< a 0 follows it in memory
  uint32_t network = 0;
  std::array<float, 3> aabb_min{}, aabb_max{};
  float bias = 0;
  uint32_t triangles = 0;
  uint64_t occupancy_bytes = 0, feature_bytes = 0, bvh_bytes = 0, grid_bytes = 0;
  /// Distances in object space, times this, are what kernels::kCertainReach limits: voxels, or for a `bvh`
  /// object kernels::kBvhUnits to its extent, for a `spherical` one kernels::kSphericalUnits to its diagonal.
  float reach_scale = 0;
  float logit_scale = 1;        ///< probability of being visible = 1 / (1 + exp(-logit * logit_scale))
  kernels::SegmentField field;  ///< ready to be queried
  kernels::BvhField bvh;        ///< ready to be queried
  const kernels::SphericalField* spherical =
      nullptr;  ///< ready to be queried; of AssetView::spherical_fields
};

struct InstanceView {
  std::string_view name;  ///< a 0 follows it in memory
  uint32_t object = 0;
  std::array<float, 12> transform{};  ///< object to world, row-major 3x4
};

struct NetworkView {
  kernels::Network network;
  uint64_t bytes = 0;
};

/// Both networks of `spherical` objects.
struct SphericalNetworksView {
  kernels::SphericalNetwork outer, inner;
  float slope = 0;
  uint64_t bytes = 0;
};

/// What answers primary rays of one object, where it has that.
struct PrimaryView {
  uint32_t object = 0;          ///< index into AssetView::objects
  kernels::PrimaryField field;  ///< ready to be queried
  uint64_t grid_bytes = 0, network_bytes = 0;
};

/// Views into the bytes of one file; valid while those stay where they are, unchanged.
struct AssetView {
  explicit AssetView(std::pmr::memory_resource* memory)
      : sections(memory),
        objects(memory),
        instances(memory),
        networks(memory),
        spherical_networks(memory),
        spherical_fields(memory),
        primaries(memory) {}
  AssetView(AssetView&&) = default;
  AssetView(const AssetView&) = delete;  // its objects point to its fields

  std::span<const std::byte> bytes;
  std::string_view metadata;  ///< JSON, not parsed; empty where the file has none
  std::pmr::vector<SectionView> sections;
  std::pmr::vector<ObjectView> objects;
  std::pmr::vector<InstanceView> instances;
  std::pmr::vector<NetworkView> networks;
  std::pmr::vector<SphericalNetworksView> spherical_networks;
  std::pmr::vector<kernels::SphericalField> spherical_fields;  ///< of those objects that are such
  std::pmr::vector<PrimaryView> primaries;                     ///< in the order of their objects

  /// Everything that this asset keeps in memory: the file's bytes and these views.
  uint64_t resident_bytes() const;
  /// Null where the object has none.
  const PrimaryView* primary_of(uint32_t object) const;
};

/// Checks and reads a whole file. `file_name` is what error messages call it.
AssetView read_asset(std::span<const std::byte> bytes, std::string_view file_name,
                     std::pmr::memory_resource* memory = std::pmr::get_default_resource());

}  // namespace nif::format
