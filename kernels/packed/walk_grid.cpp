// Distances by sweeps over the grid (after Rosenfeld and Pfaltz 1966), then codes.
#include "kernels/packed/walk_grid.hpp"

#include <algorithm>

#include "kernels/reference/segment/walk.hpp"

namespace nif::kernels::cpu {
namespace {

/// Lowest and highest code of each VoxelState.
constexpr uint32_t kFirstCode[4] = {1, 10, 14, 0};
constexpr uint32_t kLastCode[4] = {9, 13, 15, 0};
constexpr uint8_t kFar = 16;  ///< beyond the longest distance that a code can say

/// A voxel's state in the two highest bits, the distance to another state in the rest.
constexpr uint8_t kDistanceBits = 63;

/// A grid of those, seen with the axis that has tables outermost.
struct Layers {
  uint8_t* voxels;
  int32_t size[3];
  int64_t stride[3];

  /// Shortens the distances in one layer by those within it and in the layer that comes next on `side` (-1 or
  /// 1), which must have been swept already: two sweeps, there and back.
  void sweep(int32_t layer, int32_t side) const {
    const bool last = layer + side < 0 || layer + side >= size[2];
    uint8_t* const own = voxels + layer * stride[2];
    const uint8_t* const beside = last ? nullptr : own + side * stride[2];
    for (int32_t y = 0; y < size[1]; ++y)
      for (int32_t x = 0; x < size[0]; ++x) relax(own, beside, x, y, -1);
    for (int32_t y = size[1]; y-- > 0;)
      for (int32_t x = size[0]; x-- > 0;) relax(own, nullptr, x, y, 1);
  }

 private:
  /// Looks at the neighbours in the layer that come before (towards -1) or after, and at all nine beside it.
  void relax(uint8_t* own, const uint8_t* beside, int32_t x, int32_t y, int32_t towards) const {
    uint8_t& voxel = own[x * stride[0] + y * stride[1]];
    int32_t distance = voxel & kDistanceBits;
    const auto look = [&](const uint8_t* layer, int32_t nx, int32_t ny) {
      const uint8_t other = layer[nx * stride[0] + ny * stride[1]];
      distance = std::min(distance, (other ^ voxel) & ~kDistanceBits ? 1 : (other & kDistanceBits) + 1);
    };
    const int32_t x0 = std::max(x - 1, 0), x1 = std::min(x + 1, size[0] - 1);
    const int32_t y0 = std::max(y - 1, 0), y1 = std::min(y + 1, size[1] - 1);
    if (beside != nullptr)
      for (int32_t ny = y0; ny <= y1; ++ny)
        for (int32_t nx = x0; nx <= x1; ++nx) look(beside, nx, ny);
    if (y + towards >= 0 && y + towards < size[1])
      for (int32_t nx = x0; nx <= x1; ++nx) look(own, nx, y + towards);
    if (x + towards >= 0 && x + towards < size[0]) look(own, x + towards, y);
    voxel = uint8_t((voxel & ~kDistanceBits) | distance);
  }
};

uint64_t padded_voxels(const SegmentField& field) {
  uint64_t count = 1;
  for (const uint32_t voxels : field.voxels) count *= code_bricks(voxels) * 4;
  return count;
}

}  // namespace

bool WalkGrid::can_hold(const SegmentField& field, uint32_t tables) {
  return tables * padded_voxels(field) <= uint64_t{1} << 24;
}

size_t WalkGrid::bytes_of(const SegmentField& field, uint32_t tables) {
  return size_t(std::max(tables, 1u) * padded_voxels(field) / 2);
}

uint32_t WalkGrid::most_tables(const SegmentField& field) {
  return can_hold(field, 2) ? 2 : can_hold(field, 1) ? 1 : 0;
}

WalkGrid::WalkGrid(const SegmentField& field, uint32_t tables, std::pmr::memory_resource* memory)
    : codes(memory) {
  const uint32_t(&size)[3] = field.voxels;
  for (int a = 0; a < 3; ++a) bricks[a] = code_bricks(size[a]);
  beyond[0] = 64 - 4;
  beyond[1] = float(64 / 4 * bricks[0] - 4);
  beyond[2] = float(64 / 16 * bricks[0] * bricks[1] - 4);
  axis = uint32_t(std::min_element(size, size + 3) - size);
  second = tables > 1 ? uint32_t(padded_voxels(field)) : 0;
  codes.assign(bytes_of(field, tables) / sizeof(codes[0]), 0);

  // A byte for each voxel, which takes more than all that stays: so there is one at a time.
  std::pmr::vector<uint8_t> voxels(memory);
  voxels.reserve(size_t(size[0]) * size[1] * size[2]);
  const uint32_t sweeps = std::max(tables, 1u);
  for (uint32_t table = 0; table < sweeps; ++table) {
    classify(field, tables == 0 ? 1 : kFar, voxels);
    // What lies above shortens the first table's distances, what lies below the second's, and both do where
    // there is one table.
    if (tables > 0 && table == 0) sweep(size, voxels, 1);
    if (tables == 1 || table == 1) sweep(size, voxels, -1);
    size_t at = 0;
    for (uint32_t z = 0; z < size[2]; ++z)
      for (uint32_t y = 0; y < size[1]; ++y)
        for (uint32_t x = 0; x < size[0]; ++x, ++at)
          put(code_number(x, y, z, bricks[0], bricks[0] * bricks[1]) + table * second, voxels[at]);
  }
}

void WalkGrid::classify(const SegmentField& field, uint8_t distance, std::pmr::vector<uint8_t>& voxels) {
  voxels.clear();
  for (int32_t z = 0; z < int32_t(field.voxels[2]); ++z)
    for (int32_t y = 0; y < int32_t(field.voxels[1]); ++y)
      for (int32_t x = 0; x < int32_t(field.voxels[0]); ++x) {
        const int32_t voxel[3] = {x, y, z};
        voxels.push_back(uint8_t(uint32_t(voxel_state(field, voxel)) << 6 | distance));
      }
}

void WalkGrid::sweep(const uint32_t (&size)[3], std::pmr::vector<uint8_t>& voxels, int32_t side) const {
  const int64_t strides[3] = {1, size[0], int64_t(size[0]) * size[1]};
  const uint32_t a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
  const Layers layers{voxels.data(),
                      {int32_t(size[a]), int32_t(size[b]), int32_t(size[axis])},
                      {strides[a], strides[b], strides[axis]}};
  const int32_t count = layers.size[2];
  for (int32_t i = 0; i < count; ++i) layers.sweep(side > 0 ? count - 1 - i : i, side);
}

void WalkGrid::put(uint32_t number, uint8_t voxel) {
  const uint32_t state = voxel >> 6;
  uint32_t code = kFirstCode[state];
  while (code < kLastCode[state] && kCodeDistance[code + 1] <= float(voxel & kDistanceBits)) ++code;
  codes[number / 8] |= code << (4 * (number % 8));
}

}  // namespace nif::kernels::cpu
