// Runs the GPU kernels in the emulator on rays of every named set of an asset's own mesh, and counts answers
// that differ from the reference's; for `spherical` objects also in half precision, where some may. Run by
// tests/measure/emulate_sets.sh.
//
//   emulate_sets ASSET.nif MESH [RAYS]
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "bake/ground_truth/prepare.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/file_memory.hpp"
#include "kernels/gpu/network/network_kernels.hpp"
#include "kernels/gpu/spherical/half_kernels.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "tests/gpu/emulator/compare_half.hpp"
#include "tests/gpu/emulator/compare_sets.hpp"

namespace nif::test {
namespace {

/// The work of traversing rays in their order, in waves of `lanes` rays.
class WaveCount {
 public:
  explicit WaveCount(uint32_t lanes) : lanes_(lanes) {}
  /// A wave lasts until its last ray is done.
  void add(uint64_t steps) {
    longest_ = std::max(longest_, steps);
    if (++rays_ % lanes_ == 0) finish_wave();
  }
  double steps_of_wave() {
    if (rays_ % lanes_ != 0) finish_wave();
    return double(steps_) / double(std::max<uint64_t>(waves_, 1));
  }

 private:
  void finish_wave() {
    steps_ += longest_;
    longest_ = 0;
    ++waves_;
  }
  uint32_t lanes_;
  uint64_t rays_ = 0, longest_ = 0, steps_ = 0, waves_ = 0;
};

/// Cost of the rays of a set with one kind of traversal: steps, and what each loads.
struct TraversalCost {
  const char* name;
  uint64_t steps = 0, loads = 0, bytes = 0;
  WaveCount of_32{32}, of_64{64};

