// The holes part as files store it: alpha maps, which objects may share, and the places of triangles in them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "formats/nif/layout.hpp"
#include "formats/nif/part_bytes.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/holes/holes_field.hpp"

namespace nif::format {

struct Asset;
struct AssetView;
struct Object;
struct ObjectView;

enum HolesSection : uint32_t {
  kHoles = fourcc("HOLE"),      ///< HolesRecord[]
  kAlphaMaps = fourcc("ALPH"),  ///< AlphaMapRecord[]
};

/// Of all maps of a file together: 128 MiB in memory.
inline constexpr uint64_t kMostAlphaTiles = uint64_t{1} << 24;

struct AlphaMapRecord {    // 40 bytes
  uint32_t width, height;  ///< in texels, 1 to kernels::kMaxAlphaSide
  uint8_t wrap[2];         ///< kernels::AlphaWrap, along x and y
  uint8_t reserved[6];     ///< 0
  Payload tiles;           ///< coded: coded_alpha_map.hpp
};
static_assert(sizeof(AlphaMapRecord) == 40);

struct HolesRecord {     // 40 bytes
  uint32_t patches;      ///< 1 to the number of triangles
  uint32_t reserved[3];  ///< 0
  Payload holes;         ///< kernels::AlphaPatch [patches]; then the numbers of triangles, packed
};
static_assert(sizeof(HolesRecord) == 40);

/// Alpha maps that own their tiles. Copies share these.
class AlphaMaps {
 public:
  using Tiles = std::shared_ptr<const std::vector<uint64_t>>;

  /// `map` without its tiles, which must be as many as it needs.
  void add(kernels::AlphaMap map, Tiles tiles);
  size_t size() const { return maps_.size(); }
  const kernels::AlphaMap& operator[](size_t i) const { return maps_[i]; }
  const Tiles& tiles(size_t i) const { return tiles_[i]; }
  const kernels::AlphaMap* data() const { return maps_.data(); }
  auto begin() const { return maps_.begin(); }
  auto end() const { return maps_.end(); }
  void clear() { *this = {}; }

 private:
  std::vector<kernels::AlphaMap> maps_;
  std::vector<Tiles> tiles_;
};

/// The holes of one object.
struct HolesData {
  std::vector<kernels::AlphaPatch> patches;  ///< their maps are indices into Asset::alpha_maps
  /// As in kernels::HolesField: packed, of `triangles` triangles.
  std::vector<uint32_t> numbers;
  uint32_t triangles = 0;

  uint32_t bits() const { return kernels::source_bits(uint32_t(patches.size()) + 1); }
  /// Sets the numbers: of each triangle, 0 or its patch plus 1. The patches must be there.
  void set_numbers(const std::vector<uint32_t>& unpacked);
  /// Size of the payload in a file.
  uint64_t bytes() const { return patches.size() * sizeof(patches[0]) + numbers.size() * sizeof(numbers[0]); }
};

/// The kernels' view; valid while both live and do not change.
kernels::HolesField field_of(const HolesData& data, const AlphaMaps& maps);

struct HolesView {
  kernels::HolesField field;  ///< ready to be queried, together with its object's triangles
  uint64_t bytes = 0;

  std::array<PartBytes, 1> parts() const { return {{{"holes", bytes}}}; }
  void drop_bytes() { *this = {}; }
};

/// As formats/nif/parts.hpp requires.
struct AlphaMapsOfHoles {
  static constexpr uint32_t kRecords = kAlphaMaps;
  using Record = AlphaMapRecord;

  template <class Asset>
  static auto& of(Asset& asset) {
    return asset.alpha_maps;
  }
};

struct HolesPart {
  static constexpr const char* kName = "holes";
  static constexpr uint32_t kRecords = kHoles;
  static constexpr uint32_t kFlag = kCutOuts;
  using Record = HolesRecord;
  using Data = HolesData;
  using View = HolesView;
  using Shared = AlphaMapsOfHoles;

  template <class Held>
  struct Member {
    Held holes{};
  };

  template <class Object>
  static auto& of(Object& object) {
    return object.holes;
  }
};

kernels::AlphaMap read_record(const AlphaMapRecord& record, const Reading& reading);
AlphaMapRecord write_record(const kernels::AlphaMap& map, Section& payloads);
HolesView read_record(const HolesRecord& record, const ObjectView& object, const Reading& reading);
HolesRecord write_record(const HolesData& data, const Object& object, Section& payloads);
HolesData to_data(const HolesView& view);
/// Adds a copy of a map.
void add_copy(const kernels::AlphaMap& map, AlphaMaps& to);

}  // namespace nif::format
