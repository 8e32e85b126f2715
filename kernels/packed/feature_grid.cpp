// Builds corner bricks in two passes. The first copies the features at the 5 x 5 x 5 corners of each brick;
// the second checks whether a corner with features was missed, which makes the grid incomplete.
#include "kernels/packed/feature_grid.hpp"

#include <bit>
#include <cstring>

#include "kernels/reference/network/samples.hpp"

namespace nif::kernels::cpu {

FeatureGrid::FeatureGrid(const SegmentField& field, std::pmr::memory_resource* memory)
    : table(memory), bricks(memory), pairs(memory), complete(field.features_per_corner == 2) {
  for (int a = 0; a < 3; ++a) size[a] = (field.voxels[a] + 3) / 4;
  bricks.push_back({});
  if (!complete) return;
  table.assign((size_t(size[0]) * size[1] * size[2] + 15) / 16, 0);
  size_t number = 0;
  for (uint32_t z = 0; z < size[2]; ++z)
    for (uint32_t y = 0; y < size[1]; ++y)
      for (uint32_t x = 0; x < size[0]; ++x, ++number) {
        if (number % 16 == 0) table[number / 16] = uint32_t(bricks.size() - 1) << 16;
        const uint16_t entry = field.brick_table[x + field.bricks[0] * (y + field.bricks[1] * z)];
        const BrickStates* states =
            entry < kFirstMixedBrick ? nullptr : &field.brick_states[entry - kFirstMixedBrick];
        if (states == nullptr || (states->surface & ~states->aux) == 0) continue;
        table[number / 16] |= 1u << (number % 16);
        uint32_t layers[5] = {};  // corners of the brick's own surface voxels
        for (uint64_t left = states->surface & ~states->aux; left != 0; left &= left - 1) {
          const auto voxel = uint32_t(std::countr_zero(left));
          const uint32_t four = 0x63u << (voxel % 4 + 5 * (voxel / 4 % 4));
          layers[voxel / 16] |= four;
          layers[voxel / 16 + 1] |= four;
        }
        CornerBrick brick{.first = uint32_t(pairs.size()), .layer = {}};
        for (uint32_t k = 0; k < 5; ++k) {
          brick.layer[k] = layers[k] | uint32_t(pairs.size() - brick.first) << 25;
          for (uint32_t left = layers[k]; left != 0; left &= left - 1) {
            const auto bit = uint32_t(std::countr_zero(left));
            const uint32_t corner = corner_index(field, 4 * x + bit % 5, 4 * y + bit / 5, 4 * z + k);
            uint16_t pair = 0;  // value of a corner without features
            if (corner != kNoCorner) std::memcpy(&pair, field.features + 2 * size_t(corner), 2);
            pairs.push_back(pair);
          }
        }
        bricks.push_back(brick);
      }
  pairs.insert(pairs.end(), 2, 0);
  pairs.shrink_to_fit();
  bricks.shrink_to_fit();

  for (uint32_t z = 0; z < field.bricks[2]; ++z)
    for (uint32_t y = 0; y < field.bricks[1]; ++y)
      for (uint32_t x = 0; x < field.bricks[0]; ++x) {
        const uint16_t entry = field.brick_table[x + field.bricks[0] * (y + field.bricks[1] * z)];
        if (entry < kFirstMixedBrick) continue;
        for (uint64_t left = field.brick_corners[entry - kFirstMixedBrick]; left != 0; left &= left - 1) {
          const auto bit = uint32_t(std::countr_zero(left));
          if (!find(4 * x + bit % 4, 4 * y + bit / 4 % 4, 4 * z + bit / 16)) complete = false;
        }
      }
}

std::vector<uint32_t> FeatureGrid::next_pairs() const {
  std::vector<uint32_t> both(pairs.begin(), pairs.end());
  for (size_t i = 1; i < both.size(); ++i) both[i - 1] |= uint32_t(pairs[i]) << 16;
  return both;
}

const uint16_t* FeatureGrid::find(uint32_t x, uint32_t y, uint32_t z) const {
  // A corner between bricks belongs to up to eight of them.
  const auto first = [](uint32_t v) { return v > 0 ? (v - 1) / 4 : 0; };
  for (uint32_t bz = first(z); bz <= z / 4 && bz < size[2]; ++bz)
    for (uint32_t by = first(y); by <= y / 4 && by < size[1]; ++by)
      for (uint32_t bx = first(x); bx <= x / 4 && bx < size[0]; ++bx) {
        const CornerBrick& brick = bricks[index_of(bx + size[0] * (by + size[1] * size_t(bz)))];
        const uint32_t layer = brick.layer[z - 4 * bz], bit = x - 4 * bx + 5 * (y - 4 * by);
        if ((layer >> bit & 1) == 0) continue;
        return &pairs[brick.first + (layer >> 25) + uint32_t(std::popcount(layer & ((1u << bit) - 1)))];
      }
  return nullptr;
}

uint16_t FeatureGrid::pair_at(uint32_t x, uint32_t y, uint32_t z) const {
  const uint16_t* pair = find(x, y, z);
  return pair ? *pair : uint16_t{0};
}

}  // namespace nif::kernels::cpu
