#include "bake/bake.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bake/occupancy.hpp"
#include "bake/prepare.hpp"
#include "bake/report.hpp"
#include "formats/nif/writer.hpp"
#include "formats/status.hpp"

namespace nif::bake {
namespace {

struct PresetRow {
  Preset preset;
  std::string_view name;
  ResolvedOptions options;
};

// One part for each kind of query. Lines from within the volume are left out: they pass through surface
// voxels as other lines do, and on the dragon nine in ten of them are certain, so finding the rest costs more
// than it teaches.
constexpr Mix kDefaultMix{0.30, 0.35, 0.0, 0.35, 0.0};

// What `balanced` comes to stands in docs/results/dragon.md.
constexpr PresetRow kPresets[] = {
    {Preset::fast, "fast", {64, 8, 2, 8.0f, {32, 2}, kDefaultMix, 400, 12'000'000}},
    {Preset::balanced, "balanced", {96, 8, 2, 8.0f, {32, 2}, kDefaultMix, 2200, 110'000'000}},
    {Preset::high, "high", {128, 12, 2, 8.0f, {48, 2}, kDefaultMix, 4000, 500'000'000}},
};

/// Objects with at least so many triangles get the preset's resolution. Below, surface detail is what
/// triangles there are, and the voxels' size follows the triangles': resolution falls with the square root of
/// their number.
constexpr double kFullTriangles = 150'000;
constexpr uint32_t kMinResolution = 16;
constexpr uint64_t kMinRays = 2'000'000;
constexpr uint64_t kRaysPerRound = 3'000'000;

uint32_t resolution_for(uint64_t triangles, uint32_t full, double scale) {
  const double share = std::min(1.0, std::sqrt(double(triangles) / kFullTriangles));
  const double wanted = std::max(full * share, double(std::min(kMinResolution, full))) * scale;
  return std::clamp(uint32_t(std::lround(wanted)), 2u, kernels::kMaxVoxels);
}

/// The object with its occupancy and zero features.
format::Object lay_out(const Prepared& prepared, const ResolvedOptions& options, uint32_t resolution,
                       ObjectReport& report) {
  format::Object object;
  object.name = format::clean_name(prepared.source->name);
  object.aabb_min = prepared.box.min;
  object.aabb_max = prepared.box.max;
  object.bias = prepared.bias;
  object.triangles = uint32_t(std::min<uint64_t>(prepared.surface.triangles.size(), 0xffffffffu));
  object.samples = options.samples;
  object.length_scale = options.length_scale;
  const auto& [positions, triangles, slivers, cleaned] = prepared.surface;
  const Grid grid = make_grid(prepared.box, resolution);
  const Occupancy occupancy =
      classify(grid, positions, voxelize(grid, positions, triangles), prepared.closed);
  store_occupancy(occupancy, options.features_per_corner, object);

  report.name = object.name;
  report.triangles = triangles.size();
  report.cleaned = cleaned;
  report.closed_components = prepared.closed.count();
  report.open_components = prepared.closed.open_components;
  report.voxels = grid.voxels;
  report.surface_voxels = occupancy.surface_voxels;
  report.inside_voxels = occupancy.inside_voxels;
  report.unknown_voxels = occupancy.unknown_voxels;
  return object;
}

TrainingOptions training_options(const ResolvedOptions& resolved, const BakeOptions& options,
                                 uint32_t corners) {
  TrainingOptions training;
  training.network = resolved.network;
  training.mix = resolved.mix;
  training.seed = options.seed;
  training.spoil_at_step = options.spoil_at_step;
  const double rays =
      std::clamp(resolved.rays_per_corner * corners, double(kMinRays), double(resolved.max_rays));
  training.rays = uint64_t(rays * options.effort.value_or(1.0));
  // Short trainings need their steps more than large batches.
  training.batch = training.rays >= 60'000'000   ? 8192
                   : training.rays >= 20'000'000 ? 4096
                   : training.rays >= 6'000'000  ? 2048
                                                 : 1024;
  training.passes = 6;
  training.rays_per_round =
      std::clamp<uint64_t>(training.rays / training.passes, 16 * training.batch, kRaysPerRound);
  return training;
}

/// A network of the right shape and size, all zeros, to measure what a file will take.
format::Network blank_network(const ResolvedOptions& options) {
  format::Network network;
  uint32_t inputs = options.samples * options.features_per_corner + kernels::kGlobalInputs;
  for (uint32_t l = 0; l <= options.network.hidden_layers; ++l) {
    const uint32_t outputs = l == options.network.hidden_layers ? 1 : options.network.width;
    network.layers.push_back(
        {inputs, outputs, 0, std::vector<int32_t>(outputs), std::vector<int8_t>(outputs * inputs)});
    inputs = outputs;
  }
  return network;
}

/// Reserve for what the metadata will say once accuracy has been measured.
constexpr uint64_t kMetadataBytes = 1024, kMetadataBytesPerObject = 1536;

class Baker {
 public:
  Baker(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
        const std::atomic<bool>& cancel)
      : scene_(scene), options_(options), resolved_(resolve(options)), callback_(callback), cancel_(cancel) {}

  BakeResult run() {
    choose_objects();
    double scale = 1;
    lay_out_all(scale);
    while (options_.max_bytes && estimated_bytes() > *options_.max_bytes) {
      scale *= 0.95;
      if (resolved_.resolution * scale < 4) {
        throw Error(Status::target_not_met,
                    fmt::format("--max-bytes {} cannot be reached: the coarsest grids take {} bytes",
                                *options_.max_bytes, estimated_bytes()));
      }
      lay_out_all(scale);
    }
    for (size_t i = 0; i < prepared_.size(); ++i) bake_object(i);
    for (const ObjectReport& report : result_.objects) result_.triangles += report.triangles;
    check_error();
    result_.asset.metadata = make_metadata(scene_, options_, result_);
    return std::move(result_);
  }

