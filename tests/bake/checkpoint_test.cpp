// A killed bake resumes from its checkpoint and gives the same bytes as an uninterrupted one; anything that
// is not a checkpoint of this bake is refused.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <set>

#include "bake/checkpoint.hpp"
#include "bake/network/network_trainer.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/bake/training_fault.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::KeptTraining;
using bake::TrainingLog;
using Bytes = std::vector<std::byte>;

/// Simulates a kill of a bake within this process.
struct Killed {};

Bytes copy_of(std::span<const KeptTraining> trainings, const bake::BakeKey& key) {
  return bake::encode_checkpoint(key, trainings);
}

/// A bake that is killed at every nth save of its state and resumed, on one and two threads by turns, until
/// it completes.
class KilledBake {
 public:
  KilledBake(const mesh::Scene& scene, const bake::BakeOptions& options)
      : scene_(scene), options_(options), key_(bake::key_of(scene, options, "")) {}

  Bytes whole() { return run(nullptr); }
  /// How many times a whole bake saves its state.
  int saves() {
    int count = 0;
    TrainingLog log({}, 0, [&](auto) { ++count; });
    run(&log);
    return count;
  }
  Bytes killed_after(int saves, size_t threads) {
    Bytes kept;
    for (size_t lives = 1;; ++lives) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                        lives % 2 ? threads : 3 - threads);
      std::vector<KeptTraining> earlier;
      if (!kept.empty()) earlier = bake::decode_checkpoint(kept, key_);
      int left = saves;
      TrainingLog log(std::move(earlier), 0, [&](std::span<const KeptTraining> trainings) {
        kept = copy_of(trainings, key_);
        if (--left == 0) throw Killed();
      });
      try {
        const Bytes file = run(&log);
        EXPECT_GT(lives, 1u) << "it was never killed";
        return file;
      } catch (const Killed&) {
      }
    }
  }

 private:
  Bytes run(TrainingLog* log) {
    const std::atomic<bool> cancel{false};
    return format::encode(bake::bake(scene_, options_, {}, cancel, log).asset);
  }

  const mesh::Scene scene_;
  const bake::BakeOptions options_;
  const bake::BakeKey key_;
};

/// Killed once early, once in the middle and once late; then repeatedly, after every few saves. Where a bake
/// saves only a few times, some of these are the same.
void expect_resumed(const mesh::Scene& scene, const bake::BakeOptions& options, int least_saves) {
  KilledBake bake(scene, options);
  const Bytes whole = bake.whole();
  const int saves = bake.saves();
  ASSERT_GE(saves, least_saves);
  size_t threads = 1;
  std::set<std::pair<int, size_t>> done;
  for (const int after : {2 + saves / 5, 1 + saves / 2, saves - 1}) {
    if (!done.emplace(after, threads).second) continue;
    EXPECT_TRUE(bake.killed_after(after, threads) == whole) << "killed after " << after << " of " << saves;
    threads = 3 - threads;
  }
}

mesh::Scene three_objects() { return scene_of({torus(40, 20), icosphere(3), open_bowl(12, 24)}); }

TEST(Checkpoint, FieldsGoOnToTheSameBytes) {
  KilledBake bake(scene_of({torus(24, 12), icosphere(2)}), small_field(0.05));
  const int saves = bake.saves();
  ASSERT_GE(saves, 10);
  EXPECT_TRUE(bake.killed_after(1 + saves / 2, 1) == bake.whole()) << "of " << saves;
}

TEST(Checkpoint, AFieldGoesOnToTheSameBytes) {
  expect_resumed(scene_of({torus(40, 20)}), small_field(0.2), 10);
}

TEST(Checkpoint, SeveralFieldsGoOnToTheSameBytes) { expect_resumed(three_objects(), small_field(0.1), 20); }

