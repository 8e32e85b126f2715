// Training rays: only those that a traversal leaves open, stored as the integers that the network reads.
#pragma once

#include <atomic>
#include <vector>

#include "bake/loaded/open_filter.hpp"
#include "bake/mix.hpp"
#include "bake/network/network_trainer_kernels.hpp"
#include "kernels/reference/network/samples.hpp"

namespace nif::bake {

/// The surface voxels of a field, numbered, with the corners of each.
class SurfaceCells {
 public:
  explicit SurfaceCells(const kernels::SegmentField& field);
  /// Number of the surface voxel, or kNone if the voxel is none.
  uint32_t cell_of(const uint16_t voxel[3]) const;
  static constexpr uint32_t kNone = 0xffffffffu;

  struct Cell {
    uint16_t voxel[3];
  };
  std::vector<Cell> cells;
  std::vector<std::array<uint32_t, 8>>
      corners;  ///< [cell]: index of each corner; bit 0 of the position is x, ...

 private:
  kernels::SegmentField field_;
  std::vector<uint32_t> first_;  // [mixed brick]: number of its first surface voxel
};

/// Training rays as arrays, with `samples` points each. `cells` identifies their voxels by number.
struct TrainingRays {
  uint32_t samples = 0;
  std::vector<uint32_t> cells;        ///< [ray][samples]
  std::vector<TrainingPoint> points;  ///< [ray][samples]
  std::vector<std::array<uint8_t, kernels::kGlobalInputs>> globals;
  std::vector<uint8_t> visible;
  std::vector<uint8_t> set;  ///< RaySet that the ray was drawn from
  size_t candidates = 0;     ///< of which these were open
  size_t count() const { return visible.size(); }
  void append(TrainingRays&& more);
};

/// Draws kTrainingChunk open rays for each chunk number from `first_chunk` on, in parallel, the same for any
/// number of threads. Fewer if the field has few open rays. Stops early, with what it has so far, once
/// `cancel` is set.
TrainingRays draw_training_rays(const RaySource& source, const kernels::SegmentField& field,
                                const SurfaceCells& cells, const OpenFilter& filter, const Mix& mix,
                                uint64_t seed, uint64_t first_chunk, uint64_t chunks,
                                const std::atomic<bool>& cancel);

}  // namespace nif::bake
