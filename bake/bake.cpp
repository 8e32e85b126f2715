#include "bake/bake.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bake/bvh/builder.hpp"
#include "bake/oracle/prepare.hpp"
#include "bake/report.hpp"
#include "bake/segment/occupancy.hpp"
#include "bake/spherical/bake.hpp"
#include "bake/steps.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/writer.hpp"

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

// Of `spherical`: the two kinds of rays that the paper's networks are for. Segments that end are left out,
// because these networks are not told where.
constexpr Mix kSphericalMix{0.5, 0.35, 0.15, 0.0, 0.0};

// What `balanced` comes to stands in docs/results/dragon.md.
constexpr PresetRow kPresets[] = {
    {Preset::fast, "fast", {64, 8, 2, 8.0f, {32, 2}, kDefaultMix, 400, 12'000'000}},
    {Preset::balanced, "balanced", {96, 6, 2, 8.0f, {32, 2}, kDefaultMix, 2200, 110'000'000}},
    {Preset::high, "high", {128, 12, 2, 8.0f, {48, 2}, kDefaultMix, 4000, 500'000'000}},
    {Preset::paper, "paper", {0, 0, 0, 0, {}, kSphericalMix, 0, 0}},
};

/// Below kFullTriangles, surface detail is what triangles there are, and the voxels' size follows the
/// triangles': resolution falls with the square root of their number.
constexpr uint32_t kMinResolution = 16;
constexpr uint64_t kMinRays = 2'000'000;
constexpr uint64_t kRaysPerRound = 3'000'000;

uint32_t resolution_for(uint64_t triangles, uint32_t full, double scale) {
  const double share = std::min(1.0, std::sqrt(double(triangles) / kFullTriangles));
  const double wanted = std::max(full * share, double(std::min(kMinResolution, full))) * scale;
  return std::clamp(uint32_t(std::lround(wanted)), 2u, kernels::kMaxVoxels);
}