TEST(Checkpoint, WhatLimitsAnErrorGoesOnToTheSameBytes) {
  bake::BakeOptions options = small_field(0.1);
  options.error_limit = bake::ErrorLimit{bake::Mistake::leak, 0.001};
  expect_resumed(scene_of({torus(40, 20)}), options, 5);
}

TEST(Checkpoint, ASearchForTheSmallestGoesOnToTheSameBytes) {
  bake::BakeOptions options = small_field(0.1);
  options.resolution.reset();
  options.max_error = 0.02;
  expect_resumed(scene_of({torus(40, 20)}), options, 20);
}

TEST(Checkpoint, RecoveriesAreTheSame) {
  const TrainingFault fault(300);
  expect_resumed(scene_of({torus(40, 20)}), small_field(0.5), 20);
}

TEST(Checkpoint, SphericalFieldsGoOnToTheSameBytes) {
  bake::BakeOptions options;
  options.encoding = "spherical";
  options.preset = bake::Preset::paper;
  options.spherical.fields.outer.resolution = options.spherical.fields.inner.resolution = 32;
  options.spherical.fields.inner.distance_resolution = 32;
  options.spherical.rays = 4'100'000;
  options.spherical.passes = 1;
  options.evaluation_rays = 10'000;
  const mesh::Scene scene = scene_of({torus(40, 20), icosphere(3)});
  options.spherical.shared_network = true;
  expect_resumed(scene, options, 3);
  options.spherical.shared_network = false;
  KilledBake own(scene, options);
  EXPECT_TRUE(own.killed_after(1 + own.saves() / 2, 1) == own.whole());
}

/// Trained on rays from views all around, in several rounds, with fields for primary rays.
bake::BakeOptions given_rays(uint64_t rounds, int rays_per_round) {
  bake::BakeOptions options;
  options.encoding = "spherical";
  options.preset = bake::Preset::paper;
  options.spherical.fields.outer.resolution = options.spherical.fields.inner.resolution = 32;
  options.spherical.fields.inner.distance_resolution = 32;
  options.spherical.fields.primary.resolution = 32;
  options.evaluation_rays = 10'000;
  const auto draw = [rays_per_round](uint64_t round) {
    nif::Random random(7, 1, round);
    bake::MeshRays rays;
    for (int i = 0; i < rays_per_round; ++i) {
      const Double3 from = random.direction() * 2.0, to = random.direction() * 0.9;
      rays.segments.push_back(bake::make_segment(from, to - from, std::numeric_limits<double>::infinity()));
    }
    rays.meshes.assign(rays.segments.size(), 0);
    return rays;
  };
  options.spherical.given = bake::GivenRays{"from around", rounds, draw, draw};
  return options;
}

