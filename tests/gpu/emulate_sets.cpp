// Asks the GPU kernels, in the emulator, about rays of every named set of an asset's own mesh, and counts
// answers that differ from the reference's; of `spherical` objects also in half precision, where some may.
// What tests/gpu/emulate.sh runs.
//
//   emulate_sets ASSET.nif MESH [RAYS]
#include <cstdio>
#include <cstdlib>

#include "bake/prepare.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/status.hpp"
#include "kernels/hip/segment_kernels.hpp"
#include "kernels/hip/spherical_half_kernels.hpp"
#include "tests/gpu/compare_half.hpp"
#include "tests/gpu/compare_sets.hpp"

namespace nif::test {
namespace {

/// In half precision. Returns how many answers are farther off than the arithmetic allows.
uint64_t compare_halves(const format::AssetView& asset, const bake::PreparedScene& prepared, uint64_t rays) {
  uint64_t beyond = 0;
  bool any = false;
  for (size_t i = 0; i < asset.objects.size(); ++i) {
    const format::ObjectView& object = asset.objects[i];
    if (object.encoding != format::kSpherical) continue;
    const std::string name(object.name);
    const kernels::hip::SphericalHalfLayout layout = kernels::hip::make_half_layout(*object.spherical);
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
      const bake::LabelledRays labelled = bake::make_ray_set(truth.source(), set, rays, 7);
      const std::vector<HalfComparison> results =
          compare_half(*object.spherical, labelled.segments, labelled.visible, kHalfKinds);
      for (size_t k = 0; k < results.size(); ++k) {
        const HalfComparison& result = results[k];
        const double all = double(std::max<size_t>(labelled.segments.size(), 1)) / 100;
        std::printf("%-16s %-14s %-7s %9zu %9llu %10llu %7.3f%% %7.3f%% %8.1e %8.1e %8.1e %7llu\n",
                    name.c_str(), std::string(bake::name_of(set)).c_str(), name_of(kHalfKinds[k]),
                    labelled.segments.size(), static_cast<unsigned long long>(result.asked),
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

/// Differing answers of all sets and variants, and those in half precision that differ too much.
uint64_t compare_all(const char* asset_path, const char* mesh_path, uint64_t rays) {
  const auto memory = format::FileMemory::load(asset_path, format::FileMemory::Mode::read);
  const format::AssetView asset = format::read_asset(memory.bytes(), asset_path);
  const mesh::Scene scene = mesh::read(mesh_path);
  const bake::PreparedScene prepared = bake::prepare(scene);
  if (prepared.objects.size() != asset.objects.size())
    throw Error(Status::mesh_mismatch, std::string(asset_path) + " was not baked from " + mesh_path);
  uint64_t all = 0;
  for (const format::ObjectView& object : asset.objects) {
    if (object.encoding != format::kSegment) continue;
    const kernels::hip::SegmentLayout layout = kernels::hip::make_layout(object.field);
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
      const bake::LabelledRays labelled = bake::make_ray_set(truth.source(), set, rays, 7);
      for (const CardWay& way : ways_for(object)) {
        const uint64_t different = count_different(object, labelled.segments, way);
        std::printf("%-16s %-14s %-18s %9zu %10llu\n", std::string(object.name).c_str(),
                    std::string(bake::name_of(set)).c_str(), way.name().c_str(), labelled.segments.size(),
                    static_cast<unsigned long long>(different));
        std::fflush(stdout);
        all += different;
      }
    }
  }
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
