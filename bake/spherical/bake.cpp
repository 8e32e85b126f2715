#include "bake/spherical/bake.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <deque>
#include <numeric>

#include "bake/report.hpp"
#include "bake/spherical/primary_trainer.hpp"
#include "bake/steps.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

constexpr uint64_t kRoundRays = 2'000'000, kLeastRays = 2'000'000;
constexpr uint64_t kPurpose = 0x7370686572;  // apart from the ray sets' own streams: never the same rays

uint64_t rays_for(uint64_t triangles, const BakeOptions& options) {
  const double share = std::min(1.0, double(triangles) / kFullTriangles);
  const double rays =
      std::max(double(options.spherical.rays) * share, double(std::min(kLeastRays, options.spherical.rays)));
  return uint64_t(rays * options.effort.value_or(1.0));
}

/// Draws and labels blocks of rays from the mix, in parallel, the same for any number of threads. Each block
/// is of one object: `blocks_of` has one entry for each, how many, and counts are from `first_block` on.
SphericalRays draw_rays(std::span<const GroundTruth* const> truths, const Mix& mix, uint64_t seed,
                        std::span<const uint64_t> first_block, std::span<const uint64_t> blocks_of,
                        const std::atomic<bool>& cancel) {
  struct Part {
    uint32_t object;
    uint64_t block;
    std::vector<Segment> segments;
    std::vector<uint8_t> visible;
  };
  std::vector<Part> parts;
  for (uint32_t object = 0; object < truths.size(); ++object)
    for (uint64_t b = 0; b < blocks_of[object]; ++b)
      parts.push_back({object, first_block[object] + b, {}, {}});
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    if (cancel.load(std::memory_order_relaxed)) return;
    Part& part = parts[p];
    const RaySource& source = truths[part.object]->source();
    Random random(seed, kPurpose + (uint64_t{part.object} << 40), part.block);
    for (size_t i = 0; i < kTrainingBlock; ++i) {
      const RaySet set = draw_set(mix, random);
      const std::optional<Segment> segment = draw_ray(source, set, random);
      if (!segment) continue;
      part.segments.push_back(*segment);
      part.visible.push_back(!source.oracle.occluded(*segment));
    }
  });
  SphericalRays rays;
  for (const Part& part : parts) {
    rays.segments.insert(rays.segments.end(), part.segments.begin(), part.segments.end());
    rays.visible.insert(rays.visible.end(), part.visible.begin(), part.visible.end());
    rays.objects.insert(rays.objects.end(), part.segments.size(), part.object);
  }
  return rays;
}

/// For 0 .. count - 1, in parallel.
void in_blocks(size_t count, const std::function<void(size_t)>& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kTrainingBlock), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

std::optional<PrimaryRays::Hit> first_hit(const Oracle& oracle, const Segment& segment) {
  const std::optional<Oracle::Hit> hit = oracle.first_hit(segment);
  if (!hit) return std::nullopt;
  const double size = length(hit->normal);
  if (!(size > 0)) return std::nullopt;
  const bool behind = dot(hit->normal, to_double(std::to_array(segment.direction))) > 0;
  const Double3 normal = hit->normal * ((behind ? -1 : 1) / size);
  return PrimaryRays::Hit{hit->t, {float(normal[0]), float(normal[1]), float(normal[2])}};
}

class SphericalBaker {
 public:
  SphericalBaker(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                 const std::atomic<bool>& cancel)
      : scene_(scene), options_(options), callback_(callback), cancel_(cancel) {
    options_.preset = Preset::paper;
    options_.spherical.fields.seed = options.seed;
    options_.spherical.fields.spoil_at_step = options.spoil_at_step;
    check(options_.spherical.fields);
  }

  BakeResult run() {
    if (callback_) callback_({BakeProgress::Stage::preparing, scene_.meshes.front().name, 0, 1, 0, 0, 0});
    PreparedScene prepared = prepare(scene_, options_.strict);
    result_.notes = std::move(prepared.notes);
    result_.asset.instances = instances_of(scene_, prepared);
    result_.placed = prepared.instances;
    object_of_ = prepared.object_of;
    prepared_ = std::move(prepared.objects);
    clock_.emplace(prepared_, callback_);
    result_.objects.resize(prepared_.size());
    for (size_t i = 0; i < prepared_.size(); ++i) {
      ObjectReport& own = result_.objects[i];
      format::Object& object = result_.asset.objects.emplace_back(describe(prepared_[i], own));
      object.content = format::SphericalData();
      own.encoding = format::encoding_name(object.content);
      own.reason = "--encoding spherical";
      result_.triangles += own.triangles;
    }
    check_bytes();
    if (options_.spherical.shared_network) {
      bake_objects(0, prepared_.size());
    } else {
      for (size_t i = 0; i < prepared_.size(); ++i) bake_objects(i, 1);
    }
    for (const ObjectReport& own : result_.objects)
      for (RaySet set : kRaySets) result_.sets[size_t(set)] += own.sets[size_t(set)];
    check_error(options_, result_.sets, "try --encoding segment or bvh");
    result_.asset.metadata = make_metadata(scene_, options_, result_);
    return std::move(result_);
  }

