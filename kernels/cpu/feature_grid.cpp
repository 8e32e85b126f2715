#include "kernels/cpu/feature_grid.hpp"

#include <bit>
#include <cstring>

#include "kernels/reference/samples.hpp"

namespace nif::kernels::cpu {

FeatureGrid::FeatureGrid(const SegmentField& field, std::pmr::memory_resource* memory)
    : table(memory), bricks(memory), pairs(memory) {
  for (int a = 0; a < 3; ++a) size[a] = (field.voxels[a] + 3) / 4;
  table.reserve(size_t(size[0]) * size[1] * size[2]);
  bricks.push_back({});
  if (field.features_per_corner != 2) return;
  for (uint32_t z = 0; z < size[2]; ++z)
    for (uint32_t y = 0; y < size[1]; ++y)
      for (uint32_t x = 0; x < size[0]; ++x) {
        const uint16_t entry = field.brick_table[x + field.bricks[0] * (y + field.bricks[1] * z)];
        const BrickStates* states =
            entry < kFirstMixedBrick ? nullptr : &field.brick_states[entry - kFirstMixedBrick];
        if (states == nullptr || (states->surface & ~states->aux) == 0) {
          table.push_back(0);
          continue;
        }
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
            uint16_t pair;
            std::memcpy(&pair, field.features + 2 * size_t(corner), 2);
            pairs.push_back(pair);
          }
        }
        table.push_back(uint16_t(bricks.size()));
        bricks.push_back(brick);
      }
  pairs.push_back(0);
  pairs.shrink_to_fit();
  bricks.shrink_to_fit();
}

}  // namespace nif::kernels::cpu