 private:
  void choose_objects() {
    report(BakeProgress::Stage::preparing, scene_.meshes.front().name, 0, 0, 0, 0);
    PreparedScene prepared = prepare(scene_);
    prepared_ = std::move(prepared.objects);
    result_.notes = std::move(prepared.notes);
    for (uint32_t i : prepared.instances) {
      const mesh::Instance& instance = scene_.instances[i];
      result_.asset.instances.push_back(
          {format::clean_name(instance.name), prepared.object_of[instance.mesh], instance.transform});
    }
    // Progress is shared out by what training will roughly cost.
    for (const Prepared& p : prepared_)
      weights_.push_back(std::clamp(double(p.surface.triangles.size()), 10e3, kFullTriangles));
  }

  void lay_out_all(double scale) {
    result_.asset.objects.clear();
    result_.objects.assign(prepared_.size(), {});
    for (size_t i = 0; i < prepared_.size(); ++i) {
      if (cancel_) throw Error(Status::interrupted, "the bake was cancelled");
      const uint32_t resolution =
          resolution_for(prepared_[i].surface.triangles.size(), resolved_.resolution, scale);
      result_.asset.objects.push_back(lay_out(prepared_[i], resolved_, resolution, result_.objects[i]));
      result_.asset.objects.back().network = uint32_t(i);
    }
  }

  uint64_t estimated_bytes() {
    result_.asset.networks.assign(prepared_.size(), blank_network(resolved_));
    const uint64_t bytes = format::encode(result_.asset).size();
    result_.asset.networks.clear();
    return bytes + kMetadataBytes + kMetadataBytesPerObject * prepared_.size();
  }

  void bake_object(size_t index) {
    const Prepared& prepared = prepared_[index];
    format::Object& object = result_.asset.objects[index];
    ObjectReport& report_of = result_.objects[index];
    const GroundTruth truth(prepared);
    const RaySource& source = truth.source();

    const TrainingOptions training = training_options(resolved_, options_, object.corners);
    report_of.training_rays = training.rays;
    report(BakeProgress::Stage::training, object.name, index, 0.03, 0, 0);
    TrainingResult trained = train(
        source, object, training,
        [&](const TrainingProgress& p) {
          const double share = double(p.rays_done) / double(p.rays_total);
          report(BakeProgress::Stage::training, object.name, index, 0.03 + 0.87 * share, p.loss, p.error);
        },
        cancel_);
    report_of.recoveries = trained.recoveries;
    result_.asset.networks.push_back(std::move(trained.network));

    const kernels::SegmentField field = format::field_of(object, result_.asset.networks.back());
    if (options_.evaluation_rays == 0) return;
    const uint64_t share = std::max<uint64_t>(20'000, options_.evaluation_rays / prepared_.size());
    const size_t count = size_t(std::min(share, options_.evaluation_rays));
    for (RaySet set : kRaySets) {
      if (cancel_) throw Error(Status::interrupted, "the bake was cancelled");
      report(BakeProgress::Stage::measuring, object.name, index, 0.90 + 0.02 * double(set), 0, 0);
      // A seed apart from the one that `nif eval` uses by default, and apart from training's streams.
      const LabelledRays labelled = make_ray_set(source, set, count, options_.seed + 0x6d65617375726564);
      report_of.sets[size_t(set)] = evaluate(labelled, reference_answerer(field));
      result_.sets[size_t(set)] += report_of.sets[size_t(set)];
    }
  }

  void check_error() const {
    if (!options_.max_error) return;
    for (RaySet set : kRaySets) {
      const double error = result_.sets[size_t(set)].error();
      if (error <= *options_.max_error) continue;
      throw Error(
          Status::target_not_met,
          fmt::format(
              "--max-error {:.4f}% is not met: {:.4f}% of {} are answered wrongly; try a higher preset or "
              "--resolution",
              *options_.max_error * 100, error * 100, name_of(set)));
    }
  }

  void report(BakeProgress::Stage stage, std::string_view name, size_t index, double share, double loss,
              double error) {
    double done = 0, all = 0;
    for (size_t i = 0; i < weights_.size(); ++i) {
      done += i < index ? weights_[i] : i == index ? weights_[i] * share : 0;
      all += weights_[i];
    }
    const double fraction = stage == BakeProgress::Stage::preparing || all == 0 ? 0 : done / all;
    if (callback_)
      callback_({stage, name, index, std::max<size_t>(prepared_.size(), 1), fraction, loss, error});
  }

  const mesh::Scene& scene_;
  const BakeOptions& options_;
  const ResolvedOptions resolved_;
  const BakeCallback& callback_;
  const std::atomic<bool>& cancel_;
  std::vector<Prepared> prepared_;
  std::vector<double> weights_;
  BakeResult result_;
};

}  // namespace

std::string_view name_of(Preset preset) {
  for (const PresetRow& row : kPresets) {
    if (row.preset == preset) return row.name;
  }
  return {};
}

std::optional<Preset> preset_named(std::string_view name) {
  for (const PresetRow& row : kPresets) {
    if (row.name == name) return row.preset;
  }
  return std::nullopt;
}

ResolvedOptions resolve(const BakeOptions& options) {
  ResolvedOptions resolved{};
  for (const PresetRow& row : kPresets) {
    if (row.preset == options.preset) resolved = row.options;
  }
  if (options.resolution) resolved.resolution = *options.resolution;
  if (options.mix) resolved.mix = *options.mix;
  return resolved;
}

BakeResult bake(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                const std::atomic<bool>& cancel) {
  return Baker(scene, options, callback, cancel).run();
}

}  // namespace nif::bake
