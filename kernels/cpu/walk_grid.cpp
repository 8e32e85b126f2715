// Distances by two sweeps over the grid (Rosenfeld and Pfaltz 1966), then codes.
#include "kernels/cpu/walk_grid.hpp"

#include <algorithm>

#include "kernels/reference/walk.hpp"

namespace nif::kernels::cpu {
namespace {

/// Lowest and highest code of each VoxelState.
constexpr uint32_t kFirstCode[4] = {1, 10, 14, 0};
constexpr uint32_t kLastCode[4] = {9, 13, 15, 0};
constexpr uint8_t kFar = 16;  ///< beyond the longest distance that a code can say

/// A voxel's state in the two highest bits, the distance to another state in the rest.
struct Sweep {
  uint8_t* voxels;
  int32_t size[3];
  int64_t stride_y, stride_z;

  /// Shortens voxel (x, y, z)'s distance by its neighbours on one side: `side` is -1 for those swept before
  /// in ascending order, 1 for the others.
  void relax(int32_t x, int32_t y, int32_t z, int32_t side) {
    uint8_t& own = voxels[x + stride_y * y + stride_z * z];
    int32_t distance = own & 63;
    const auto look = [&](int32_t nx, int32_t ny, int32_t nz) {
      const uint8_t other = voxels[nx + stride_y * ny + stride_z * nz];
      distance = std::min(distance, (other ^ own) >> 6 ? 1 : (other & 63) + 1);
    };
    const int32_t x0 = std::max(x - 1, 0), x1 = std::min(x + 1, size[0] - 1);
    const int32_t y0 = std::max(y - 1, 0), y1 = std::min(y + 1, size[1] - 1);
    if (z + side >= 0 && z + side < size[2])
      for (int32_t ny = y0; ny <= y1; ++ny)
        for (int32_t nx = x0; nx <= x1; ++nx) look(nx, ny, z + side);
    if (y + side >= 0 && y + side < size[1])
      for (int32_t nx = x0; nx <= x1; ++nx) look(nx, y + side, z);
    if (x + side >= 0 && x + side < size[0]) look(x + side, y, z);
    own = uint8_t((own & 0xc0) | distance);
  }
};

}  // namespace

WalkGrid::WalkGrid(const SegmentField& field, std::pmr::memory_resource* memory) : codes(memory) {
  const auto nx = int32_t(field.voxels[0]), ny = int32_t(field.voxels[1]), nz = int32_t(field.voxels[2]);
  const size_t count = size_t(nx) * size_t(ny) * size_t(nz);
  std::pmr::vector<uint8_t> voxels(count, memory);
  size_t at = 0;
  for (int32_t z = 0; z < nz; ++z)
    for (int32_t y = 0; y < ny; ++y)
      for (int32_t x = 0; x < nx; ++x) {
        const int32_t voxel[3] = {x, y, z};
        voxels[at++] = uint8_t(uint32_t(voxel_state(field, voxel)) << 6 | kFar);
      }
  Sweep sweep{voxels.data(), {nx, ny, nz}, nx, int64_t(nx) * ny};
  for (int32_t z = 0; z < nz; ++z)
    for (int32_t y = 0; y < ny; ++y)
      for (int32_t x = 0; x < nx; ++x) sweep.relax(x, y, z, -1);
  for (int32_t z = nz; z-- > 0;)
    for (int32_t y = ny; y-- > 0;)
      for (int32_t x = nx; x-- > 0;) sweep.relax(x, y, z, 1);

  for (int a = 0; a < 3; ++a) bricks[a] = (field.voxels[a] + 3) / 4;
  codes.assign(size_t(bricks[0]) * bricks[1] * bricks[2] * 8, 0);
  at = 0;
  for (int32_t z = 0; z < nz; ++z)
    for (int32_t y = 0; y < ny; ++y)
      for (int32_t x = 0; x < nx; ++x) {
        const uint32_t voxel = voxels[at++], state = voxel >> 6;
        uint32_t code = kFirstCode[state];
        while (code < kLastCode[state] && kCodeDistance[code + 1] <= float(voxel & 63)) ++code;
        const size_t brick = size_t(x / 4) + bricks[0] * (size_t(y / 4) + bricks[1] * size_t(z / 4));
        const auto local = uint32_t(x % 4 + 4 * (y % 4) + 16 * (z % 4));
        codes[8 * brick + local / 8] |= code << (4 * (local % 8));
      }
  beyond[0] = 64 - 4;
  beyond[1] = float(64 / 4 * bricks[0] - 4);
  beyond[2] = float(64 / 16 * bricks[0] * bricks[1] - 4);
}

}  // namespace nif::kernels::cpu
