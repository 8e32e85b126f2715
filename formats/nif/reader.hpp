// Reads a .nif file in place: checks all of it, then hands out views. No uncoded payload is copied, and
// nothing here needs more than a C++20 compiler.
//
// Safe on untrusted bytes: whatever is accepted can be queried by every kernel without touching memory
// outside the file and without integer overflow; everything else is refused with a nif::Error that names the
// file and the place. Memory use is bounded by a small multiple of the file's size.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "formats/nif/container.hpp"
#include "formats/nif/optional.hpp"
#include "formats/nif/parts.hpp"
#include "kernels/reference/hit_details.hpp"

namespace nif::format {

/// The file's first byte must be at a multiple of this, because its 64-bit words are read in place.
inline constexpr size_t kAddressAlignment = 8;

template <class... Part>
struct PartsOfView : Part::template Member<const typename Part::View*>... {};

/// Its parts are members `planes`, `triangles` and so on: in the view, or null if it has none.
struct ObjectView : OfParts<PartsOfView> {
  std::string_view name;  ///< a 0 follows it in memory
  std::array<float, 3> aabb_min{}, aabb_max{};
  float bias = 0;
  uint32_t triangle_count = 0;  ///< of the source mesh, after cleaning
  uint32_t level = 0;           ///< as in ObjectRecord
  float error = 0;              ///< likewise
  bool proven = true;           ///< its answers may be certain: as the file's prover says
  /// Why this build cannot answer the object, which then has no parts here: "has cut-outs, which ...". Null for
  /// all others.
  const char* unsupported = nullptr;

  Bounds bounds() const { return {aabb_min, aabb_max}; }
  /// Ready to be queried. The object must have this encoding, and be supported: as<kernels::SegmentField>(),
  /// as<kernels::ExactField>() ...
  template <class Field>
  Field as() const;
  template <class Field>
  bool is() const {
    return !unsupported && &encoding_of(*this) == &kernels::encoding_of_field<Field>();
  }
};

/// Ready to be queried. The object must be supported.
kernels::AnyField field_of(const ObjectView& object);
template <class Field>
Field ObjectView::as() const {
  return std::get<Field>(field_of(*this));
}
/// Its planes, in the view; null if it has none.
const kernels::PlanesField* grid_of(const ObjectView& object);
/// Bytes of the object in the file and of its decoded data, without networks.
uint64_t bytes_of(const ObjectView& object);

struct InstanceView {
  std::string_view name;  ///< a 0 follows it in memory
  uint32_t object = 0;
  std::array<float, 12> transform{};  ///< object to world, row-major 3x4
  std::array<float, 3> remainder{};   ///< what rounding took from its translation: to be added in double
  uint64_t user = 0;
  uint32_t mask = 0, flags = 0;  ///< InstanceFlags
  uint32_t parent = kNoParent;   ///< as in InstanceRecord
};

/// What a file says of a section that this build knows.
struct KnownSection {
  uint32_t type, flags;   ///< without kKeep
  uint32_t record_bytes;  ///< 0 if it has no records
};
/// Null if this build does not know sections of this type.
const KnownSection* known_section(uint32_t type);

template <class... Part>
using PartViews = std::tuple<std::pmr::vector<typename Part::View>...>;

/// Views into the bytes of one file; valid while those stay in place, unchanged.
struct AssetView {
  explicit AssetView(std::pmr::memory_resource* memory)
      : sections(memory),
        objects(memory),
        mlps(memory),
        spherical_networks(memory),
        alpha_maps(memory),
        instances(memory),
        primaries(memory),
        numbers(memory),
        colors(memory),
        skins(memory),
        parts(std::allocator_arg, memory),
        decoded(memory) {}

