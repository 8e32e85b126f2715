// Trains in rounds: draws rays, gets their ground truth from Embree, learns, and perhaps stores a checkpoint.
// First visibility, together for objects that share networks; then primary rays, for each object alone.
#include "bake/spherical/spherical_encoder.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "bake/bake_clock.hpp"
#include "bake/encoder.hpp"
#include "bake/report.hpp"
#include "bake/spherical/describe_spherical.hpp"
#include "bake/spherical/primary_trainer.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

// The two kinds of rays that the paper's networks are for. Segments with an end are left out, because these
// networks do not know where they end.
constexpr Mix kSphericalMix{0.5, 0.35, 0.15, 0.0, 0.0};

constexpr uint64_t kSphericalRaysPerRound = 2'000'000, kLeastSphericalRays = 2'000'000;
constexpr uint64_t kSphericalPurpose =
    0x7370686572;  // separate from the ray sets' own streams: never the same rays

/// Draws chunks of rays from the mix and adds their ground truth, in parallel, the same for any number of
/// threads. Each chunk belongs to one lesson's object: `chunks_of` has one entry per lesson, the number of
/// its chunks, counted from `first_chunk` on.
SphericalRays draw_rays(std::span<const Lesson> lessons, const Mix& mix, uint64_t seed,
                        std::span<const uint64_t> first_chunk, std::span<const uint64_t> chunks_of,
                        const std::atomic<bool>& cancel) {
  struct Part {
    uint32_t object;
    uint64_t chunk;
    std::vector<Segment> segments;
    std::vector<uint8_t> visible;
  };
  std::vector<Part> parts;
  for (uint32_t object = 0; object < lessons.size(); ++object)
    for (uint64_t b = 0; b < chunks_of[object]; ++b)
      parts.push_back({object, first_chunk[object] + b, {}, {}});
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    if (cancel.load(std::memory_order_relaxed)) return;
    Part& part = parts[p];
    const RaySource& source = lessons[part.object].source;
    Random random(seed, kSphericalPurpose + (uint64_t{part.object} << 40), part.chunk);
    for (size_t i = 0; i < kTrainingChunk; ++i) {
      const RaySet set = draw_set(mix, random);
      const std::optional<Segment> segment = draw_ray(source, set, random);
      if (!segment) continue;
      part.segments.push_back(*segment);
      part.visible.push_back(!source.embree.occluded(*segment));
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

/// Calls work for 0 .. count - 1, in parallel.
void in_blocks(size_t count, const std::function<void(size_t)>& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kTrainingChunk), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

std::optional<PrimaryRays::Hit> first_hit(const EmbreeTruth& embree, const Segment& segment) {
  const std::optional<EmbreeTruth::Hit> hit = embree.first_hit(segment);
  if (!hit) return std::nullopt;
  const double size = length(hit->normal);
  if (!(size > 0)) return std::nullopt;
  const bool behind = dot(hit->normal, to_double(std::to_array(segment.direction))) > 0;
  const Double3 normal = hit->normal * ((behind ? -1 : 1) / size);
  return PrimaryRays::Hit{hit->t, {float(normal[0]), float(normal[1]), float(normal[2])}};
}

std::vector<float> blank_grid(uint32_t resolution, uint32_t features) {
  return std::vector<float>(size_t{resolution} * resolution * features);
}

format::SphericalLayers blank_layers(uint32_t inputs, uint32_t width, uint32_t hidden_layers,
                                     uint32_t outputs = 1) {
  return {inputs, width, hidden_layers,
          std::vector<float>(kernels::spherical_weights(inputs, width, hidden_layers, outputs))};
}

format::SphericalGrids blank_grids(const SphericalOptions& options) {
  const SphericalOptions::Outer& outer = options.outer;
  const SphericalOptions::Inner& inner = options.inner;
  format::SphericalGrids grids;
  grids.half = options.half_grids;
  grids.outer_position = grids.outer_direction = blank_grid(outer.resolution, outer.features);
  grids.inner_position = grids.inner_direction = blank_grid(inner.resolution, inner.features);
  grids.distance.resize(size_t{inner.distance_resolution} * inner.distance_features);
  return grids;
}

format::SphericalNetworks blank_networks(const SphericalOptions& options) {
  const SphericalOptions::Outer& outer = options.outer;
  const SphericalOptions::Inner& inner = options.inner;
  return {options.half_networks, options.slope,
          blank_layers(2 * outer.features, outer.width, outer.hidden_layers),
          blank_layers(2 * inner.features + inner.distance_features, inner.width, inner.hidden_layers)};
}

format::Primary blank_primary(const SphericalOptions& options) {
  const SphericalOptions::Outer& shape = options.primary;
  format::Primary primary;
  primary.half_grids = options.half_grids;
  primary.half_network = options.half_networks;
  primary.position = primary.direction = blank_grid(shape.resolution, shape.features);
  primary.network =
      blank_layers(2 * shape.features, shape.width, shape.hidden_layers, kernels::kPrimaryOutputs);
  return primary;
}

/// Per object: no machine draws as many.
constexpr uint64_t kMostLearned = uint64_t{1} << 48;

/// The rounds of a trainer as a log stores them between two rounds, with the number of rays of each object.
template <class Trainer>
class Course {
 public:
  Course(TrainingLog& log, const std::string& name, Trainer& trainer, std::vector<uint64_t>& learned)
      : log_(log), trainer_(trainer), learned_(learned) {
    const KeptTraining* kept = log.begin(name);
    if (!kept) return;
    ended_ = kept->finished;
    StateReader state(kept->state);
    state.get(round_), state.get_same(learned_), trainer_.get(state, ended_);
    state.end();
    for (const uint64_t rays : learned_) state.require(rays < kMostLearned);
  }
  /// The first of `rounds` rounds that is still to be learned.
  uint64_t begin(uint64_t rounds) const { return ended_ ? rounds : round_; }
  void keep(uint64_t round) {
    round_ = round;
    if (log_.due()) log_.keep(state());
  }
  void end() {
    if (ended_) return log_.finish_as_before();
    ended_ = true;
    log_.finish(state());
  }

 private:
  StateWriter state() const {
    StateWriter state;
    state.put(round_), state.put_all(learned_), trainer_.put(state, ended_);
    return state;
  }

  TrainingLog& log_;
  Trainer& trainer_;
  std::vector<uint64_t>& learned_;
  uint64_t round_ = 0;
  bool ended_ = false;
};

class SphericalEncoder final : public Encoder {
 public:
  explicit SphericalEncoder(const BakeOptions& options)
      : options_(options.spherical),
        mix_(options.mix.value_or(kSphericalMix)),
        seed_(options.seed),
        effort_(options.effort) {
    options_.fields.seed = options.seed;
    check(options_.fields);
  }

  std::string_view name() const override {
    return kernels::encoding_of_field<kernels::SphericalField>().name;
  }
  std::string_view noun() const override { return "a field"; }
  std::string_view smallest() const override { return "these grids and networks"; }
  Holes holes() const override { return Holes::any; }
  bool trains_together() const override { return options_.shared_network; }

  /// Only the size: latent vectors are large, so no blank ones are stored.
  void lay_out(const Prepared&, double, bool, bool first, Form& form) const override {
    format::Object& object = form.object();
    const bool brings_networks = first || !options_.shared_network;
    if (brings_networks) form.alone.spherical_networks = {blank_networks(options_.fields)};
    object.spherical = {0, blank_grids(options_.fields)};
    if (with_primary()) object.primary = blank_primary(options_.fields);
    form.cost.bytes = object.spherical->grids.bytes() +
                      (brings_networks ? form.alone.spherical_networks.front().bytes() : 0);
    form.report = SphericalBaking::Report();
    form.sections = format::section_bytes(form.alone);
    object.spherical.emplace();
    object.primary.reset();
  }

  std::string train(const TrainingTask& task) override {
    const auto failed = [](const Lesson& lesson, const std::string& why) {
      return fmt::format("training of '{}' failed: {}", lesson.form.object().name, why);
    };
    if (const std::string why = train_visibility(task); !why.empty())
      return failed(task.lessons.front(), why);
    if (!with_primary()) return {};
    for (const Lesson& lesson : task.lessons)
      if (const std::string why = train_primary(task, lesson); !why.empty()) return failed(lesson, why);
    return {};
  }

  void add(Form&& form, format::Asset& asset) const override {
    if (!options_.shared_network || asset.spherical_networks.empty())
      asset.spherical_networks.push_back(std::move(form.alone.spherical_networks.front()));
    form.object().spherical->network = uint32_t(asset.spherical_networks.size() - 1);
    asset.objects.push_back(std::move(form.object()));
  }

  void add_options(nlohmann::ordered_json& json) const override {
    json["preset"] = name_of(Preset::paper);
    if (options_.given)
      json["rays_from"] = options_.given->name;
    else
      json["mix"] = bake::to_json(mix_);
    json["spherical"] = to_json(options_);
    if (effort_) json["effort"] = *effort_;
  }

 private:
  bool with_primary() const { return options_.given && options_.given->draw_primary; }

  uint64_t rays_for(uint64_t triangles) const {
    const double share = std::min(1.0, double(triangles) / kFullTriangles);
    const double rays =
        std::max(double(options_.rays) * share, double(std::min(kLeastSphericalRays, options_.rays)));
    return uint64_t(rays * effort_.value_or(1.0));
  }

  /// Trains everything but the fields for primary rays. Returns why it failed.
  std::string train_visibility(const TrainingTask& task) {
    const std::span<const Lesson> lessons = task.lessons;
    std::vector<kernels::SphericalBounds> bounds;
    for (const Lesson& lesson : lessons) bounds.push_back(spherical_bounds(lesson.form.object()));
    SphericalTrainer trainer(std::move(bounds), options_.fields);
    std::vector<uint64_t> learned(lessons.size());  // rays per object
    Course course(task.log, lessons.front().form.object().name, trainer, learned);
    if (!(options_.given ? learn_given(task, trainer, learned, course)
                         : learn_mix(task, trainer, learned, course)))
      return kNonFinite;
    course.end();
    const uint64_t rays = trainer.outer_rays() + trainer.inner_rays();
    if (rays == 0) return "there are too few rays to learn from that meet its bounds";
    const double all =
        double(std::max<uint64_t>(1, std::accumulate(learned.begin(), learned.end(), uint64_t{0})));
    for (size_t i = 0; i < lessons.size(); ++i) {
      const Lesson& lesson = lessons[i];
      lesson.form.alone.spherical_networks = {trainer.networks()};
      lesson.form.object().spherical = {0, trainer.grids(i)};
      lesson.report.training_rays = uint64_t(double(rays) * double(learned[i]) / all);
      lesson.report.recoveries = trainer.recoveries();
    }
    return {};
  }

  /// A field for primary rays is trained alone, from rays whose ground truth involves only the object.
  std::string train_primary(const TrainingTask& task, const Lesson& lesson) {
    format::Object& object = lesson.form.object();
    PrimaryTrainer trainer(spherical_bounds(object), options_.fields);
    std::vector<uint64_t> none;
    Course course(task.log, object.name + ", primary rays", trainer, none);
    for (uint64_t round = course.begin(options_.given->rounds); round < options_.given->rounds; ++round) {
      course.keep(round);
      const auto report = reporter(task, round, options_.given->rounds, {kPrimaryBegin, 1});
      report({loss_, error_});
      if (!trainer.learn(primary_rays(task, lesson, round), report, task.cancel)) return kNonFinite;
    }
    course.end();
    if (trainer.rays() == 0) return "there are too few primary rays that meet its bounds";
    object.primary = trainer.field();
    object.primary->margin =
        find_margin(format::field_of(*object.primary, object.bounds()), primary_rays(task, lesson, 0));
    std::get<SphericalBaking::Report>(lesson.form.report).primary_rays = trainer.rays();
    lesson.report.recoveries += trainer.recoveries();
    return {};
  }

  /// A round's rays for one object, with ground truth.
  PrimaryRays primary_rays(const TrainingTask& task, const Lesson& lesson, uint64_t round) const {
    const MeshRays drawn = options_.given->draw_primary(round);
    stop_if(task.cancel);
    PrimaryRays rays;
    for (size_t i = 0; i < drawn.segments.size(); ++i)
      if (task.object_of[drawn.meshes[i]] == lesson.object) rays.segments.push_back(drawn.segments[i]);
    rays.hits.resize(rays.segments.size());
    in_blocks(rays.segments.size(),
              [&](size_t i) { rays.hits[i] = first_hit(lesson.source.embree, rays.segments[i]); });
    return rays;
  }

  /// The part of the task that a training covers.
  struct Share {
    double begin, end;
  };
  static constexpr double kPrimaryBegin = 0.65;
  Share visibility_share() const { return {0, with_primary() ? kPrimaryBegin : 1}; }

  /// Reports progress of a training, for one of several rounds.
  std::function<void(const SphericalProgress&)> reporter(const TrainingTask& task, uint64_t round,
                                                         uint64_t rounds, Share share) {
    const double done = (double(round) + 0.5) / double(rounds);
    return [this, &task, at = share.begin + (share.end - share.begin) * done](const SphericalProgress& p) {
      loss_ = p.loss, error_ = p.error;
      task.progress(at, loss_, error_);
    };
  }

  /// Returns false if the loss stays non-finite.
  bool learn_mix(const TrainingTask& task, SphericalTrainer& trainer, std::vector<uint64_t>& learned,
                 Course<SphericalTrainer>& course) {
    const size_t count = task.lessons.size();
    uint64_t all = 0;
    std::vector<uint64_t> chunks;  // per object, in all rounds
    for (size_t i = 0; i < count; ++i) {
      const uint64_t rays = rays_for(task.lessons[i].report.triangles);
      chunks.push_back((rays + kTrainingChunk - 1) / kTrainingChunk);
      learned[i] = chunks.back() * kTrainingChunk;
      all += learned[i];
    }
    const uint64_t rounds = std::max<uint64_t>(1, all / kSphericalRaysPerRound);
    std::vector<uint64_t> begin(count), size(count);
    for (uint64_t round = course.begin(rounds); round < rounds; ++round) {
      course.keep(round);
      const auto report = reporter(task, round, rounds, visibility_share());
      report({loss_, error_});
      for (size_t i = 0; i < count; ++i) {
        begin[i] = chunks[i] * round / rounds;
        size[i] = chunks[i] * (round + 1) / rounds - begin[i];
      }
      const SphericalRays rays = draw_rays(task.lessons, mix_, seed_, begin, size, task.cancel);
      stop_if(task.cancel);
      if (!trainer.learn(rays, options_.passes, report, task.cancel)) return false;
    }
    return true;
  }

  bool learn_given(const TrainingTask& task, SphericalTrainer& trainer, std::vector<uint64_t>& learned,
                   Course<SphericalTrainer>& course) {
    const GivenRays& given = *options_.given;
    const size_t first = task.lessons.front().object;  // the others follow it
    for (uint64_t round = course.begin(given.rounds); round < given.rounds; ++round) {
      course.keep(round);
      const auto report = reporter(task, round, given.rounds, visibility_share());
      report({loss_, error_});
      const MeshRays drawn = given.draw(round);
      stop_if(task.cancel);
      SphericalRays rays;
      for (size_t i = 0; i < drawn.segments.size(); ++i) {
        const uint32_t object = task.object_of[drawn.meshes[i]];
        if (object < first || object >= first + task.lessons.size()) continue;  // kNone, too
        rays.segments.push_back(drawn.segments[i]);
        rays.objects.push_back(uint32_t(object - first));
        ++learned[object - first];
      }
      rays.visible.resize(rays.segments.size());
      in_blocks(rays.segments.size(), [&](size_t i) {
        rays.visible[i] = !task.lessons[rays.objects[i]].source.embree.occluded(rays.segments[i]);
      });
      if (!trainer.learn(rays, 1, report, task.cancel)) return false;
    }
    return true;
  }

  static constexpr const char* kNonFinite = "the loss stayed non-finite after several recoveries";

  SphericalBakeOptions options_;
  const Mix mix_;
  const uint64_t seed_;
  const std::optional<double> effort_;
  double loss_ = 0, error_ = 0;
};

}  // namespace

std::unique_ptr<Encoder> SphericalBaking::make(const BakeOptions& options) {
  // Its networks, as published, have no bias to subtract a threshold from.
  if (options.error_limit) throw Error(Status::usage, "errors of spherical objects cannot be limited");
  return std::make_unique<SphericalEncoder>(options);
}

}  // namespace nif::bake