  void add_ray(uint64_t count) {
    steps += count;
    of_32.add(count);
    of_64.add(count);
  }
};

/// Counts what the reference reads to find a cell.
void count_loads(const kernels::SegmentField& field, const kernels::Piece& piece, TraversalCost& cost) {
  const int32_t voxel[3] = {piece.low[0] >> field.levels, piece.low[1] >> field.levels,
                            piece.low[2] >> field.levels};
  cost.loads += 1;
  cost.bytes += sizeof(*field.brick_table);
  if (kernels::voxel_address(field, voxel).entry < kernels::kFirstMixedBrick) return;
  cost.loads += 1;
  cost.bytes += sizeof(*field.brick_states);
  if (kernels::voxel_state(field, voxel) != kernels::VoxelState::surface) return;
  uint32_t depth = 0;
  while (piece.size << depth < 1 << field.levels) ++depth;
  const uint32_t words = 2 + depth - (depth > 0 && piece.word == kernels::kEmptyChild);
  cost.loads += words;
  cost.bytes += words * sizeof(uint32_t);
}

/// Counts the steps of the traversal with and without empty-space skipping, and how long waves of rays in
/// their order wait for the longest ray.
void count_steps(const format::AssetView& asset, const bake::PreparedScene& prepared, uint64_t rays) {
  bool any = false;
  std::string left;  // lines of another table
  for (size_t i = 0; i < asset.objects.size(); ++i) {
    const format::ObjectView& object = asset.objects[i];
    if (!object.is<kernels::SegmentField>()) continue;
    if (!any)
      std::printf("\n%-16s %-14s %-16s %9s %9s %9s %9s %9s\n", "object", "set", "traversal", "steps", "of 32",
                  "of 64", "loads", "bytes");
    any = true;
    const kernels::SegmentField& field = object.as<kernels::SegmentField>();
    const kernels::cpu::TraversalGrid grid(field, std::pmr::new_delete_resource());
    const kernels::gpu::DeviceSegmentField on_gpu{field, grid.view(), {}, nullptr};
    const bake::GroundTruth truth(prepared.objects[i]);
    for (const bake::RaySet set : bake::kRaySets) {
      const bake::RaysWithTruth drawn = bake::make_ray_set(truth.source(), set, rays, 7);
      uint64_t open = 0, hard = 0, runs = 0;
      TraversalCost pieces{"cell by cell"}, skips{"skipping"};
      const auto no_interval = [](uint32_t, const kernels::Interval&) {};
      for (const kernels::Segment& segment : drawn.segments) {
        kernels::TraversalResult traversal;
        uint64_t steps = 0;
        kernels::follow_segment(field, segment, traversal, no_interval, [&](const kernels::Piece& piece) {
          ++steps;
          count_loads(field, piece, pieces);
        });
        pieces.add_ray(steps);
        if (traversal.verdict == kernels::Verdict::open) {
          ++open;
          hard += traversal.interval_count > kernels::gpu::kKeptIntervals;
          runs += traversal.interval_count;
        }
        steps = 0;
        kernels::gpu::traverse_skipping(on_gpu, on_gpu.traversal, segment, traversal, no_interval,
                                        [&](uint32_t words) {
                                          ++steps;
                                          skips.loads += words;
                                          skips.bytes += words * sizeof(uint32_t);
                                        });
        skips.add_ray(steps);
      }
      const double count = double(std::max<size_t>(drawn.segments.size(), 1));
      for (TraversalCost* cost : {&pieces, &skips})
        std::printf("%-16s %-14s %-16s %9.2f %9.2f %9.2f %9.2f %9.1f\n", std::string(object.name).c_str(),
                    std::string(bake::name_of(set)).c_str(), cost->name, double(cost->steps) / count,
                    cost->of_32.steps_of_wave(), cost->of_64.steps_of_wave(), double(cost->loads) / count,
                    double(cost->bytes) / count);
      std::fflush(stdout);
      char line[160];
      std::snprintf(line, sizeof(line), "%-16s %-14s %9zu %9llu %9llu %9.2f\n",
                    std::string(object.name).c_str(), std::string(bake::name_of(set)).c_str(),
                    drawn.segments.size(), static_cast<unsigned long long>(open),
                    static_cast<unsigned long long>(hard),
                    double(runs) / double(std::max<uint64_t>(open, 1)));
      left += line;
    }
  }
  if (any)
    std::printf("\n%-16s %-14s %9s %9s %9s %9s\n%s", "object", "set", "rays", "open", "hard", "runs",
                left.c_str());
}

/// Compares in half precision. Returns the number of answers that are farther off than the arithmetic allows.
uint64_t compare_halves(const format::AssetView& asset, const bake::PreparedScene& prepared, uint64_t rays) {
  uint64_t beyond = 0;
  bool any = false;
  for (size_t i = 0; i < asset.objects.size(); ++i) {
    const format::ObjectView& object = asset.objects[i];
    if (!object.is<kernels::SphericalField>()) continue;
    const std::string name(object.name);
    const kernels::gpu::SphericalHalfLayout layout =
        kernels::gpu::make_half_layout(object.as<kernels::SphericalField>());
    if (!layout.fits) {
      std::printf("\n%s has no kernel in half precision: its networks are too wide\n", name.c_str());
      continue;
    }
    std::printf("\n%s in half precision: shared memory of a block: networks %u bytes\n", name.c_str(),
                layout.bytes);
    if (!any)
      std::printf("%-16s %-14s %-7s %9s %9s %10s %8s %8s %8s %8s %8s %7s\n", "object", "set", "kernels",
                  "rays", "asked", "different", "wrong, s", "wrong, h", "mean dp", "most dp", "most dz",
                  "beyond");
    any = true;
    const bake::GroundTruth truth(prepared.objects[i]);
    for (const bake::RaySet set : bake::kRaySets) {
      const bake::RaysWithTruth drawn = bake::make_ray_set(truth.source(), set, rays, 7);
      const std::vector<HalfComparison> results =
          compare_half(object.as<kernels::SphericalField>(), drawn.segments, drawn.visible, kHalfKinds);
      for (size_t k = 0; k < results.size(); ++k) {
        const HalfComparison& result = results[k];
        const double all = double(std::max<size_t>(drawn.segments.size(), 1)) / 100;
        std::printf("%-16s %-14s %-7s %9zu %9llu %10llu %7.3f%% %7.3f%% %8.1e %8.1e %8.1e %7llu\n",
                    name.c_str(), std::string(bake::name_of(set)).c_str(), name_of(kHalfKinds[k]),
                    drawn.segments.size(), static_cast<unsigned long long>(result.asked),
                    static_cast<unsigned long long>(result.different), double(result.wrong_single) / all,
                    double(result.wrong_half) / all, result.mean_moved, result.most_moved,
                    result.most_log_odds, static_cast<unsigned long long>(result.beyond));
        std::fflush(stdout);
        beyond += result.beyond;
      }
    }
  }
  return beyond;
}

/// Number of differing answers over all sets and variants, and of those in half precision that differ too
/// much.
uint64_t compare_all(const char* asset_path, const char* mesh_path, uint64_t rays) {
  const auto memory = format::FileMemory::load(asset_path, format::FileMemory::Mode::read);
  const format::AssetView asset = format::read_asset(memory.bytes(), asset_path);
  const mesh::Scene scene = mesh::read(mesh_path);
  const bake::PreparedScene prepared = bake::prepare(scene);
  if (prepared.objects.size() != asset.objects.size())
    throw Error(Status::mesh_mismatch, std::string(asset_path) + " was not baked from " + mesh_path);
  uint64_t all = 0;
  for (const format::ObjectView& object : asset.objects) {
    if (!object.is<kernels::SegmentField>()) continue;
    const kernels::gpu::SegmentLayout layout = kernels::gpu::make_layout(object.as<kernels::SegmentField>());
    std::printf("%s: shared memory of a block: network ", std::string(object.name).c_str());
    if (layout.tiled)
      std::printf("%u bytes\n", layout.bytes);
    else
      std::printf("too wide for matrix instructions\n");
  }
  std::printf("%-16s %-14s %-18s %9s %10s\n", "object", "set", "kernels", "rays", "different");
  for (size_t i = 0; i < asset.objects.size(); ++i) {
    const format::ObjectView& object = asset.objects[i];
    const bake::GroundTruth truth(prepared.objects[i]);
    for (const bake::RaySet set : bake::kRaySets) {
      const bake::RaysWithTruth drawn = bake::make_ray_set(truth.source(), set, rays, 7);
      for (const EmulatedWay& way : ways_for(object)) {
        const uint64_t different = count_different(object, drawn.segments, way);
        std::printf("%-16s %-14s %-18s %9zu %10llu\n", std::string(object.name).c_str(),
                    std::string(bake::name_of(set)).c_str(), way.name().c_str(), drawn.segments.size(),
                    static_cast<unsigned long long>(different));
        std::fflush(stdout);
        all += different;
      }
    }
  }
  count_steps(asset, prepared, rays);
  return all + compare_halves(asset, prepared, rays);
}

}  // namespace
}  // namespace nif::test

int main(int argc, char** argv) {
  char* end = nullptr;
  const uint64_t rays = argc > 3 ? std::strtoull(argv[3], &end, 10) : 1'000'000;
  if (argc < 3 || argc > 4 || rays == 0 || (end && *end != 0)) {
    std::fputs("usage: emulate_sets ASSET.nif MESH [RAYS]\n", stderr);
    return int(nif::Status::usage);
  }
  try {
    return nif::test::compare_all(argv[1], argv[2], rays) == 0 ? 0 : 1;
  } catch (const nif::Error& error) {
    std::fprintf(stderr, "emulate_sets: %s\n", error.what());
    return int(error.status());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "emulate_sets: %s\n", error.what());
    return int(nif::Status::internal);
  }
}
