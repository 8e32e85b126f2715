// Defines what a preset means for `segment`, and the order of steps: lay out, train, set the decision
// threshold. The size of a file is measured before training, with a network of zeros and uncoded features:
// the final size is no larger.
#include "bake/encodings/bake_segment.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bake/encoder.hpp"
#include "bake/network/corner_features.hpp"
#include "bake/network/network_trainer.hpp"
#include "bake/report.hpp"
#include "bake/work.hpp"
#include "kernels/reference/encodings/reference_segment.hpp"

namespace nif::bake {
namespace {

/// What a preset means.
struct SegmentShape : GridShape {
  uint32_t samples, features_per_corner;
  float length_scale;
  NetworkOptions network;
  double rays_per_corner;  ///< training rays per corner that has features
  uint64_t max_rays;
};

// docs/results/dragon.md shows what `balanced` gives.
constexpr std::pair<Preset, SegmentShape> kSegmentShapes[] = {
    {Preset::fast, {{32, 3, 2.0, 110'000}, 4, 2, 48.0f, {32, 2}, 1000, 12'000'000}},
    {Preset::balanced, {{48, 2, 1.5, 200'000}, 4, 2, 32.0f, {32, 2}, 2200, 110'000'000}},
    {Preset::high, {{64, 3, 0.5, 450'000}, 8, 2, 48.0f, {48, 2}, 10000, 500'000'000}}};

// One part for each kind of query. Lines from within the volume are left out: they pass through surface
// voxels as other lines do, and on the dragon nine in ten of them are certain, so finding the rest costs more
// than it teaches.
constexpr Mix kSegmentMix{0.30, 0.35, 0.0, 0.35, 0.0};

constexpr uint64_t kLeastSegmentRays = 2'000'000;
constexpr uint64_t kSegmentRaysPerRound = 3'000'000;

SegmentShape shape_for(const BakeOptions& options) {
  SegmentShape shape = kSegmentShapes[1].second;
  for (const auto& [preset, known] : kSegmentShapes)
    if (preset == options.preset) shape = known;
  if (options.resolution) set_resolution(*options.resolution, shape);
  return shape;
}

/// A network of the right shape and size, all zeros, to measure the size of a file.
format::Mlp blank_network(const SegmentShape& shape) {
  format::Mlp network;
  uint32_t inputs = kernels::input_count(shape.samples, shape.features_per_corner);
  for (uint32_t l = 0; l <= shape.network.hidden_layers; ++l) {
    const uint32_t outputs = l == shape.network.hidden_layers ? 1 : shape.network.width;
    network.layers.push_back(
        {inputs, outputs, 0, std::vector<int32_t>(outputs), std::vector<int8_t>(outputs * inputs)});
    inputs = outputs;
  }
  return network;
}

class SegmentEncoder final : public Encoder {
 public:
  explicit SegmentEncoder(const BakeOptions& options) : options_(options), shape_(shape_for(options)) {}

  std::string_view name() const override { return kernels::encoding_of_field<kernels::SegmentField>().name; }
  std::string_view noun() const override { return "a field"; }
  std::string_view smallest() const override { return "the coarsest grids"; }
  Holes holes() const override { return Holes::any; }
  bool has_scale(double scale) const override { return bake::has_scale(shape_, scale); }

  void lay_out(const Prepared& prepared, double scale, bool bounded, bool, Form& form) const override {
    const uint64_t triangles = prepared.surface.triangles.size(), budget = budget_for(shape_, triangles);
    form.scale = fit_budget(shape_, scale * options_.scale, bounded && options_.scale == 1, triangles,
                            [&](double grid_scale) {
                              lay_out(prepared, grid_scale, form);
                              return double(form.cost.bytes) / double(budget);
                            });
  }

  double work(const Form& form, const RaySource& source, uint64_t seed) const override {
    return work_of(std::get<kernels::SegmentField>(form.field()), source, seed);
  }

  std::string train(const TrainingTask& task) override {
    const Lesson& lesson = task.lessons.front();
    format::Object& object = lesson.form.object();
    const TrainingOptions training = training_options(object.network->corners);
    lesson.report.training_rays = training.rays;
    TrainingResult trained = bake::train(
        lesson.source, object, training,
        [&](const TrainingProgress& p) {
          task.progress(double(p.rays_done) / double(p.rays_total), p.loss, p.error);
        },
        task.cancel, &task.log);
    lesson.report.recoveries = trained.recoveries;
    if (!trained.failure.empty()) return trained.failure;
    if (options_.error_limit)
      std::get<SegmentBaking::Report>(lesson.form.report).error_limit = limit_error(
          lesson.source, object, *options_.error_limit, options_.seed, task.cancel, trained.network);
    lesson.form.alone.mlps = {std::move(trained.network)};
    return {};
  }

  void add(Form&& form, format::Asset& asset) const override {
    format::NetworkData& network = *form.object().network;
    network.mlp = uint32_t(asset.mlps.size());
    if (!options_.uncoded) network.coded |= format::kCodedFeatures;
    asset.mlps.push_back(std::move(form.alone.mlps.front()));
    asset.objects.push_back(std::move(form.object()));
  }

  void add_options(nlohmann::ordered_json& json) const override {
    json["preset"] = name_of(options_.preset);
    json["mix"] = to_json(mix());
    if (options_.resolution) json["resolution"] = *options_.resolution;
    if (options_.effort) json["effort"] = *options_.effort;
  }

 private:
  /// Lays out its occupancy and planes, and zero features.
  void lay_out(const Prepared& prepared, double scale, Form& form) const {
    const LaidOut grid = lay_out_grid(prepared, shape_, scale, options_.resolution.has_value());
    format::Object& object = form.object();
    format::PlanesData& planes = object.planes.emplace();
    format::NetworkData& network = object.network.emplace();
    network.samples = shape_.samples;
    network.length_scale = shape_.length_scale;
    store_occupancy(grid.occupancy, shape_.features_per_corner, object);
    form.report = SegmentBaking::Report{fit_planes(prepared, grid, object.name, planes), std::nullopt};
    form.alone.mlps = {blank_network(shape_)};
    // Features are unknown before training, so they count uncoded: a file takes no more than this. The size
    // by which grids are chosen does not depend on how a file stores them.
    planes.coded = format::kCodedPlanes;
    network.coded = format::kCornersAround;
    form.sections = format::section_bytes(form.alone);
    form.cost.bytes = payload_bytes(form.sections);
    if (!options_.uncoded) return;
    planes.coded = network.coded = 0;
    form.sections = format::section_bytes(form.alone);
  }

  Mix mix() const { return options_.mix.value_or(kSegmentMix); }

  TrainingOptions training_options(uint32_t corners) const {
    TrainingOptions training;
    training.network = shape_.network;
    training.mix = mix();
    training.seed = options_.seed;
    const double rays =
        std::clamp(shape_.rays_per_corner * corners, double(kLeastSegmentRays), double(shape_.max_rays));
    training.rays = uint64_t(rays * options_.effort.value_or(1.0));
    // Short trainings need many steps more than large batches.
    training.batch = training.rays >= 60'000'000   ? 8192
                     : training.rays >= 20'000'000 ? 4096
                     : training.rays >= 6'000'000  ? 2048
                                                   : 1024;
    training.passes = 6;
    training.rays_per_round =
        std::clamp<uint64_t>(training.rays / training.passes, 16 * training.batch, kSegmentRaysPerRound);
    return training;
  }

  const BakeOptions& options_;
  const SegmentShape shape_;
};

}  // namespace

std::unique_ptr<Encoder> SegmentBaking::make(const BakeOptions& options) {
  if (options.error_limit && !(options.error_limit->rate >= 0 && options.error_limit->rate <= 1))
    throw Error(Status::usage, "the rate of an error limit is not in the range 0 to 1");
  return std::make_unique<SegmentEncoder>(options);
}

// docs/results/work.md describes the fit.
double SegmentCounts::nanoseconds() const {
  return 20 * double(rays) + 3.4 * double(cubes) + 77 * double(open);
}

SegmentCounts count_work(const kernels::SegmentField& field, std::span<const Segment> rays) {
  return count_all<SegmentCounts>(rays, [&](const Segment& segment, SegmentCounts& counts) {
    ++counts.rays;
    kernels::FullTraversal traversal;
    kernels::traverse_segment(field, segment, traversal, CountCubes{field, counts.cubes});
    counts.open += traversal.verdict == kernels::Verdict::open;
  });
}

double work_of(const kernels::SegmentField& field, const RaySource& source, uint64_t seed) {
  return mean_work(source, seed, [&](std::span<const Segment> rays) { return count_work(field, rays); });
}

void add_report(const SegmentBaking::Report& report, nlohmann::ordered_json& json) {
  add_grid(report, json);
  if (report.error_limit) json["error_limit"] = to_json(*report.error_limit);
}

void add_metadata(const SegmentBaking::Report& report, const ObjectReport& all, const format::Object&,
                  nlohmann::ordered_json& json) {
  json["voxels"] = report.voxels;
  json["training_rays"] = all.training_rays;
  if (report.error_limit) json["error_limit"] = to_json(*report.error_limit);
}

}  // namespace nif::bake