 private:
  bool with_primary() const { return options_.spherical.given && options_.spherical.given->draw_primary; }

  /// Bytes are known before anything is trained.
  void check_bytes() const {
    if (!options_.max_bytes) return;
    const SphericalOptions& fields = options_.spherical.fields;
    const SphericalOptions::Outer &outer = fields.outer, &primary = fields.primary;
    const SphericalOptions::Inner& inner = fields.inner;
    const auto over_angles = [](const auto& field) {
      return 2 * uint64_t{field.resolution} * field.resolution * field.features;
    };
    const uint64_t objects = prepared_.size(),
                   networks = options_.spherical.shared_network ? 1 : objects;  // each a pair
    uint64_t latents = objects * (over_angles(outer) + over_angles(inner) +
                                  uint64_t{inner.distance_resolution} * inner.distance_features);
    uint64_t weights =
        networks * (kernels::spherical_weights(2 * outer.features, outer.width, outer.hidden_layers) +
                    kernels::spherical_weights(2 * inner.features + inner.distance_features, inner.width,
                                               inner.hidden_layers));
    if (with_primary()) {
      latents += objects * over_angles(primary);
      weights += objects * kernels::spherical_weights(2 * primary.features, primary.width,
                                                      primary.hidden_layers, kernels::kPrimaryOutputs);
    }
    const uint64_t bytes = latents * (fields.half_grids ? 2 : 4) + weights * (fields.half_networks ? 2 : 4) +
                           kMetadataBytes + kMetadataBytesPerObject * objects +
                           hierarchy_bytes(scene_, result_);
    if (bytes <= *options_.max_bytes) return;
    throw Error(Status::target_not_met,
                fmt::format("--max-bytes {} cannot be reached: these grids and networks take {} bytes; try a "
                            "smaller --outer-resolution and --inner-resolution, or --precision half",
                            *options_.max_bytes, bytes));
  }

  /// Objects first .. first + count - 1, with one pair of networks.
  void bake_objects(size_t first, size_t count) {
    stop_if(cancel_);
    std::deque<GroundTruth> truths;
    std::vector<const GroundTruth*> pointers;
    for (size_t i = first; i < first + count; ++i) pointers.push_back(&truths.emplace_back(prepared_[i]));
    train(first, pointers);
    if (with_primary())
      for (size_t i = first; i < first + count; ++i) train_primary(i, pointers[i - first]->source().oracle);
    for (size_t i = first; i < first + count; ++i) {
      const format::Object& object = result_.asset.objects[i];
      result_.objects[i].sets = measure_sets(
          pointers[i - first]->source(), reference_answerer(format::field_of(result_.asset, object)),
          options_, prepared_.size(), [&](RaySet set) {
            stop_if(cancel_);
            clock_->report(BakeProgress::Stage::measuring, object.name, i, 0.90 + 0.02 * double(set));
          });
    }
  }

  void train(size_t first, std::span<const GroundTruth* const> truths) {
    const size_t count = truths.size();
    const std::span<format::Object> objects = std::span(result_.asset.objects).subspan(first, count);
    SphericalTrainer trainer(objects, options_.spherical.fields);
    std::vector<uint64_t> learned(count);  // rays of each object
    if (options_.spherical.given)
      learn_given(first, truths, trainer, learned);
    else
      learn_mix(first, truths, trainer, learned);
    if (trainer.outer_rays() + trainer.inner_rays() == 0)
      throw Error(
          Status::training_failed,
          fmt::format("training of '{}' failed: there are too few rays to learn from that meet its bounds",
                      objects[0].name));
    const auto network = uint32_t(result_.asset.spherical_networks.size());
    result_.asset.spherical_networks.push_back(trainer.networks());
    const double all = double(std::accumulate(learned.begin(), learned.end(), uint64_t{0}));
    for (size_t i = 0; i < count; ++i) {
      objects[i].content = format::SphericalData{network, trainer.grids(i)};
      ObjectReport& own = result_.objects[first + i];
      own.training_rays =
          uint64_t(double(trainer.outer_rays() + trainer.inner_rays()) * double(learned[i]) / all);
      own.recoveries = trainer.recoveries();
    }
  }

  /// A field for primary rays is trained alone, from rays that are labelled by the object alone.
  void train_primary(size_t index, const Oracle& oracle) {
    const GivenRays& given = *options_.spherical.given;
    format::Object& object = result_.asset.objects[index];
    PrimaryTrainer trainer(object, options_.spherical.fields);
    for (uint64_t round = 0; round < given.rounds; ++round) {
      const auto report = reporter(index, round, given.rounds, kPrimaryShare);
      report({loss_, error_});
      trainer.learn(primary_rays(index, oracle, round), report, cancel_);
    }
    if (trainer.rays() == 0)
      throw Error(Status::training_failed,
                  fmt::format("training of '{}' failed: there are too few primary rays that meet its bounds",
                              object.name));
    object.primary = trainer.field();
    object.primary->margin =
        find_margin(format::field_of(*object.primary, object.bounds()), primary_rays(index, oracle, 0));
    ObjectReport& own = result_.objects[index];
    own.primary_rays = trainer.rays();
    own.recoveries += trainer.recoveries();
  }

