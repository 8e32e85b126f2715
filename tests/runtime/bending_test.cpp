// Instances that bend answer as an object whose mesh is the bent one, bit for bit, with every instruction set.
#include <cmath>
#include <cstring>
#include <memory_resource>

#include "tests/runtime/runtime_first_hits.hpp"
#include "tests/support/aligned.hpp"
#include "tests/support/plain_scene.hpp"
#include "tests/support/random_bvh.hpp"

namespace nif::test {
namespace {

using Positions = std::vector<std::array<float, 3>>;
using Joints = std::vector<std::array<float, 12>>;

/// Vertices moved as docs/answers.md says, operation by operation.
Positions posed(const Positions& rest, const format::Skin& skin, const Joints& joints,
                const std::vector<float>& weights) {
  Positions moved;
  for (size_t v = 0; v < rest.size(); ++v) {
    std::array<float, 3> from = rest[v], to{};
    for (size_t t = 0; t < weights.size(); ++t)
      for (size_t i = 0; i < 3; ++i) {
        const float move = weights[t] * skin.targets[t * rest.size() + v][i];
        from[i] = from[i] + move;
      }
    for (size_t row = 0; row < 3; ++row) {
      if (skin.influences == 0) {
        to[row] = from[row];
        continue;
      }
      float mean[4] = {};
      for (size_t column = 0; column < 4; ++column)
        for (size_t k = 0; k < skin.influences; ++k) {
          const size_t at = v * skin.influences + k;
          if (k != 0 && skin.weights[at] == 0) continue;
          const float part = joints[skin.joints[at]][4 * row + column] * skin.weights[at];
          mean[column] = k == 0 ? part : mean[column] + part;
        }
      const float x = mean[0] * from[0], y = mean[1] * from[1], z = mean[2] * from[2];
      to[row] = ((x + y) + z) + mean[3];
    }
    moved.push_back(to);
  }
  return moved;
}

Joints random_joints(Random& random, size_t count) {
  Joints joints(count);
  for (auto& matrix : joints)
    for (size_t i = 0; i < 12; ++i)
      matrix[i] = (i % 5 == 0 ? 1.0f : 0.0f) + (i % 4 == 3 ? 0.6f : 0.3f) * random.between(-1.0f, 1.0f);
  return joints;
}

constexpr const char* kDevices[] = {"isa=scalar",
                                    "isa=sse4",
                                    "isa=avx2",
                                    "isa=avx512",
                                    "isa=neon",
                                    "isa=avx2,memory=least",
                                    "isa=avx512,memory=least"};

class BendingTest : public RuntimeTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    const NifError error = nifNewDevice(GetParam(), nullptr, &device_);
    if (error == NIF_ERROR_NOT_AVAILABLE) GTEST_SKIP() << nifGetErrorMessage();
    ASSERT_EQ(error, NIF_OK);
  }

  /// An asset of one object of these triangles.
  NifAsset asset_of(const Soup& soup, uint64_t seed, const format::Skin* skin = nullptr, bool bends = true) {
    Random random(seed);
    format::Asset asset;
    format::Object& object = asset.objects.emplace_back();
    std::vector<uint32_t> order, sources;
    object.triangles = RandomTree(soup).pack(random, &order, &sources);
    object.triangle_count = uint32_t(soup.triangles.size());
    for (size_t a = 0; a < 3; ++a) {
      object.aabb_min[a] = object.aabb_max[a] = soup.positions[0][a];
      for (const auto& p : soup.positions) {
        object.aabb_min[a] = std::min(object.aabb_min[a], p[a]);
        object.aabb_max[a] = std::max(object.aabb_max[a], p[a]);
      }
    }
    object.bias = 1e-4f;
    object.numbers[format::kSourceTriangles] = {uint32_t(soup.triangles.size()), order};
    if (bends) object.numbers[format::kSourceVertices] = {uint32_t(soup.positions.size()), sources};
    if (skin) object.skin = *skin;
    file_ = format::encode(asset);
    view_ = std::make_unique<format::AssetView>(format::read_asset(file_, "file"));
    return load();
  }

  static std::vector<NifRay> rays_at(const Soup& soup, uint64_t seed, size_t count) {
    Random random(seed);
    const format::TrianglesData data = RandomTree(soup).pack(random);
    std::vector<NifRay> rays;
    while (rays.size() < count) rays.push_back(to_ray(random_segment(random, field_of(data))));
    return rays;
  }

