// Rivals that store no triangles: distances and voxels.
#include <fmt/format.h>

#include <array>

#include "mesh/volume/ray_volume.hpp"
#include "tools/common/stopwatch.hpp"
#include "tools/study/rival.hpp"

namespace nif::tools {
namespace {

class VolumeRival : public Rival {
 public:
  /// Skips the number of voxels at the start of rays that gives it the smallest error.
  VolumeRival(std::unique_ptr<volume::RayVolume> volume, const StudiedMesh& mesh, uint64_t seed)
      : volume_(std::move(volume)) {
    constexpr size_t kTried = 20'000;
    size_t fewest = SIZE_MAX;
    const bake::RaysWithTruth rays =
        bake::make_ray_set(mesh.truth.source(), bake::RaySet::inner_surface, kTried, seed + 1);
    std::vector<uint8_t> visible(rays.segments.size());
    for (const double skip : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0}) {
      volume_->ask(rays.segments, skip, visible.data());
      size_t wrong = 0;
      for (size_t i = 0; i < visible.size(); ++i) wrong += visible[i] != rays.visible[i];
      if (wrong < fewest) fewest = wrong, skip_ = skip;
    }
  }

  uint64_t resident_bytes() const override { return volume_->bytes(); }

  bake::Answerer answerer() const override {
    return [this](std::span<const kernels::Segment> segments, const bake::Answers& answers) {
      volume_->ask(segments, skip_, answers.visible);
      for (size_t i = 0; i < segments.size(); ++i) {
        answers.certain[i] = 0;
        answers.probability[i] = answers.visible[i];
      }
    };
  }

  std::vector<TimedWay> ways(const bake::RaysWithTruth& rays, bake::RaySet) const override {
    auto visible = std::make_shared<std::vector<uint8_t>>(rays.segments.size());
    return {[this, visible, &rays] {
      return seconds_of([&] { volume_->ask(rays.segments, skip_, visible->data()); });
    }};
  }

 private:
  std::unique_ptr<volume::RayVolume> volume_;
  double skip_ = 0;
};

}  // namespace

std::vector<RivalPlan> volume_rivals(const StudiedMesh& mesh, const StudyScale& scale) {
  struct Family {
    const char* name;
    std::unique_ptr<volume::RayVolume> (*make)(const mesh::Mesh&, double);
    std::vector<int> quick, full;  ///< voxels along the longest side
  };
  const std::array families{
      Family{"distance field", volume::distance_volume, {48, 96}, {32, 48, 64, 96, 128, 192}},
      Family{"voxels", volume::voxel_volume, {96, 192}, {64, 96, 128, 192, 256, 384}}};
  std::vector<RivalPlan> plans;
  for (const Family& family : families)
    for (const int voxels : scale.quick ? family.quick : family.full)
      plans.push_back({family.name, fmt::format("{} voxels along its longest side", voxels),
                       [&mesh, make = family.make, voxels, seed = scale.seed](const RivalProgress& progress) {
                         progress(0, "filling voxels");
                         const double side = double(mesh.prepared.box.longest_side()) / voxels;
                         return std::make_unique<VolumeRival>(make(mesh.scene.meshes.front(), side), mesh,
                                                              seed);
                       }});
  return plans;
}

}  // namespace nif::tools
