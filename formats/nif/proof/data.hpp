// An occupancy grid with planes, as files hold it: what all encodings that prove answers have in common.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/base/size.hpp"
#include "formats/nif/container.hpp"
#include "formats/nif/layout.hpp"
#include "kernels/reference/proof/field.hpp"

namespace nif::format {

/// How the payloads of an object are stored, as bits. Those that are coded (docs/format.md) are decoded when
/// a file is read, to what they would be uncoded.
enum PayloadForm : uint32_t {
  kCodedOccupancy = 1,
  kCodedCells = 2,
  kCodedFeatures = 4,
  kCodedPayloads = 7,  ///< all of these
  kStatedCorners = 8,  ///< with kCodedOccupancy: corners with features are not those around surface voxels
  kStatedKinds = 16,   ///< with kCodedCells: kinds do not say all that is proven of sides
  kPayloadForms = 31   ///< all bits
};
/// Those of an object without features.
inline constexpr uint32_t kProofForms = kCodedOccupancy | kCodedCells | kStatedKinds;

/// Where a payload of an object is coded, what all payloads of that object decode to is at most so many times
/// what they take of the file, and that is at least kBytesPerBrick for each brick, as it is in an uncoded
/// table. So the size of a file bounds the memory that it needs.
inline constexpr uint64_t kMostExpansion = 16, kBytesPerBrick = 2;

/// One object's grid; members as in kernels::ProofField.
struct ProofData {
  std::array<float, 3> origin{};
  float voxels_per_unit = 0;
  uint32_t levels = 0;
  std::array<uint32_t, 3> voxels{};
  std::vector<uint16_t> brick_table;
  std::vector<kernels::BrickStates> brick_states;
  std::vector<uint32_t> voxel_base;
  std::vector<uint32_t> voxel_records;
  std::vector<uint32_t> parts;
  uint32_t coded = 0;  ///< PayloadForm: payloads that a file is to have coded, where that makes them smaller
};

/// Bricks along one axis that hold voxels + 1 corners.
constexpr uint32_t bricks_for(uint32_t voxels) { return voxels / kernels::kBrickSide + 1; }

/// Bytes of the payloads of a grid where none is coded.
struct UncodedGrid {
  uint64_t bricks, occupancy, cells;

  /// Of a record, or of what else has such members.
  template <class Record>
  explicit UncodedGrid(const Record& r)
      : bricks(uint64_t{bricks_for(r.voxels[0])} * bricks_for(r.voxels[1]) * bricks_for(r.voxels[2])),
        occupancy(uint64_t{r.mixed_bricks} * (sizeof(kernels::BrickStates) + sizeof(uint32_t)) +
                  bricks * sizeof(uint16_t)),
        cells((uint64_t{r.surface_voxels} + r.part_count) * sizeof(uint32_t)) {}

  /// Whether a file may have them coded, in so many bytes together.
  bool may_take(uint64_t bytes) const {
    return occupancy + cells <= kMostExpansion * bytes && kBytesPerBrick * bricks <= bytes;
  }
};

inline void set_scales(float voxels_per_unit, uint32_t levels, kernels::ProofField& field) {
  const float cells = static_cast<float>(1u << levels);
  field.levels = levels;
  field.voxels_per_unit = voxels_per_unit;
  field.cells_per_unit = voxels_per_unit * cells;
  field.voxels_per_cell = 1 / cells;
}

/// Puts planes that prove nothing into every surface voxel: voxel_base and voxel_records by brick_states.
void leave_bare(ProofData& data);

/// The kernels' view of a grid; valid while it lives and is not changed.
kernels::ProofField proof_of(const ProofData& data);
/// The reverse, but for `coded`.
ProofData proof_data(const kernels::ProofField& field);

/// What a payload takes.
struct PayloadBytes {
  uint64_t file = 0;
  uint64_t decoded = 0;  ///< in memory; 0 where it is used in place
};

/// The memory of payloads that were coded in a file.
class DecodedPayloads {
 public:
  explicit DecodedPayloads(std::pmr::memory_resource* memory) : payloads_(memory) {}
  /// Not copied, because fields point to what is decoded.
  DecodedPayloads(DecodedPayloads&&) = default;

  /// Zeros, a line more than `bytes`, because kernels load more than the last few. They stay where
  /// they are; `taken` is told how many there are.
  std::byte* add(uint64_t bytes, PayloadBytes& taken) {
    const size_t lines = memory_size(aligned(bytes) / kAlignment + 1);
    taken.decoded = uint64_t{lines} * kAlignment;
    return payloads_.emplace_back(lines).front().bytes;
  }
  /// Without what is decoded.
  uint64_t view_bytes() const { return payloads_.capacity() * sizeof(payloads_[0]); }
  void drop() { payloads_ = std::pmr::vector<std::pmr::vector<Line>>(payloads_.get_allocator()); }

 private:
  struct alignas(kAlignment) Line {
    std::byte bytes[kAlignment];
  };
  std::pmr::vector<std::pmr::vector<Line>> payloads_;
};

}  // namespace nif::format
