// Numbers of an object's triangles or vertices in a .nif file: which ones of the source mesh they are, their
// materials, values of the user's. Optional, for objects that have triangles.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/triangles/source_triangles.hpp"

namespace nif::format {

struct Object;
struct ObjectView;

/// Optional: both, or neither.
enum NumbersSection : uint32_t {
  kNumbersRecords = fourcc("NUMS"),  ///< NumbersRecord[]
  kNumbersValues = fourcc("NVAL"),   ///< each record's payload
};

/// What numbers are of; a reader skips kinds that it does not know.
enum NumbersKind : uint32_t {
  kSourceTriangles = 1,  ///< each triangle's, in the source mesh before cleaning
  kMaterials = 2,        ///< each triangle's
  kUserValues = 3,       ///< each triangle's
  kSourceVertices = 4,   ///< of each vertex that the object stores, in the source mesh
};
inline constexpr uint32_t kMostNumbers = 4;  ///< of one object

struct NumbersRecord {  // 40 bytes
  uint32_t object;      ///< index into kObjects; records are in the order of their objects, then of kinds
  uint32_t kind;        ///< NumbersKind
  uint32_t below;       ///< all numbers are below it; 0 stands for 2^32
  uint32_t reserved;    ///< 0
  Payload numbers;      ///< packed: kernels::SourceTriangles
};
static_assert(sizeof(NumbersRecord) == 40);

/// Numbers of one kind.
struct Numbers {
  uint32_t below = 0;            ///< as in the record
  std::vector<uint32_t> values;  ///< [triangle or vertex of the object, in its order]
};

/// Size of the payload for this many numbers.
constexpr uint64_t numbers_bytes(uint64_t count, uint32_t below) {
  return kernels::source_words(count, kernels::source_bits(below)) * sizeof(uint32_t);
}

struct NumbersView {
  uint32_t object = 0;             ///< index into AssetView::objects
  uint32_t kind = 0;               ///< NumbersKind
  uint32_t below = 0;              ///< as in the record
  kernels::SourceTriangles field;  ///< into the file
  uint64_t bytes = 0;
};

/// Nothing if their kind is unknown.
std::optional<NumbersView> read_record(const NumbersRecord& record, const ObjectView& object,
                                       const Reading& reading);
Numbers to_numbers(const NumbersView& view);

/// As formats/nif/optional.hpp requires.
struct NumbersRecords {
  static constexpr uint32_t kRecords = kNumbersRecords, kValues = kNumbersValues;
  static constexpr Rule kOrder = Rule::numbers_order;
  using Record = NumbersRecord;

  static uint64_t rank(const Record& record) { return uint64_t{record.object} << 32 | record.kind; }
  template <class Asset>
  static auto& of(Asset& asset) {
    return asset.numbers;
  }
  static bool has(const Object& object);
  static std::vector<Record> write(const Object& object, uint32_t number, Section& payloads);
};

}  // namespace nif::format