  void expect_same(NifScene bent, NifScene fresh, const std::vector<NifRay>& rays) {
    const Answers answers = query_all(bent, rays), expected = query_all(fresh, rays);
    const FirstHits hits = intersect_all(bent, rays), first = intersect_all(fresh, rays);
    for (size_t i = 0; i < rays.size(); ++i) {
      SCOPED_TRACE("ray " + std::to_string(i));
      ASSERT_EQ(answers.visible[i], expected.visible[i]);
      ASSERT_EQ(answers.certain[i], expected.certain[i]);
      ASSERT_EQ(answers.logit[i], expected.logit[i]);
      ASSERT_EQ(hits.hit[i], first.hit[i]);
      ASSERT_EQ(hits.t[i], first.t[i]);
      // Of several triangles at the same t, the first of the object is hit, and trees have other orders. Many rays
      // go to vertices.
      if (hits.triangle[i] == first.triangle[i])
        for (size_t a = 0; a < 3; ++a) ASSERT_EQ(hits.normal[3 * i + a], first.normal[3 * i + a]);
      else
        ++other_triangles_;
      met_ += hits.hit[i];
    }
    auto own = nifkit::sized<NifSceneInfo>(), other = own;
    ASSERT_EQ(nifGetSceneInfo(bent, &own), NIF_OK);
    ASSERT_EQ(nifGetSceneInfo(fresh, &other), NIF_OK);
    for (size_t a = 0; a < 3; ++a) {
      ASSERT_EQ(own.bounds_min[a], other.bounds_min[a]);
      ASSERT_EQ(own.bounds_max[a], other.bounds_max[a]);
    }
  }

  uint64_t met_ = 0, other_triangles_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Each, BendingTest, testing::ValuesIn(kDevices), [](const auto& p) {
  std::string name = std::string(p.param).substr(4);
  const size_t comma = name.find(',');
  return comma == std::string::npos ? name : name.substr(0, comma) + "_least";
});

TEST_P(BendingTest, VerticesOfItsOwn) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    Random random(seed);
    Soup soup =
        random_soup(random, seed % 3 == 0 ? 9 : 300 + uint32_t(seed) * 50, seed == 7 ? 1000.0f : 0.0f);
    const NifScene scene = scene_of(asset_of(soup, seed), 0);
    for (int pose = 0; pose < 3; ++pose) {
      const float size = pose == 2 ? 1e6f : 1.0f;
      for (auto& p : soup.positions)
        for (float& x : p) x = (x + random.between(-0.3f, 0.3f)) * size;
      ASSERT_EQ(nifSetInstanceVertices(scene, 0, soup.positions[0].data(), sizeof(soup.positions[0])), NIF_OK)
          << nifGetErrorMessage();
      ASSERT_EQ(nifCommitScene(scene), NIF_OK);
      const NifScene fresh = scene_of(asset_of(soup, seed + 100, nullptr, false), 0);
      expect_same(scene, fresh, rays_at(soup, seed, 1500));
    }
  }
  EXPECT_GT(met_, 10'000u);
  EXPECT_LT(other_triangles_ * 5, met_);
}

