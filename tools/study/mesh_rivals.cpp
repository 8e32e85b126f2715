// Rivals that are the mesh itself, or a simplified one.
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <numeric>
#include <optional>

#include "bake/ground_truth/embree_baseline.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/clean.hpp"
#include "mesh/halfedge/decimate.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/stopwatch.hpp"
#include "tools/study/rival.hpp"

namespace nif::tools {
namespace {

using bake::EmbreeBuild;
using bake::EmbreeCall;
using kernels::Segment;

class EmbreeRival : public Rival {
 public:
  EmbreeRival(const mesh::CleanMesh& mesh, EmbreeBuild build) : scene_(mesh, build) {}

  uint64_t resident_bytes() const override {
    const bake::EmbreeScene::Memory memory = scene_.memory();
    return uint64_t(memory.bvh + memory.buffers);
  }

  bake::Answerer answerer() const override {
    return [this](std::span<const Segment> segments, const bake::Answers& answers) {
      std::vector<uint32_t> rays(segments.size());
      std::iota(rays.begin(), rays.end(), 0u);
      std::vector<float> tmin, tmax;
      for (const Segment& segment : segments) tmin.push_back(segment.tmin), tmax.push_back(segment.tmax);
      bake::ask_parts(scene_, EmbreeCall::occluded1, segments, rays, tmin.data(), tmax.data(),
                      answers.visible);
      for (size_t i = 0; i < segments.size(); ++i) {
        answers.certain[i] = 0;
        answers.probability[i] = answers.visible[i];
      }
    };
  }

  std::vector<TimedWay> ways(const bake::RaysWithTruth& rays, bake::RaySet set) const override {
    std::vector<TimedWay> ways;
    const auto laid_out = std::make_shared<bake::EmbreeRays>(rays.segments.size());
    for (const EmbreeCall call : bake::kEmbreeCalls) {
      if (bake::finds_first_hits(call)) continue;
      // For incoherent rays, the coherence hint halves the speed.
      for (const bool coherent : {false, true}) {
        if (coherent && (!bake::is_coherent(set) || bake::takes_single_rays(call))) continue;
        ways.push_back([this, laid_out, call, coherent, &rays] {
          laid_out->lay_out(rays.segments, call);
          tbb::task_arena arena(1);
          return seconds_of([&] { arena.execute([&] { laid_out->ask(scene_, coherent); }); });
        });
      }
    }
    return ways;
  }

 private:
  bake::EmbreeScene scene_;
};

/// A simplified mesh, made when it is first needed.
class Simplified {
 public:
  Simplified(const mesh::Mesh& mesh, uint64_t triangles, bool fast)
      : mesh_(mesh), triangles_(triangles), fast_(fast) {}

  /// Throws Error(target_not_met) if this number of triangles cannot be reached.
  const mesh::Scene& scene(const RivalProgress& progress) {
    if (!made_) {
      mesh::Mesh simple = reduce(false, progress);
      // Boundaries stay fixed, unless they prevent the reduction.
      if (misses(simple)) simple = reduce(true, progress);
      if (misses(simple))
        throw Error(
            Status::target_not_met,
            fmt::format("{} triangles were requested, but {} are left: no more edges can be collapsed",
                        triangles_, simple.triangles.size()));
      made_.emplace();
      made_->meshes.push_back(std::move(simple));
      made_->instances.push_back({.name = made_->meshes.front().name});
    }
    return *made_;
  }

 private:
  mesh::Mesh reduce(bool move_boundary, const RivalProgress& progress) const {
    const halfedge::DecimateOptions options{triangles_, std::nullopt, move_boundary};
    progress(0, "simplifying");
    return fast_ ? halfedge::decimate_fast(mesh_, options)
                 : halfedge::decimate(
                       mesh_, options, [&](double fraction) { progress(fraction, "simplifying"); },
                       interruption());
  }
  bool misses(const mesh::Mesh& simple) const {
    return simple.triangles.size() > triangles_ + triangles_ / 20 + 10;
  }

  const mesh::Mesh& mesh_;
  uint64_t triangles_;
  bool fast_;
  std::optional<mesh::Scene> made_;
};

/// "10,000 triangles", for 1,000 to a million.
std::string named(uint64_t triangles) {
  return fmt::format("{},{:03} triangles", triangles / 1000, triangles % 1000);
}

}  // namespace

std::vector<RivalPlan> mesh_rivals(const StudiedMesh& mesh, const StudyScale& scale) {
  std::vector<RivalPlan> plans;
  const auto embree = [](const mesh::CleanMesh& clean, EmbreeBuild build) {
    return std::make_unique<EmbreeRival>(clean, build);
  };
  const std::pair<EmbreeBuild, std::string> forms[] = {{EmbreeBuild::standard, "Embree"},
                                                       {EmbreeBuild::compact, "Embree compact"}};
  for (const auto& [build, name] : forms)
    plans.push_back({"all triangles: " + name, "all triangles",
                     [&mesh, embree, build = build](const RivalProgress& progress) {
                       progress(0, "building");
                       return embree(mesh.prepared.surface, build);
                     }});
  const std::vector<uint64_t> sizes =
      scale.quick ? std::vector<uint64_t>{4'000, 25'000}
                  : std::vector<uint64_t>{1'500, 4'000, 10'000, 25'000, 60'000, 150'000};
  bake::BakeOptions exact;
  exact.encoding = "exact";
  exact.preset = scale.quick ? bake::Preset::fast : bake::Preset::balanced;
  exact.seed = scale.seed;
  exact.evaluation_rays = 0;
  for (const auto& [fast, method] : {std::pair(false, "OpenMesh"), std::pair(true, "meshoptimizer")}) {
    for (const uint64_t triangles : sizes) {
      if (double(triangles) > 0.9 * double(mesh.prepared.surface.triangles.size())) continue;
      const auto simplified = std::make_shared<Simplified>(mesh.scene.meshes.front(), triangles, fast);
      for (const auto& [build, name] : forms)
        plans.push_back({fmt::format("{}: {}", method, name), named(triangles),
                         [simplified, embree, build = build](const RivalProgress& progress) {
                           return embree(mesh::clean(simplified->scene(progress).meshes.front()), build);
                         }});
      plans.push_back({fmt::format("{}: exact", method), named(triangles),
                       [simplified, exact](const RivalProgress& progress) {
                         return make_asset_rival(simplified->scene(progress), exact, progress);
                       }});
    }
  }
  return plans;
}

}  // namespace nif::tools
