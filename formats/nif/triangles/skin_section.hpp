// How the vertices of an object bend in a .nif file: optional, for `bvh` objects that know which vertices of the source
// theirs are (kSourceVertices). A reader that skips it answers about the object at rest.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/triangles/skin.hpp"

namespace nif::format {

struct Object;
struct ObjectView;

/// Optional: both, or neither.
enum SkinSection : uint32_t {
  kSkinRecords = fourcc("SKIN"),  ///< SkinRecord[]
  kSkinValues = fourcc("SVAL"),   ///< each record's payload
};

/// Largest move by a morph target along any axis.
inline constexpr float kMostMove = 0x1p50f;

struct SkinRecord {     // 48 bytes
  uint32_t object;      ///< index into kObjects; records are in the order of their objects
  uint32_t vertices;    ///< of the source, as many as the object's kSourceVertices are below
  uint32_t joints;      ///< 0 to kernels::kMostJoints
  uint32_t influences;  ///< of each vertex: 0 without joints, else 4 or 8
  uint32_t targets;     ///< morph targets; without joints, at least 1
  uint32_t reserved;    ///< 0
  Payload values;       ///< kernels::SkinField: weights, targets, joints, without gaps
};
static_assert(sizeof(SkinRecord) == 48);

/// A skin that owns its arrays: members as in kernels::SkinField.
struct Skin {
  uint32_t vertex_count = 0, joint_count = 0, influences = 0, target_count = 0;
  std::vector<float> weights;
  std::vector<std::array<float, 3>> targets;
  std::vector<uint16_t> joints;
};

/// Size of the payload.
constexpr uint64_t skin_bytes(uint64_t vertices, uint32_t influences, uint32_t targets) {
  return vertices * (influences * (sizeof(float) + sizeof(uint16_t)) + targets * 3 * sizeof(float));
}

struct SkinView {
  uint32_t object = 0;       ///< index into AssetView::objects
  kernels::SkinField field;  ///< into the file

  uint64_t bytes() const { return skin_bytes(field.vertex_count, field.influences, field.target_count); }
};

std::optional<SkinView> read_record(const SkinRecord& record, const ObjectView& object,
                                    const Reading& reading);
Skin to_skin(const SkinView& view);

/// As formats/nif/optional.hpp requires.
struct SkinRecords {
  static constexpr uint32_t kRecords = kSkinRecords, kValues = kSkinValues;
  static constexpr Rule kOrder = Rule::optional_order;
  using Record = SkinRecord;

  static uint64_t rank(const Record& record) { return record.object; }
  template <class Asset>
  static auto& of(Asset& asset) {
    return asset.skins;
  }
  static bool has(const Object& object);
  static std::vector<Record> write(const Object& object, uint32_t number, Section& payloads);
};

}  // namespace nif::format