  /// Those of a round that are for one object, labelled.
  PrimaryRays primary_rays(size_t index, const Oracle& oracle, uint64_t round) const {
    const MeshRays drawn = options_.spherical.given->draw_primary(round);
    stop_if(cancel_);
    PrimaryRays rays;
    for (size_t i = 0; i < drawn.segments.size(); ++i)
      if (object_of_[drawn.meshes[i]] == index) rays.segments.push_back(drawn.segments[i]);
    rays.hits.resize(rays.segments.size());
    in_blocks(rays.segments.size(), [&](size_t i) { rays.hits[i] = first_hit(oracle, rays.segments[i]); });
    return rays;
  }

  /// Where in an object's work something is trained.
  struct Share {
    double begin, end;
  };
  static constexpr Share kPrimaryShare{0.60, 0.90};
  Share visibility_share() const { return {0.03, with_primary() ? kPrimaryShare.begin : kPrimaryShare.end}; }

  /// What training tells of itself, for a round of several.
  std::function<void(const SphericalProgress&)> reporter(size_t first, uint64_t round, uint64_t rounds,
                                                         Share share) {
    // A shared network's training is shown as that of the first object.
    return [=, this](const SphericalProgress& p) {
      loss_ = p.loss, error_ = p.error;
      const double done = (double(round) + 0.5) / double(rounds);
      clock_->report(BakeProgress::Stage::training, result_.asset.objects[first].name, first,
                     share.begin + (share.end - share.begin) * done, loss_, error_);
    };
  }

  void learn_mix(size_t first, std::span<const GroundTruth* const> truths, SphericalTrainer& trainer,
                 std::vector<uint64_t>& learned) {
    const size_t count = truths.size();
    uint64_t all = 0;
    std::vector<uint64_t> blocks;  // of each object, in all rounds
    for (size_t i = 0; i < count; ++i) {
      const uint64_t rays = rays_for(result_.objects[first + i].triangles, options_);
      blocks.push_back((rays + kTrainingBlock - 1) / kTrainingBlock);
      learned[i] = blocks.back() * kTrainingBlock;
      all += learned[i];
    }
    const uint64_t rounds = std::max<uint64_t>(1, all / kRoundRays);
    std::vector<uint64_t> begin(count), size(count);
    const Mix mix = resolve(options_).mix;
    for (uint64_t round = 0; round < rounds; ++round) {
      const auto report = reporter(first, round, rounds, visibility_share());
      report({loss_, error_});
      for (size_t i = 0; i < count; ++i) {
        begin[i] = blocks[i] * round / rounds;
        size[i] = blocks[i] * (round + 1) / rounds - begin[i];
      }
      const SphericalRays rays = draw_rays(truths, mix, options_.seed, begin, size, cancel_);
      stop_if(cancel_);
      trainer.learn(rays, options_.spherical.passes, report, cancel_);
    }
  }

  void learn_given(size_t first, std::span<const GroundTruth* const> truths, SphericalTrainer& trainer,
                   std::vector<uint64_t>& learned) {
    const GivenRays& given = *options_.spherical.given;
    for (uint64_t round = 0; round < given.rounds; ++round) {
      const auto report = reporter(first, round, given.rounds, visibility_share());
      report({loss_, error_});
      const MeshRays drawn = given.draw(round);
      stop_if(cancel_);
      SphericalRays rays;
      for (size_t i = 0; i < drawn.segments.size(); ++i) {
        const uint32_t object = object_of_[drawn.meshes[i]];
        if (object < first || object >= first + truths.size()) continue;  // kNone, too
        rays.segments.push_back(drawn.segments[i]);
        rays.objects.push_back(uint32_t(object - first));
        ++learned[object - first];
      }
      rays.visible.resize(rays.segments.size());
      in_blocks(rays.segments.size(), [&](size_t i) {
        rays.visible[i] = !truths[rays.objects[i]]->source().oracle.occluded(rays.segments[i]);
      });
      trainer.learn(rays, 1, report, cancel_);
    }
  }

  const mesh::Scene& scene_;
  BakeOptions options_;
  const BakeCallback& callback_;
  const std::atomic<bool>& cancel_;
  std::vector<Prepared> prepared_;
  std::vector<uint32_t> object_of_;  // [mesh]
  std::optional<BakeClock> clock_;
  BakeResult result_;
  double loss_ = 0, error_ = 0;
};

}  // namespace

BakeResult bake_spherical(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                          const std::atomic<bool>& cancel) {
  return SphericalBaker(scene, options, callback, cancel).run();
}

}  // namespace nif::bake