TEST(Checkpoint, FieldsOfGivenRaysGoOnToTheSameBytes) {
  expect_resumed(scene_of({icosphere(3)}), given_rays(4, 20'000), 8);
}

/// The state of a nearly complete bake, changed at random and with a correct checksum. It is refused, or the
/// bake ends with a valid asset, or the training fails.
void expect_no_harm(const mesh::Scene& scene, const bake::BakeOptions& options, int tries) {
  const std::atomic<bool> cancel{false};
  std::vector<std::vector<KeptTraining>> kept;
  TrainingLog log({}, 0, [&](auto trainings) { kept.emplace_back(trainings.begin(), trainings.end()); });
  bake::bake(scene, options, {}, cancel, &log);
  ASSERT_GE(kept.size(), 3u);
  kept.erase(kept.begin(), kept.end() - 3);

  Random random(1);
  int refused = 0;
  for (int i = 0; i < tries; ++i) {
    std::vector<KeptTraining> changed = kept[random.below(uint32_t(kept.size()))];
    Bytes& state = changed[random.below(uint32_t(changed.size()))].state;
    // Counts and sizes are at both ends; numbers are in between.
    const uint32_t places = uint32_t(state.size() / 4), near = std::min(places, 100u);
    const uint32_t place = i % 4 == 0   ? random.below(near)
                           : i % 4 == 1 ? random.below(places)
                                        : places - 1 - random.below(near);
    constexpr uint32_t kOdd[] = {0,           1,           0x80,        0x8080'8080, 0xffff,
                                 0x7fff'ffff, 0xffff'ffff, 0x7fc0'0000, 0x7f7f'ffff};
    const uint32_t word = i % 8 < 6 ? kOdd[random.below(std::size(kOdd))] : random.below(0xffff'ffff);
    std::memcpy(state.data() + 4 * place, &word, sizeof(word));
    try {
      TrainingLog resumed(changed, 1e9, [](auto) {});
      const Bytes file = format::encode(bake::bake(scene, options, {}, cancel, &resumed).asset);
      EXPECT_NO_THROW(format::read_asset(file, "file"));
    } catch (const Error& error) {
      EXPECT_TRUE(error.status() == Status::checkpoint_refused || error.status() == Status::training_failed)
          << i << ": " << error.what();
      refused += error.status() == Status::checkpoint_refused;
    }
  }
  EXPECT_GT(refused, 0);
  EXPECT_LT(refused, tries);
}

constexpr int kTries = 40;

TEST(HostileCheckpoint, OfFieldsDoesNoHarm) {
  expect_no_harm(scene_of({icosphere(1), torus(12, 6)}), small_field(0.005), kTries);
}

TEST(HostileCheckpoint, OfSphericalFieldsDoesNoHarm) {
  expect_no_harm(scene_of({icosphere(1)}), given_rays(2, 9'000), kTries);
}

/// A training whose state is kept at every 16th step.
struct Course {
  std::vector<Bytes> kept;
  std::vector<int8_t> features;
  format::Mlp network;
  uint32_t recoveries = 0;

  Course(const bake::TrainingOptions& options, size_t threads, Bytes earlier = {}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    OccupiedObject object(torus(60, 30), 24, CellOptions{.bare = true});
    const std::atomic<bool> cancel{false};
    std::vector<KeptTraining> before;
    if (!earlier.empty()) before = bake::decode_checkpoint(earlier, {});
    TrainingLog log(std::move(before), 0,
                    [&](std::span<const KeptTraining> trainings) { kept.push_back(copy_of(trainings, {})); });
    const bake::TrainingResult result = bake::train(
        object.truth->source(), object.object, options, [](const auto&) {}, cancel, &log);
    features = object.object.network->features;
    network = result.network;
    recoveries = result.recoveries;
  }
  void expect_same(const Course& other) const {
    EXPECT_EQ(features, other.features);
    EXPECT_EQ(recoveries, other.recoveries);
    ASSERT_EQ(network.layers.size(), other.network.layers.size());
    for (size_t l = 0; l < network.layers.size(); ++l) {
      EXPECT_EQ(network.layers[l].weights, other.network.layers[l].weights);
      EXPECT_EQ(network.layers[l].biases, other.network.layers[l].biases);
    }
  }
};

TEST(Checkpoint, ATrainingGoesOnFromAnyOfItsStates) {
  bake::TrainingOptions options;
  options.mix = {0.4, 0.3, 0, 0.3, 0};
  options.rays = 800'000;
  options.rays_per_round = 50'000;
  options.batch = 1024;
  options.seed = 4;
  const TrainingFault fault(300);
  const Course whole(options, 2);
  EXPECT_EQ(whole.recoveries, 1u);
  ASSERT_GT(whole.kept.size(), 40u);
  for (size_t i = 0; i < whole.kept.size(); i += 5) {
    const Course rest(options, 1 + i % 2, whole.kept[i]);
    rest.expect_same(whole);
    // When it resumes, it saves the same states.
    ASSERT_EQ(rest.kept.size() + i, whole.kept.size());
    EXPECT_TRUE(std::equal(rest.kept.begin(), rest.kept.end(), whole.kept.begin() + ptrdiff_t(i)));
  }
}

/// A checkpoint of a bake, and the message that refuses it.
class RefusedCheckpoint : public testing::Test {
 protected:
  static std::string refusal(std::span<const std::byte> file, const bake::BakeKey& key) {
    try {
      bake::decode_checkpoint(file, key);
      return {};
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::checkpoint_refused);
      return error.what();
    }
  }
  const mesh::Scene scene_ = scene_of({cube()});
  const bake::BakeOptions options_ = small_field(0.1);
  const bake::BakeKey key_ = bake::key_of(scene_, options_, "");
  const Bytes file_ = bake::encode_checkpoint(
      key_, std::vector<KeptTraining>{{"cube", true, Bytes(40)}, {"ball", false, Bytes(300)}});
};

TEST_F(RefusedCheckpoint, OfAnythingElse) {
  EXPECT_EQ(refusal(file_, key_), "");
  const auto with = [&](auto&& change) {
    bake::BakeOptions options = options_;
    change(options);
    return refusal(file_, bake::key_of(scene_, options, ""));
  };
  const std::string other = "is of a bake with other options";
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.seed = 2; }), other);
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.resolution = 25; }), other);
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.preset = bake::Preset::high; }), other);
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.effort = 0.11; }), other);
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.max_error = 0.1; }), other);
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.prefer = bake::Preference::speed; }), other);
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.mix = bake::Mix{1, 0, 0, 0, 0}; }), other);
  EXPECT_EQ(with([](bake::BakeOptions& o) {
              o.error_limit = bake::ErrorLimit{bake::Mistake::leak, 0.1};
            }),
            other);
  EXPECT_EQ(with([](bake::BakeOptions& o) { o.spherical.fields.slope = 0.02f; }), other);
  EXPECT_EQ(refusal(file_, bake::key_of(scene_, options_, "another view")), other);
  EXPECT_EQ(refusal(file_, bake::key_of(scene_of({icosphere(1)}), options_, "")),
            "is of a bake of another mesh");
  mesh::Scene moved = scene_;
  moved.meshes[0].positions[0][0] += 0.001f;
  EXPECT_EQ(refusal(file_, bake::key_of(moved, options_, "")), "is of a bake of another mesh");
  bake::BakeKey newer = key_;
  newer.program = "9.9.9";
  EXPECT_EQ(refusal(file_, newer), "was made by another version of the program");
}