TEST_P(BendingTest, Poses) {
  for (uint64_t seed = 0; seed < 9; ++seed) {
    Random random(seed);
    const Soup soup = random_soup(random, 400);
    const uint32_t influences = seed % 3 == 0   ? 4
                                : seed % 3 == 1 ? 8
                                                : 0,
                   targets = seed % 3 == 2 ? 3 : seed % 2;
    const format::Skin skin = random_skin(random, uint32_t(soup.positions.size()), influences, targets);
    const NifAsset asset = asset_of(soup, seed, &skin);
    auto info = nifkit::sized<NifObjectInfo>();
    ASSERT_EQ(nifGetObjectInfo(asset, 0, &info), NIF_OK);
    EXPECT_EQ(info.vertices, soup.positions.size());
    EXPECT_EQ(info.joints, skin.joint_count);
    EXPECT_EQ(info.targets, targets);
    const NifScene scene = scene_of(asset, 0);
    const Joints joints = random_joints(random, skin.joint_count);
    std::vector<float> weights;
    for (uint32_t t = 0; t < targets; ++t) weights.push_back(random.between(-1.0f, 1.0f));
    auto pose = nifkit::sized<NifPose>();
    pose.joints = joints.empty() ? nullptr : joints[0].data();
    pose.joint_count = skin.joint_count;
    pose.weights = weights.data();
    pose.target_count = targets;
    ASSERT_EQ(nifPoseInstance(scene, 0, &pose), NIF_OK) << nifGetErrorMessage();
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    const Soup moved{posed(soup.positions, skin, joints, weights), soup.triangles};
    expect_same(scene, scene_of(asset_of(moved, seed + 100, nullptr, false), 0), rays_at(moved, seed, 1500));
  }
  EXPECT_GT(met_, 3'000u);
}

/// A pose with positions is nifSetInstanceVertices, for objects with and without a skin.
TEST_P(BendingTest, PosesByPositions) {
  for (const bool skinned : {true, false}) {
    Random random(5);
    const Soup soup = random_soup(random, 200);
    const format::Skin skin = random_skin(random, uint32_t(soup.positions.size()), 4, 1);
    const NifAsset asset = asset_of(soup, 5, skinned ? &skin : nullptr);
    const NifScene scene = scene_of(asset, 0), expected = scene_of(asset, 0);
    std::vector<float> backwards(5 * soup.positions.size());
    Positions moved = soup.positions;
    for (size_t v = 0; v < moved.size(); ++v)
      for (size_t a = 0; a < 3; ++a) {
        moved[v][a] += random.between(-0.3f, 0.3f);
        backwards[5 * (moved.size() - 1 - v) + a] = moved[v][a];
      }
    auto pose = nifkit::sized<NifPose>();
    pose.positions = &backwards[5 * (moved.size() - 1)];
    pose.position_stride = uint64_t(-20);
    ASSERT_EQ(nifPoseInstance(scene, 0, &pose), NIF_OK) << nifGetErrorMessage();
    ASSERT_EQ(nifSetInstanceVertices(expected, 0, moved[0].data(), 12), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    ASSERT_EQ(nifCommitScene(expected), NIF_OK);
    expect_same(scene, expected, rays_at({moved, soup.triangles}, 6, 500));
    EXPECT_EQ(other_triangles_, 0u);
  }
  EXPECT_GT(met_, 200u);
}

/// A program that knows only the first members of NifPose.
TEST_P(BendingTest, PosesOfOldPrograms) {
  Random random(7);
  const Soup soup = random_soup(random, 200);
  const format::Skin skin = random_skin(random, uint32_t(soup.positions.size()), 4, 0);
  const NifScene scene = scene_of(asset_of(soup, 7, &skin), 0);
  const Joints joints = random_joints(random, skin.joint_count);
  NifPose pose;
  std::memset(&pose, 0x5a, sizeof(pose));  // what lies behind the structure
  pose.struct_size = 32;
  pose.joints = joints[0].data();
  pose.weights = nullptr;
  pose.joint_count = skin.joint_count;
  pose.target_count = 0;
  ASSERT_EQ(nifPoseInstance(scene, 0, &pose), NIF_OK) << nifGetErrorMessage();
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  const Soup moved{posed(soup.positions, skin, joints, {}), soup.triangles};
  expect_same(scene, scene_of(asset_of(moved, 107, nullptr, false), 0), rays_at(moved, 7, 500));
}

/// A soup whose triangles have vertices of their own: a pose moves those at the same place alike, but not if joints, weights
/// or targets differ, and nifSetInstanceVertices moves each.
TEST_P(BendingTest, VerticesAtTheSamePlace) {
  for (uint64_t seed = 0; seed < 6; ++seed) {
    Random random(seed);
    const Soup joined = random_soup(random, 150);
    const uint32_t influences = seed % 3 == 2 ? 0 : 4, targets = uint32_t(seed % 3);
    const format::Skin own = random_skin(random, uint32_t(joined.positions.size()), influences, targets);
    Soup soup;
    std::vector<uint32_t> from;
    for (const auto& triangle : joined.triangles) {
      const auto first = uint32_t(from.size());
      soup.triangles.push_back({first, first + 1, first + 2});
      from.insert(from.end(), triangle.begin(), triangle.end());
    }
    format::Skin skin{uint32_t(from.size()), own.joint_count, own.influences, own.target_count, {}, {}, {}};
    for (const uint32_t v : from) {
      soup.positions.push_back(joined.positions[v]);
      for (size_t k = v * influences; k < (v + 1) * influences; ++k) {
        skin.weights.push_back(own.weights[k]);
        skin.joints.push_back(own.joints[k]);
      }
    }
    for (size_t t = 0; t < targets; ++t)
      for (const uint32_t v : from) skin.targets.push_back(own.targets[t * joined.positions.size() + v]);
    // Some are moved in their own way.
    for (size_t v = 0; v < from.size(); v += 7) {
      if (influences != 0) std::swap(skin.weights[v * influences], skin.weights[v * influences + 1]);
      if (targets != 0) skin.targets[v][seed % 3] += 0.25f;
    }
    const NifScene scene = scene_of(asset_of(soup, seed, &skin), 0);
    for (int round = 0; round < 3; ++round) {
      Soup moved = soup;
      if (round == 1) {
        for (auto& p : moved.positions)
          for (float& x : p) x += random.between(-0.2f, 0.2f);
        ASSERT_EQ(nifSetInstanceVertices(scene, 0, moved.positions[0].data(), 12), NIF_OK);
      } else {
        const Joints joints = random_joints(random, skin.joint_count);
        std::vector<float> weights;
        for (uint32_t t = 0; t < targets; ++t) weights.push_back(random.between(-1.0f, 1.0f));
        auto pose = nifkit::sized<NifPose>();
        pose.joints = joints.empty() ? nullptr : joints[0].data();
        pose.joint_count = skin.joint_count;
        pose.weights = weights.data();
        pose.target_count = targets;
        ASSERT_EQ(nifPoseInstance(scene, 0, &pose), NIF_OK) << nifGetErrorMessage();
        moved.positions = posed(soup.positions, skin, joints, weights);
      }
      ASSERT_EQ(nifCommitScene(scene), NIF_OK);
      expect_same(scene, scene_of(asset_of(moved, seed + 100, nullptr, false), 0), rays_at(moved, seed, 600));
    }
    // The last call before a commit counts.
    ASSERT_EQ(nifSetInstanceVertices(scene, 0, nullptr, 0), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    expect_same(scene, scene_of(asset_of(soup, seed + 100, nullptr, false), 0), rays_at(soup, seed, 600));
  }
  EXPECT_GT(met_, 1'000u);
}

/// Each instance has a pose of its own; those without one are at rest, and so is one whose pose is taken back. Removed
/// ones leave no trace.
TEST_P(BendingTest, ManyInstances) {
  Random random(3);
  const Soup soup = random_soup(random, 200);
  const NifAsset asset = asset_of(soup, 1);
  struct Own {
    Soup soup;
    Matrix transform;
    bool exists = true;
  };
  std::vector<Own> instances;
  const NifScene scene = new_scene();
  const auto add = [&] {
    instances.push_back({soup, random_transform(random, 3)});
    uint32_t number = 0;
    ASSERT_EQ(nifAddInstance(scene, asset, 0, instances.back().transform.data(), &number), NIF_OK);
    ASSERT_EQ(number, instances.size() - 1);
  };
  for (int i = 0; i < 12; ++i) add();
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  for (int round = 0; round < 4; ++round) {
    for (uint32_t i = 0; i < instances.size(); ++i) {
      Own& own = instances[i];
      if (!own.exists) continue;
      const uint32_t what = random.below(4);
      if (what == 0) {
        own.soup = soup;
        ASSERT_EQ(nifSetInstanceVertices(scene, i, nullptr, 0), NIF_OK);
      } else if (what == 1) {
        own.transform = random_transform(random, 3);
        ASSERT_EQ(nifSetInstanceTransform(scene, i, own.transform.data()), NIF_OK);
      } else if (what == 2) {
        for (auto& p : own.soup.positions)
          for (float& x : p) x += random.between(-0.2f, 0.2f);
        ASSERT_EQ(nifSetInstanceVertices(scene, i, own.soup.positions[0].data(), 12), NIF_OK);
      }
    }
    if (round == 2)
      for (const uint32_t gone : {2u, 5u}) {
        instances[gone].exists = false;
        ASSERT_EQ(nifRemoveInstance(scene, gone), NIF_OK);
      }
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    const NifScene fresh = new_scene();
    std::vector<NifRay> rays;
    for (const Own& own : instances) {
      const NifAsset alone = asset_of(own.soup, 1, nullptr, false);
      ASSERT_EQ(nifAddInstance(fresh, alone, 0, own.transform.data(), nullptr), NIF_OK);
      for (const NifRay& ray : rays_at(own.soup, uint64_t(round), 200))
        rays.push_back(to_world(ray, own.transform));
    }
    for (uint32_t i = 0; i < instances.size(); ++i) {
      if (instances[i].exists) continue;
      ASSERT_EQ(nifSetInstanceMask(fresh, i, 0), NIF_OK);
    }
    ASSERT_EQ(nifCommitScene(fresh), NIF_OK);
    expect_same(scene, fresh, rays);
  }
  EXPECT_GT(met_, 2'000u);
}

/// Several threads commit together, with the same bits.
class BendingTogether : public BendingTest {};
INSTANTIATE_TEST_SUITE_P(Threads, BendingTogether,
                         testing::Values("threads=1", "threads=2", "threads=5", "threads=3,isa=scalar"),
                         [](const auto& p) { return "of_" + std::string(p.param).substr(8, 1); });

TEST_P(BendingTogether, AsOneByOne) {
  Random random(11);
  const Soup soup = random_soup(random, 500);
  const format::Skin skin = random_skin(random, uint32_t(soup.positions.size()), 4, 0);
  const NifAsset asset = asset_of(soup, 1, &skin);
  constexpr uint32_t kInstances = 40;  // 20,000 triangles: worth several threads
  const NifScene scene = new_scene();
  for (uint32_t i = 0; i < kInstances; ++i)
    ASSERT_EQ(nifAddInstance(scene, asset, 0, nullptr, nullptr), NIF_OK);
  std::vector<Soup> posed_soups(kInstances, soup);
  for (uint32_t round = 0; round < 3; ++round) {
    for (uint32_t i = 0; i < kInstances; ++i) {
      if (round != 0 && i % 5 == round) continue;  // as it was
      const Joints joints = random_joints(random, skin.joint_count);
      auto pose = nifkit::sized<NifPose>();
      pose.joints = joints[0].data();
      pose.joint_count = skin.joint_count;
      ASSERT_EQ(nifPoseInstance(scene, i, &pose), NIF_OK) << nifGetErrorMessage();
      posed_soups[i].positions = posed(soup.positions, skin, joints, {});
    }
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    for (uint32_t i = round; i < kInstances; i += 4) {  // each alone
      for (uint32_t other = 0; other < kInstances; ++other)
        ASSERT_EQ(nifSetInstanceMask(scene, other, other == i ? 1 : 0), NIF_OK);
      ASSERT_EQ(nifCommitScene(scene), NIF_OK);
      const NifScene fresh = scene_of(asset_of(posed_soups[i], 100 + i, nullptr, false), 0);
      expect_same(scene, fresh, rays_at(posed_soups[i], i, 100));
    }
    for (uint32_t i = 0; i < kInstances; ++i) ASSERT_EQ(nifSetInstanceMask(scene, i, 1), NIF_OK);
  }
  EXPECT_GT(met_, 500u);
}

/// Memory that vectors take if nobody says where from.
struct NoDefaultMemory {
  NoDefaultMemory() : before(std::pmr::set_default_resource(std::pmr::null_memory_resource())) {}
  ~NoDefaultMemory() { std::pmr::set_default_resource(before); }
  std::pmr::memory_resource* before;
};

/// With an allocator, what assets and instances that bend have comes from it, and goes back to it.
TEST_P(BendingTest, AllMemoryIsOfTheAllocator) {
  make(5, {.objects = 1, .bvhs = 2, .exacts = 1, .cutouts = 1, .skins = 2});
  uint64_t live = 0;
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  callbacks.user = &live;
  callbacks.allocate = [](void* user, uint64_t bytes, uint64_t alignment) -> void* {
    *static_cast<uint64_t*>(user) += bytes;
    return allocate_aligned(alignment, bytes);
  };
  callbacks.deallocate = [](void* user, void* memory, uint64_t bytes, uint64_t alignment) {
    *static_cast<uint64_t*>(user) -= bytes;
    free_aligned(alignment, memory);
  };
  {
    const nifkit::Device device(GetParam(), &callbacks);
    const NoDefaultMemory none;
    const nifkit::Asset asset = nifkit::Asset::load(device, std::span<const std::byte>(file_), NIF_LOAD_COPY);
    nifkit::Scene scene(device);
    for (uint32_t i = 0; i < 6; ++i) scene.add_instance(asset, 1 + i % 2);
    scene.commit();
    const uint64_t before = live, resident = scene.info().resident_bytes;
    for (uint32_t i = 0; i < 6; ++i) scene.set_instance_vertices(i, {});
    scene.commit();
    EXPECT_GE(live - before, scene.info().resident_bytes - resident);
    EXPECT_TRUE(scene.query(NifRay{{1e6f, 1e6f, 1e6f}, 0, {0, 0, 1}, 1}));
  }
  EXPECT_EQ(live, 0u);
}

TEST_P(BendingTest, BadInput) {
  Random random(5);
  const Soup soup = random_soup(random, 100);
  const format::Skin skin = random_skin(random, uint32_t(soup.positions.size()), 4, 1);
  const NifScene scene = scene_of(asset_of(soup, 1, &skin), 0),
                 stiff = scene_of(asset_of(soup, 1, nullptr, false), 0);
  const std::vector<NifRay> rays = rays_at(soup, 1, 500);
  const Answers before = query_all(scene, rays);

  const auto bytes = [&] {
    auto info = nifkit::sized<NifSceneInfo>();
    EXPECT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
    return info.resident_bytes;
  };
  const uint64_t stiff_bytes = bytes();

  Positions odd = soup.positions;
  const uint32_t used = soup.triangles[0][1];
  for (const float value : {NAN, INFINITY, 1e30f}) {
    odd[used][2] = value;
    EXPECT_EQ(nifSetInstanceVertices(scene, 0, odd[0].data(), 12), NIF_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(nifGetErrorMessage()).find("vertex " + std::to_string(used)), std::string::npos)
        << nifGetErrorMessage();
  }
  EXPECT_LE(bytes(), stiff_bytes + 1000) << "a first call that fails keeps no tree";
  EXPECT_EQ(nifSetInstanceVertices(scene, 1, odd[0].data(), 12), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifSetInstanceVertices(stiff, 0, soup.positions[0].data(), 12), NIF_ERROR_INVALID_OPERATION);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("--deforms"), std::string::npos) << nifGetErrorMessage();

  // Tables for shaders have objects at rest only.
  ASSERT_EQ(nifSetInstanceVertices(scene, 0, nullptr, 0), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  uint64_t words = 0;
  EXPECT_EQ(nifGetSceneShaderTables(scene, nullptr, 0, &words), NIF_ERROR_NOT_AVAILABLE);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("instance 0 bends"), std::string::npos)
      << nifGetErrorMessage();

  Joints joints = random_joints(random, skin.joint_count);
  const float weight = 0.5f;
  const auto refused = [&](auto change) {
    auto pose = nifkit::sized<NifPose>();
    pose.joints = joints[0].data();
    pose.joint_count = skin.joint_count;
    pose.weights = &weight;
    pose.target_count = 1;
    change(pose);
    EXPECT_EQ(nifPoseInstance(scene, 0, &pose), NIF_ERROR_INVALID_ARGUMENT);
    return std::string(nifGetErrorMessage());
  };
  EXPECT_NE(refused([](NifPose& pose) { ++pose.joint_count; }).find("joints, but the object"),
            std::string::npos);
  EXPECT_NE(refused([](NifPose& pose) { pose.target_count = 2; }).find("morph targets"), std::string::npos);
  EXPECT_NE(refused([](NifPose& pose) { pose.joints = nullptr; }).find("joints"), std::string::npos);
  EXPECT_NE(refused([](NifPose& pose) { pose.weights = nullptr; }).find("weights"), std::string::npos);
  EXPECT_NE(refused([](NifPose& pose) { pose.struct_size = 3; }).find("struct_size"), std::string::npos);
  EXPECT_NE(refused([](NifPose& pose) { pose.memory = 2; }).find("unknown memory kind 2"), std::string::npos);
  EXPECT_NE(refused([&](NifPose& pose) { pose.positions = &weight; }).find("has positions, and joints"),
            std::string::npos);
  for (const float value : {NAN, INFINITY, 1e20f}) {
    joints.back()[5] = value;
    EXPECT_NE(refused([](NifPose&) {}), "");
  }
  // Nothing has changed.
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  const Answers after = query_all(scene, rays);
  EXPECT_EQ(before.visible, after.visible);
  EXPECT_EQ(before.logit, after.logit);
}

}  // namespace
}  // namespace nif::test
