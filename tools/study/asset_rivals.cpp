// Rivals that are assets, or use one.
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "formats/nif/writer.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/measured_asset.hpp"
#include "tools/common/proofs_first.hpp"
#include "tools/common/runtime_handles.hpp"
#include "tools/common/segment_query.hpp"
#include "tools/common/stopwatch.hpp"
#include "tools/study/rival.hpp"
#include "tools/study/study.hpp"

namespace nif::tools {
namespace {

using bake::EmbreeCall;
using kernels::Segment;

/// A file in the runtime, on a device with one thread.
class LoadedAsset {
 public:
  explicit LoadedAsset(const std::vector<std::byte>& file)
      : file_bytes_(file.size()), resident_bytes_(resident_bytes(file)) {
    check(nifNewDevice("threads=1", nullptr, &device_.handle));
    check(nifLoadAssetMemory(device_.handle, file.data(), file.size(), NIF_LOAD_COPY, &asset_.handle));
    check(nifNewScene(device_.handle, &scene_.handle));
    check(nifAddAsset(scene_.handle, asset_.handle, nullptr, nullptr, nullptr));
    check(nifCommitScene(scene_.handle));
  }

  NifScene scene() const { return scene_.handle; }
  uint64_t file_bytes() const { return file_bytes_; }
  uint64_t resident() const { return resident_bytes_; }

 private:
  uint64_t file_bytes_, resident_bytes_;
  Device device_;
  Asset asset_;
  Scene scene_;
};

std::vector<std::byte> baked(const mesh::Scene& scene, const bake::BakeOptions& options,
                             const RivalProgress& progress) {
  const auto told = [&](const bake::BakeProgress& p) { progress(p.fraction, "baking"); };
  return format::encode(bake::bake(scene, options, told, interruption()).asset);
}

class AssetRival : public Rival {
 public:
  explicit AssetRival(const std::vector<std::byte>& file) : asset_(file) {}

  uint64_t resident_bytes() const override { return asset_.resident(); }
  uint64_t file_bytes() const override { return asset_.file_bytes(); }
  bake::Answerer answerer() const override { return runtime_answerer(asset_.scene()); }

  std::vector<TimedWay> ways(const bake::RaysWithTruth& rays, bake::RaySet) const override {
    auto laid_out = std::make_shared<std::vector<NifRay>>();
    for (const Segment& s : rays.segments)
      laid_out->push_back({{s.origin[0], s.origin[1], s.origin[2]},
                           s.tmin,
                           {s.direction[0], s.direction[1], s.direction[2]},
                           s.tmax});
    auto visible = std::make_shared<std::vector<uint8_t>>(rays.segments.size());
    return {[scene = asset_.scene(), laid_out, visible] {
      const NifRays asked = nifMakeRays(laid_out->data(), laid_out->size());
      auto answers = nifkit::sized<NifAnswers>();
      answers.visible = visible->data();
      return seconds_of([&] { check(nifQuery(scene, &asked, &answers)); });
    }};
  }

 private:
  LoadedAsset asset_;
};

/// Planes that prove most answers, and Embree on the whole mesh for the rays that they leave open.
class ProofsThenEmbree : public Rival {
 public:
  ProofsThenEmbree(const std::vector<std::byte>& file, const mesh::CleanMesh& mesh)
      : asset_(file), embree_(mesh, bake::EmbreeBuild::standard) {}

  uint64_t resident_bytes() const override {
    const bake::EmbreeScene::Memory memory = embree_.memory();
    return asset_.resident() + uint64_t(memory.bvh + memory.buffers);
  }
  uint64_t file_bytes() const override { return asset_.file_bytes(); }
  bake::Answerer answerer() const override { return proofs_first_answerer(asset_.scene(), embree_); }

  std::vector<TimedWay> ways(const bake::RaysWithTruth& rays, bake::RaySet) const override {
    std::vector<TimedWay> ways;
    auto asked = std::make_shared<ProofsFirst>();
    auto visible = std::make_shared<std::vector<uint8_t>>(rays.segments.size());
    for (const EmbreeCall call : {EmbreeCall::occluded1, EmbreeCall::occluded16, EmbreeCall::occluded1M})
      ways.push_back([this, asked, visible, call, &rays] {
        tbb::task_arena arena(1);
        auto answers = nifkit::sized<NifAnswers>();
        answers.visible = visible->data();
        return seconds_of([&] {
          arena.execute([&] {
            asked->ask(asset_.scene(), rays_of(rays.segments), answers, rays.segments, embree_, call);
          });
        });
      });
    return ways;
  }

 private:
  LoadedAsset asset_;
  bake::EmbreeScene embree_;
};

bake::BakeOptions options_of(std::string_view encoding, const StudyScale& scale) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.preset = scale.quick ? bake::Preset::fast : bake::Preset::balanced;
  options.seed = scale.seed;
  options.evaluation_rays = 0;  // the study queries all rivals with the same rays
  return options;
}

}  // namespace

std::unique_ptr<Rival> make_asset_rival(const mesh::Scene& scene, const bake::BakeOptions& options,
                                        const RivalProgress& progress) {
  return std::make_unique<AssetRival>(baked(scene, options, progress));
}

std::vector<RivalPlan> asset_rivals(const StudiedMesh& mesh, const StudyScale& scale) {
  std::vector<RivalPlan> plans;
  const auto add = [&](const std::string& family, const std::string& size, const bake::BakeOptions& options) {
    plans.push_back({family, size, [&mesh, options](const RivalProgress& progress) {
                       return make_asset_rival(mesh.scene, options, progress);
                     }});
  };
  for (const double factor : scale.quick ? std::vector{0.5, 1.0}
                                         : std::vector{0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6}) {
    bake::BakeOptions options = options_of("segment", scale);
    options.scale = factor;
    add("segment", fmt::format("scale {:g}", factor), options);
    if (factor > 2)
      plans.back().while_below = kBudgets.back();  // for some meshes, the sizes before are still small
  }
  add("exact", "all triangles", options_of("exact", scale));
  add("bvh", "all triangles", options_of("bvh", scale));
  plans.push_back({"proof, then Embree", "all triangles",
                   [&mesh, options = options_of("proof", scale)](const RivalProgress& progress) {
                     return std::make_unique<ProofsThenEmbree>(baked(mesh.scene, options, progress),
                                                               mesh.prepared.surface);
                   }});
  bake::BakeOptions paper = options_of("spherical", scale);
  paper.preset = bake::Preset::paper;
  if (scale.quick) paper.effort = 0.01;
  add("spherical", scale.quick ? "1 % of its training" : "as published", paper);
  return plans;
}

}  // namespace nif::tools