  std::span<const std::byte> bytes;
  std::string_view metadata;            ///< JSON, not parsed; empty if the file has none
  uint32_t arithmetic = 0, prover = 0;  ///< as in Header
  bool places_nothing = false;          ///< as in the file; never with instances
  std::pmr::vector<SectionView> sections;
  std::pmr::vector<ObjectView> objects;
  std::pmr::vector<MlpView> mlps;                              ///< shared by objects with a network
  std::pmr::vector<SphericalNetworksView> spherical_networks;  ///< shared by `spherical` objects
  std::pmr::vector<kernels::AlphaMap> alpha_maps;              ///< shared by objects with holes
  PayloadBytes alpha_map_bytes;                                ///< of all of them
  uint64_t alpha_tiles = 0;                                    ///< likewise
  std::pmr::vector<InstanceView> instances;
  std::pmr::vector<PrimaryView> primaries;  ///< in the order of their objects
  std::pmr::vector<NumbersView> numbers;    ///< likewise, then of their kinds
  std::pmr::vector<ColorsView> colors;      ///< likewise
  std::pmr::vector<SkinView> skins;         ///< likewise
  OfParts<PartViews> parts;                 ///< of each part, in the order of objects
  DecodedPayloads decoded;                  ///< what parts point to if the file is coded

  /// How many instances the asset stands for: those of the file; if it has none, each object of level 0 once,
  /// unless the asset places nothing.
  size_t placed_count() const;
  /// Calls each(object, instance) for these; `instance` is null if the file has none.
  template <class Each>
  void for_each_placed(const Each& each) const {
    for (const InstanceView& instance : instances) each(instance.object, &instance);
    for (uint32_t i = 0; i < objects.size() && instances.empty() && !places_nothing; ++i)
      if (objects[i].level == 0) each(i, static_cast<const InstanceView*>(nullptr));
  }
  /// Bytes of these views themselves, without the file's bytes and decoded data.
  uint64_t view_bytes() const;
  /// Null if the object has none.
  const PrimaryView* primary_of(uint32_t object) const;
  const NumbersView* numbers_of(uint32_t object, NumbersKind kind) const;
  const ColorsView* colors_of(uint32_t object) const;
  const SkinView* skin_of(uint32_t object) const;
  /// MLPs, then pairs of networks of `spherical` objects.
  uint32_t network_count() const { return uint32_t(mlps.size() + spherical_networks.size()); }
  /// Index of the object's network among these; 0 if it has none.
  uint32_t network_of(const ObjectView& object) const;
  /// Afterwards only names and metadata point into the file.
  void drop_bytes();
};

/// What hits with one of its objects report; it points into the view and the file.
kernels::HitDetails hit_details(const AssetView& asset, uint32_t object);

template <class... Part>
struct PartCountOf {
  static constexpr size_t kCount =
      (std::tuple_size_v<decltype(std::declval<typename Part::View>().parts())> + ... + 7);
};
/// The bytes of all objects together, payload by payload: those of every part, even if no object has it, then
/// "network", "alpha_maps", "primary", "source_triangles", "numbers" (the other ones), "colors" and "skin". Without records, names, metadata and padding.
class FileParts {
 public:
  static constexpr size_t kMost = OfParts<PartCountOf>::kCount;

  void add(const PartBytes& part) {
    size_t k = 0;
    while (k < count_ && std::string_view(parts_[k].name) != part.name) ++k;
    if (k == count_) parts_[count_++].name = part.name;
    parts_[k].bytes += part.bytes;
    parts_[k].decoded += part.decoded;
  }
  size_t size() const { return count_; }
  const PartBytes& operator[](size_t k) const { return parts_[k]; }
  const PartBytes* begin() const { return parts_.data(); }
  const PartBytes* end() const { return parts_.data() + count_; }

 private:
  std::array<PartBytes, kMost> parts_{};
  size_t count_ = 0;
};
FileParts bytes_by_part(const AssetView& asset);

/// Checks and reads a whole file. Error messages call it `file_name`.
AssetView read_asset(std::span<const std::byte> bytes, std::string_view file_name,
                     std::pmr::memory_resource* memory = std::pmr::get_default_resource());

}  // namespace nif::format