/// Gives a field its occupancy and zero features.
void lay_out(const Prepared& prepared, const ResolvedOptions& options, uint32_t resolution,
             format::SegmentData& data, ObjectReport& report) {
  data.samples = options.samples;
  data.length_scale = options.length_scale;
  const auto& [positions, triangles, slivers, cleaned] = prepared.surface;
  const Grid grid = make_grid(prepared.box, resolution);
  const Occupancy occupancy =
      classify(grid, prepared.surface, voxelize(grid, positions, triangles), prepared.closed);
  store_occupancy(occupancy, options.features_per_corner, report.name, data);
  report.voxels = grid.voxels;
  report.surface_voxels = occupancy.surface_voxels;
  report.inside_voxels = occupancy.inside_voxels;
  report.unknown_voxels = occupancy.unknown_voxels;
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

uint64_t bytes_of(const format::Network& network) {
  uint64_t bytes = 0;
  for (const format::Layer& layer : network.layers)
    bytes += layer.biases.size() * sizeof(layer.biases[0]) + layer.weights.size();
  return bytes;
}

class Baker {
 public:
  Baker(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
        const std::atomic<bool>& cancel)
      : scene_(scene), options_(options), resolved_(resolve(options)), callback_(callback), cancel_(cancel) {}

  BakeResult run() {
    choose_objects();
    build_bvhs();
    lay_out_fields(1);
    if (options_.max_bytes) shrink_to(*options_.max_bytes);
    for (size_t i = 0; i < prepared_.size(); ++i) bake_object(i);
    for (const ObjectReport& report : result_.objects) result_.triangles += report.triangles;
    check_error(options_, result_.sets,
                options_.encoding == EncodingOption::segment
                    ? "try a higher preset, --resolution or --encoding auto"
                    : "try a higher preset or --resolution");
    result_.asset = assemble();
    result_.asset.metadata = make_metadata(scene_, options_, result_);
    return std::move(result_);
  }

 private:
  /// An object on its way: both of its forms, as far as there are such.
  struct Candidate {
    format::Object field, bvh;
    std::optional<format::Network> network;  ///< of the field, once it is trained
    bool has_bvh = false, takes_bvh = false;
  };

  void choose_objects() {
    if (callback_) callback_({BakeProgress::Stage::preparing, scene_.meshes.front().name, 0, 1, 0, 0, 0});
    PreparedScene prepared = prepare(scene_, options_.strict);
    result_.notes = std::move(prepared.notes);
    result_.asset.instances = instances_of(scene_, prepared);
    result_.placed = prepared.instances;
    prepared_ = std::move(prepared.objects);
    clock_.emplace(prepared_, callback_);
    candidates_.resize(prepared_.size());
    result_.objects.resize(prepared_.size());
  }

  void build_bvhs() {
    for (size_t i = 0; i < prepared_.size(); ++i) {
      stop_if(cancel_);
      const auto& [positions, triangles, slivers, cleaned] = prepared_[i].surface;
      Candidate& candidate = candidates_[i];
      candidate.bvh = candidate.field = describe(prepared_[i], result_.objects[i]);
      if (options_.encoding == EncodingOption::segment) continue;
      if (!fits_bvh(positions)) {
        if (options_.encoding == EncodingOption::automatic) continue;
        throw Error(Status::too_large,
                    fmt::format("'{}' has coordinates beyond {:.1e}, which a BVH cannot compute with",
                                candidate.bvh.name, kernels::kMaxBvhCoordinate / 4));
      }
      candidate.bvh.content = build_bvh(positions, triangles);
      candidate.has_bvh = true;
      candidate.takes_bvh = options_.encoding == EncodingOption::bvh;
    }
  }

  void lay_out_fields(double scale) {
    if (options_.encoding == EncodingOption::bvh) return;
    for (size_t i = 0; i < prepared_.size(); ++i) {
      stop_if(cancel_);
      lay_out(prepared_[i], resolved_,
              resolution_for(prepared_[i].surface.triangles.size(), resolved_.resolution, scale),
              candidates_[i].field.as<format::SegmentData>(), result_.objects[i]);
    }
    choose_by_bytes();
  }

  /// A BVH that takes no more than the field needs no further comparison.
  void choose_by_bytes() {
    const uint64_t network = bytes_of(blank_network(resolved_));
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Candidate& candidate = candidates_[i];
      if (!candidate.has_bvh) continue;
      ObjectReport& own = result_.objects[i];
      own.as_bvh = cost_of_bvh(candidate.bvh.as<format::Bvh>());
      own.as_segment = cost_of_field(candidate.field.as<format::SegmentData>(), network);
      candidate.takes_bvh = own.as_bvh->bytes <= own.as_segment->bytes;
      if (candidate.takes_bvh)
        own.reason =
            fmt::format("exact, and with {} no larger than a field with {}",
                        format_bytes(double(own.as_bvh->bytes)), format_bytes(double(own.as_segment->bytes)));
      else
        own.reason.clear();
    }
  }

  void shrink_to(uint64_t most) {
    for (double scale = 0.95; estimated_bytes() > most; scale *= 0.95) {
      if (options_.encoding == EncodingOption::bvh) {
        throw Error(Status::target_not_met,
                    fmt::format("--max-bytes {} cannot be reached: with BVHs the asset takes {} bytes; try "
                                "--encoding segment",
                                most, estimated_bytes()));
      }
      if (resolved_.resolution * scale < 4) {
        throw Error(Status::target_not_met,
                    fmt::format("--max-bytes {} cannot be reached: the coarsest grids take {} bytes", most,
                                estimated_bytes()));
      }
      lay_out_fields(scale);
    }
  }

  /// The asset as far as it is made; where a field is not trained yet its network is blank.
  format::Asset assemble() const {
    format::Asset asset;
    asset.instances = result_.asset.instances;
    for (const Candidate& candidate : candidates_) {
      asset.objects.push_back(candidate.takes_bvh ? candidate.bvh : candidate.field);
      if (candidate.takes_bvh) continue;
      asset.objects.back().as<format::SegmentData>().network = uint32_t(asset.networks.size());
      asset.networks.push_back(candidate.network ? *candidate.network : blank_network(resolved_));
    }
    return asset;
  }

  uint64_t estimated_bytes() const {
    return format::encode(assemble()).size() + kMetadataBytes + kMetadataBytesPerObject * prepared_.size() +
           hierarchy_bytes(scene_, result_);
  }

  void bake_object(size_t index) {
    Candidate& candidate = candidates_[index];
    ObjectReport& own = result_.objects[index];
    if (options_.encoding != EncodingOption::automatic)
      own.reason = fmt::format("--encoding {}", name_of(options_.encoding));
    else if (!candidate.has_bvh)
      own.reason = "coordinates are too large for a BVH to compute with";
    if (!candidate.takes_bvh || options_.evaluation_rays > 0) {
      const GroundTruth truth(prepared_[index]);
      if (!candidate.takes_bvh && candidate.has_bvh) {
        bake_the_better(index, truth.source());
      } else {
        if (!candidate.takes_bvh) train_field(index, truth.source());
        own.sets = measure(index, truth.source());
      }
    }
    own.encoding = format::encoding_name((candidate.takes_bvh ? candidate.bvh : candidate.field).content);
    for (RaySet set : kRaySets) result_.sets[size_t(set)] += own.sets[size_t(set)];
  }

  /// The object as a field where that is worth its errors, else as a BVH.
  void bake_the_better(size_t index, const RaySource& source) {
    ObjectReport& own = result_.objects[index];
    EncodingCost &field = *own.as_segment, &bvh = *own.as_bvh;
    report(BakeProgress::Stage::choosing, own.name, index, 0.01, 0, 0);
    const uint64_t seed = options_.seed + kChoosingSeed;
    const format::Network blank = blank_network(resolved_);
    field.work =
        work_of(format::field_of(candidates_[index].field.as<format::SegmentData>(), blank), source, seed);
    bvh.work = work_of(format::field_of(candidates_[index].bvh.as<format::Bvh>()), source, seed);
    const std::string field_is = fmt::format("a field would be {}", describe_gain(field, bvh));
    if (gain_of(field, bvh) < kLeastGain &&
        take_bvh(index, fmt::format("exact; {}, too little to be wrong for", field_is))) {
      own.sets = measure(index, source);
      return;
    }

    try {
      train_field(index, source);
    } catch (const Error& error) {
      if (error.status() != Status::training_failed ||
          !take_bvh(index, fmt::format("exact; {}", error.what())))
        throw;
      own.sets = measure(index, source);
      return;
    }
    report(BakeProgress::Stage::choosing, own.name, index, 0.90, 0, 0);
    const kernels::SegmentField trained =
        format::field_of(candidates_[index].field.as<format::SegmentData>(), *candidates_[index].network);
    const WorstError worst = worst_error(reference_answerer(trained), source, seed);
    field.error = worst.error;
    const std::string cost = fmt::format("{:.2f} % of {} wrong", 100 * worst.error, name_of(worst.set));
    // Who states a largest error has said what errors are worth.
    const bool worth = options_.max_error || gain_of(field, bvh) >= 100 * worst.error * kGainPerPercent;
    if (!worth && take_bvh(index, fmt::format("exact; {}, too little for {}", field_is, cost))) {
      own.sets = measure(index, source);
      return;
    }
    if (own.reason.empty())
      own.reason = fmt::format("{} as a BVH of {}, for {}", describe_gain(field, bvh),
                               format_bytes(double(bvh.bytes)), cost);
    own.sets = measure(index, source);
    if (!options_.max_error) return;
    for (RaySet set : kRaySets) {
      const double error = own.sets[size_t(set)].error();
      if (error > *options_.max_error &&
          take_bvh(index,
                   fmt::format("exact; a field would answer {:.2f} % of {} wrongly, more than --max-error",
                               100 * error, name_of(set)))) {
        own.sets = measure(index, source);
        return;
      }
    }
  }

  /// Makes the object a BVH where --max-bytes leaves room for it; false where it does not.
  bool take_bvh(size_t index, const std::string& reason) {
    Candidate& candidate = candidates_[index];
    candidate.takes_bvh = true;
    if (options_.max_bytes && estimated_bytes() > *options_.max_bytes) {
      candidate.takes_bvh = false;
      result_.objects[index].reason =
          fmt::format("--max-bytes leaves no room for a BVH of {}",
                      format_bytes(double(candidate.bvh.as<format::Bvh>().bytes())));
      return false;
    }
    result_.objects[index].reason = reason;
    return true;
  }

  void train_field(size_t index, const RaySource& source) {
    format::Object& object = candidates_[index].field;
    auto& data = object.as<format::SegmentData>();
    ObjectReport& own = result_.objects[index];
    const TrainingOptions training = training_options(resolved_, options_, data.corners);
    own.training_rays = training.rays;
    report(BakeProgress::Stage::training, object.name, index, 0.03, 0, 0);
    TrainingResult trained = train(
        source, object.name, data, training,
        [&](const TrainingProgress& p) {
          const double share = double(p.rays_done) / double(p.rays_total);
          report(BakeProgress::Stage::training, object.name, index, 0.03 + 0.87 * share, p.loss, p.error);
        },
        cancel_);
    own.recoveries = trained.recoveries;
    candidates_[index].network = std::move(trained.network);
  }

  /// The accuracy of what the object is now.
  SetAccuracies measure(size_t index, const RaySource& source) {
    const Candidate& candidate = candidates_[index];
    const Answerer answer = reference_answerer(
        candidate.takes_bvh
            ? kernels::AnyField(format::field_of(candidate.bvh.as<format::Bvh>()))
            : format::field_of(candidate.field.as<format::SegmentData>(), *candidate.network));
    return measure_sets(source, answer, options_, prepared_.size(), [&](RaySet set) {
      stop_if(cancel_);
      report(BakeProgress::Stage::measuring, candidate.field.name, index, 0.90 + 0.02 * double(set), 0, 0);
    });
  }

  void report(BakeProgress::Stage stage, std::string_view name, size_t index, double share, double loss,
              double error) const {
    clock_->report(stage, name, index, share, loss, error);
  }

  const mesh::Scene& scene_;
  const BakeOptions& options_;
  const ResolvedOptions resolved_;
  const BakeCallback& callback_;
  const std::atomic<bool>& cancel_;
  std::vector<Prepared> prepared_;
  std::vector<Candidate> candidates_;
  std::optional<BakeClock> clock_;
  BakeResult result_;
};

constexpr std::pair<EncodingOption, std::string_view> kEncodings[] = {
    {EncodingOption::automatic, "auto"},
    {EncodingOption::segment, "segment"},
    {EncodingOption::bvh, "bvh"},
    {EncodingOption::spherical, "spherical"}};

}  // namespace

std::string_view name_of(EncodingOption option) {
  for (const auto& [known, name] : kEncodings) {
    if (known == option) return name;
  }
  return {};
}

std::optional<EncodingOption> encoding_named(std::string_view name) {
  for (const auto& [option, known] : kEncodings) {
    if (known == name) return option;
  }
  return std::nullopt;
}

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
  if (options.encoding == EncodingOption::spherical) return bake_spherical(scene, options, callback, cancel);
  return Baker(scene, options, callback, cancel).run();
}

}  // namespace nif::bake
