// How much work the runtime does for files of many objects and scenes of many instances, in steps of its code
// that are counted: unlike seconds, these are the same on every machine, however busy it is.
#include <cmath>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/many_objects.hpp"
#include "tests/support/plain_scene.hpp"

namespace {
uint64_t steps = 0;
}

/// What the compiler calls from each basic block of the runtime and the reader (CMakeLists.txt).
extern "C" void __sanitizer_cov_trace_pc() { ++steps; }

namespace nif::test {
namespace {

class Work : public RuntimeTest {
 protected:
  void SetUp() override { ASSERT_EQ(nifNewDevice("threads=1", nullptr, &device_), NIF_OK); }

  template <class Call>
  static double steps_of(const Call& call) {
    const uint64_t before = steps;
    call();
    return double(steps - before);
  }

  double steps_of_loading(uint32_t objects) {
    file_ = format::encode(many_objects(objects));
    return steps_of([&] { load(); });
  }

  /// Of a scene of turned instances: in a grid, as an army stands, or anywhere, as a forest does.
  struct Commits {
    double first, half_moved;
  };
  Commits steps_of_commits(uint32_t count, bool forest) {
    const NifAsset asset = load();
    const NifScene scene = new_scene();
    Random random(80);
    const auto side = uint32_t(std::sqrt(count));
    std::vector<Matrix> transforms;
    for (uint32_t i = 0; i < count; ++i) {
      const float angle = random.between(0.0f, 6.28f), c = std::cos(angle), s = std::sin(angle);
      const float x = forest ? random.between(0.0f, float(side)) : float(i % side),
                  y = forest ? random.between(0.0f, float(side)) : float(i / side);
      transforms.push_back({c, -s, 0, 8 * x, s, c, 0, 8 * y, 0, 0, 1, random.between(0.0f, 3.0f)});
      EXPECT_EQ(nifAddInstance(scene, asset, 0, transforms[i].data(), nullptr), NIF_OK);
    }
    const auto commit = [&] { EXPECT_EQ(nifCommitScene(scene), NIF_OK); };
    const double first = steps_of(commit);
    EXPECT_LT(steps_of(commit), 1000) << "nothing has changed";
    for (uint32_t i = 0; i < count; i += 2) {
      transforms[i][11] += 0.25f;
      EXPECT_EQ(nifSetInstanceTransform(scene, i, transforms[i].data()), NIF_OK);
    }
    return {first, steps_of(commit)};
  }
};

TEST_F(Work, OfLoadingGoesWithTheNumberOfObjects) {
  const double some = steps_of_loading(5'000), many = steps_of_loading(50'000);
  EXPECT_LT(many, 10 * some) << "ten times as many objects";
  RecordProperty("steps_an_object", std::to_string(many / 50'000));
}

TEST_F(Work, OfCommitsGoesWithTheNumberOfInstances) {
  make(80, {.objects = 1, .instances = 0});
  for (const bool forest : {false, true}) {
    SCOPED_TRACE(forest);
    const Commits some = steps_of_commits(1'000, forest), many = steps_of_commits(10'000, forest);
    EXPECT_LT(many.first, 15 * some.first) << "ten times as many instances, to be sorted";
    EXPECT_LT(many.half_moved, 11 * some.half_moved);
    EXPECT_LT(many.half_moved, many.first / 20) << "boxes grow, and are not sorted again";
    RecordProperty(forest ? "forest" : "grid", std::to_string(many.first / 10'000) + " steps an instance, " +
                                                   std::to_string(many.half_moved / 10'000) +
                                                   " where it moves");
  }
}

}  // namespace
}  // namespace nif::test