TEST_F(RefusedCheckpoint, WhateverIsDamaged) {
  for (size_t size = 0; size < file_.size(); ++size) {
    const Bytes part(file_.begin(), file_.begin() + ptrdiff_t(size));
    EXPECT_NE(refusal(part, key_), "") << size;
  }
  for (size_t bit = 0; bit < file_.size() * 8; ++bit) {
    Bytes damaged = file_;
    damaged[bit / 8] ^= std::byte(1 << bit % 8);
    EXPECT_NE(refusal(damaged, key_), "") << bit;
  }
  Bytes longer = file_;
  longer.push_back({});
  EXPECT_EQ(refusal(longer, key_), "is damaged");
}

TEST_F(RefusedCheckpoint, OfOtherObjectsOrSizes) {
  const auto resumed = [&](std::vector<KeptTraining> kept) {
    TrainingLog log(std::move(kept), 1, {});
    const std::atomic<bool> cancel{false};
    try {
      bake::bake(scene_of({torus(40, 20)}), options_, {}, cancel, &log);
      return std::string();
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::checkpoint_refused);
      return std::string(error.what());
    }
  };
  const std::string name = torus(40, 20).name;
  EXPECT_EQ(resumed({{name + "?", false, Bytes(300)}}), "has other objects than this bake");
  for (const bool finished : {false, true})
    for (const size_t size : {0, 7, 300, 1'000'000})
      EXPECT_EQ(resumed({{name, finished, Bytes(size)}}), "is damaged") << size;
}

}  // namespace
}  // namespace nif::test
