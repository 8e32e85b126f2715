// Bad input gets the documented code or answer: null pointers, wrong sizes, invalid rays.
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/aligned.hpp"
#include "tests/support/beyond_grid.hpp"

namespace nif::test {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class BadInput : public RuntimeTest {};

TEST_F(BadInput, Null) {
  make(1);
  const NifAsset asset = load();
  const NifScene scene = scene_of(asset, 0);
  const NifRay ray{};
  uint8_t byte;
  uint64_t bytes;
  NifAsset other;
  NifScene other_scene;
  const auto invalid = [](NifError error) {
    return error == NIF_ERROR_INVALID_ARGUMENT && std::strstr(nifGetErrorMessage(), "null") != nullptr;
  };
  EXPECT_TRUE(invalid(nifNewDevice("", nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifGetDeviceInfo(nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifGetDeviceInfo(device_, nullptr)));
  EXPECT_TRUE(invalid(nifGetBackendInfo(0, nullptr)));
  EXPECT_TRUE(invalid(nifLoadAssetFile(nullptr, "x", NIF_LOAD_COPY, &other)));
  EXPECT_TRUE(invalid(nifLoadAssetFile(device_, nullptr, NIF_LOAD_COPY, &other)));
  EXPECT_TRUE(invalid(nifLoadAssetFile(device_, "x", NIF_LOAD_COPY, nullptr)));
  EXPECT_TRUE(invalid(nifLoadAssetMemory(nullptr, "x", 1, NIF_LOAD_COPY, &other)));
  EXPECT_TRUE(invalid(nifLoadAssetMemory(device_, "x", 1, NIF_LOAD_COPY, nullptr)));
  EXPECT_TRUE(invalid(nifGetAssetInfo(nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifGetAssetInfo(asset, nullptr)));
  EXPECT_TRUE(invalid(nifGetPartInfo(nullptr, 0, nullptr)));
  EXPECT_TRUE(invalid(nifGetPartInfo(asset, 0, nullptr)));
  EXPECT_TRUE(invalid(nifGetObjectInfo(nullptr, 0, nullptr)));
  EXPECT_TRUE(invalid(nifGetObjectInfo(asset, 0, nullptr)));
  EXPECT_TRUE(invalid(nifGetAssetInstanceInfo(nullptr, 0, nullptr)));
  EXPECT_TRUE(invalid(nifGetAssetInstanceInfo(asset, 0, nullptr)));
  EXPECT_TRUE(invalid(nifNewScene(nullptr, &other_scene)));
  EXPECT_TRUE(invalid(nifNewScene(device_, nullptr)));
  EXPECT_TRUE(invalid(nifAddInstance(nullptr, asset, 0, nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifAddInstance(scene, nullptr, 0, nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifAddAsset(nullptr, asset, nullptr, nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifAddAsset(scene, nullptr, nullptr, nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifSetInstanceTransform(nullptr, 0, nullptr)));
  EXPECT_TRUE(invalid(nifCommitScene(nullptr)));
  EXPECT_TRUE(invalid(nifGetSceneInfo(nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifGetSceneInfo(scene, nullptr)));
  EXPECT_TRUE(invalid(nifGetQueryScratchBytes(nullptr, 1, &bytes)));
  EXPECT_TRUE(invalid(nifGetQueryScratchBytes(scene, 1, nullptr)));
  const NifAnswers answers = only_visible(&byte);
  const NifRays rays = nifMakeRays(&ray, 1);
  const auto hits = nifkit::sized<NifHits>();
  EXPECT_TRUE(invalid(nifQuery(nullptr, nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifQuery(scene, nullptr, &answers)));
  EXPECT_TRUE(invalid(nifQuery(scene, &rays, nullptr)));
  EXPECT_TRUE(invalid(nifIntersect(scene, nullptr, &hits)));
  EXPECT_TRUE(invalid(nifIntersect(scene, &rays, nullptr)));
  EXPECT_TRUE(invalid(nifQueryRay(nullptr, &ray, &answers)));
  EXPECT_TRUE(invalid(nifQueryRay(scene, nullptr, &answers)));
  EXPECT_TRUE(invalid(nifQueryRay(scene, &ray, nullptr)));
  EXPECT_TRUE(invalid(nifIntersectRay(scene, nullptr, &hits)));
  EXPECT_TRUE(invalid(nifIntersectRay(scene, &ray, nullptr)));
  EXPECT_TRUE(invalid(nifLoadAssetReader(device_, nullptr, &other)));
  EXPECT_TRUE(invalid(nifRemoveInstance(nullptr, 0)));
  EXPECT_TRUE(invalid(nifSetInstanceTransforms(nullptr, 0, nullptr, nullptr, 0)));
  EXPECT_TRUE(invalid(nifSetInstanceTransforms(scene, 1, nullptr, nullptr, 0)));
  EXPECT_TRUE(invalid(nifSetInstanceOrigin(nullptr, 0, nullptr)));
  EXPECT_TRUE(invalid(nifSetSceneOrigin(nullptr, nullptr)));
  EXPECT_TRUE(invalid(nifSetInstanceMask(nullptr, 0, 1)));
  EXPECT_TRUE(invalid(nifSetInstanceFlags(nullptr, 0, 0)));
  EXPECT_TRUE(invalid(nifSetInstanceUser(nullptr, 0, 0)));
  EXPECT_TRUE(invalid(nifGetInstanceInfo(nullptr, 0, nullptr)));
  EXPECT_TRUE(invalid(nifGetInstanceInfo(scene, 0, nullptr)));
  EXPECT_TRUE(invalid(nifCancelJob(nullptr)));
  nifRetainDevice(nullptr);
  nifRetainAsset(nullptr);
  nifRetainScene(nullptr);
  nifReleaseDevice(nullptr);
  nifReleaseAsset(nullptr);
  nifReleaseScene(nullptr);
  nifReleaseJob(nullptr);
}

TEST_F(BadInput, DestroyedObjects) {
  // A handle is dead for good after its last reference was released: every call says so.
  make(9);
  NifDevice device = nullptr;
  NifAsset asset = nullptr;
  NifScene scene = nullptr;
  NifJob job = nullptr;
  ASSERT_EQ(nifNewDevice("threads=2", nullptr, &device), NIF_OK);
  ASSERT_EQ(nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &asset), NIF_OK);
  ASSERT_EQ(nifNewScene(device, &scene), NIF_OK);
  ASSERT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  const std::vector<NifRay> rays(4);
  uint8_t visible[4] = {7, 7, 7, 7};
  NifRays query = nifMakeRays(rays.data(), rays.size());
  auto outputs = nifkit::sized<NifAnswers>();
  outputs.visible = visible;
  ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
  ASSERT_EQ(nifWaitJob(job), NIF_OK);

  // A second reference keeps the handle alive; superfluous releases do not harm other handles.
  nifRetainAsset(asset);
  nifReleaseAsset(asset);
  auto about_asset = nifkit::sized<NifAssetInfo>();
  EXPECT_EQ(nifGetAssetInfo(asset, &about_asset), NIF_OK);
  for (int i = 0; i < 3; ++i) {
    nifReleaseDevice(device);
    nifReleaseAsset(asset);
    nifReleaseJob(job);
    nifRetainAsset(asset);
  }
  EXPECT_EQ(nifQuery(scene, &query, &outputs), NIF_OK) << "the scene keeps asset and device";
  NifScene later = nullptr;  // in the slot of a released one
  const auto gone = [](NifError error) {
    return error == NIF_ERROR_INVALID_ARGUMENT && std::strstr(nifGetErrorMessage(), "released") != nullptr;
  };
  auto about_device = nifkit::sized<NifDeviceInfo>();
  auto about_object = nifkit::sized<NifObjectInfo>();
  auto about_part = nifkit::sized<NifPartInfo>();
  auto about_instance = nifkit::sized<NifAssetInstanceInfo>();
  NifAsset other = nullptr;
  uint32_t done = 7;
  uint64_t bytes = 7;
  EXPECT_TRUE(gone(nifGetDeviceInfo(device, &about_device)));
  EXPECT_TRUE(gone(nifLoadAssetFile(device, "x", NIF_LOAD_COPY, &other)));
  EXPECT_TRUE(gone(nifLoadAssetMemory(device, "x", 1, NIF_LOAD_COPY, &other)));
  EXPECT_TRUE(gone(nifNewScene(device, &later)));
  EXPECT_TRUE(gone(nifGetAssetInfo(asset, &about_asset)));
  EXPECT_TRUE(gone(nifGetPartInfo(asset, 0, &about_part)));
  EXPECT_TRUE(gone(nifGetObjectInfo(asset, 0, &about_object)));
  EXPECT_TRUE(gone(nifGetAssetInstanceInfo(asset, 0, &about_instance)));
  EXPECT_TRUE(gone(nifAddInstance(scene, asset, 0, nullptr, nullptr)));
  EXPECT_TRUE(gone(nifAddAsset(scene, asset, nullptr, nullptr, nullptr)));
  EXPECT_TRUE(gone(nifWaitJob(job)));
  EXPECT_TRUE(gone(nifIsJobDone(job, &done)));

  nifReleaseScene(scene);
  ASSERT_EQ(nifNewScene(device_, &later), NIF_OK);
  for (int i = 0; i < 3; ++i) nifReleaseScene(scene);
  nifRetainScene(scene);
  const NifRay ray{};
  auto about_scene = nifkit::sized<NifSceneInfo>();
  const NifFallback none = [](void*, uint64_t, const uint64_t*, uint8_t*) {};
  visible[0] = 7;
  EXPECT_TRUE(gone(nifAddInstance(scene, asset, 0, nullptr, nullptr)));
  EXPECT_TRUE(gone(nifAddAsset(scene, asset, nullptr, nullptr, nullptr)));
  EXPECT_TRUE(gone(nifSetInstanceTransform(scene, 0, nullptr)));
  EXPECT_TRUE(gone(nifCommitScene(scene)));
  EXPECT_TRUE(gone(nifGetSceneInfo(scene, &about_scene)));
  EXPECT_TRUE(gone(nifGetQueryScratchBytes(scene, 1, &bytes)));
  EXPECT_TRUE(gone(nifQuery(scene, &query, &outputs)));
  EXPECT_TRUE(gone(nifQueryRay(scene, &ray, &outputs)));
  EXPECT_TRUE(gone(nifRemoveInstance(scene, 0)));
  EXPECT_TRUE(gone(nifSetSceneOrigin(scene, nullptr)));
  EXPECT_TRUE(gone(nifQueryWithFallback(scene, &query, &outputs, 1, none, nullptr)));
  EXPECT_TRUE(gone(nifQueryAsync(scene, &query, &outputs, &job)));
  EXPECT_EQ(visible[0], 7);
  EXPECT_EQ(nifGetSceneInfo(later, &about_scene), NIF_OK);
  nifReleaseScene(later);

  // Values that never were such a handle: handles of another kind, or any number.
  for (const uint64_t bits : {uint64_t(1), uint64_t(4096), uint64_t(0x7ffd12345678), ~uint64_t(0)}) {
    const auto wild = reinterpret_cast<NifScene>(bits);
    EXPECT_TRUE(gone(nifCommitScene(wild)));
    nifRetainScene(wild);
    nifReleaseScene(wild);
  }
  EXPECT_TRUE(gone(nifCommitScene(reinterpret_cast<NifScene>(device_))));
}

TEST_F(BadInput, MoreHandlesThanTheTableStartsWith) {
  std::vector<NifScene> scenes(5000, nullptr);
  for (int round = 0; round < 3; ++round) {
    for (NifScene& scene : scenes) {
      const NifScene before = scene;
      ASSERT_EQ(nifNewScene(device_, &scene), NIF_OK);
      ASSERT_NE(scene, before) << "a handle was used again";
      ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    }
    for (size_t i = 0; i < scenes.size(); ++i) {
      nifReleaseScene(scenes[i]);
      ASSERT_EQ(nifCommitScene(scenes[i]), NIF_ERROR_INVALID_ARGUMENT);
      if (i + 1 < scenes.size()) {
        ASSERT_EQ(nifCommitScene(scenes[i + 1]), NIF_OK);
      }
    }
  }
}

TEST_F(BadInput, Configurations) {
  const auto code_of = [](const char* config) {
    NifDevice device = nullptr;
    const NifError error = nifNewDevice(config, nullptr, &device);
    nifReleaseDevice(device);
    return error;
  };
  for (const char* good : {"", "threads=0", "threads=1024", "isa=auto", "isa=scalar", "backend=cpu",
                           "threads=2,isa=scalar,backend=cpu", "queries=0", "queries=3,threads=2",
                           "memory=auto", "memory=least"})
    EXPECT_EQ(code_of(good), NIF_OK) << good;
  for (const char* bad :
       {"threads", "threads=", "threads=-1", "threads=2x", "threads=1025", "threads=99999999999", "isa=mmx",
        "memory=most", "backend=vulkan", "speed=11", "queries=", "queries=1025", ",", "threads=1,,", "="})
    EXPECT_EQ(code_of(bad), NIF_ERROR_INVALID_ARGUMENT) << bad;
#if defined(__aarch64__)
  const char* foreign = "isa=avx2";
#else
  const char* foreign = "isa=neon";
#endif
  EXPECT_EQ(code_of(foreign), NIF_ERROR_NOT_AVAILABLE);
  auto info = nifkit::sized<NifDeviceInfo>();
  ASSERT_EQ(nifGetDeviceInfo(device_, &info), NIF_OK);
  EXPECT_EQ(info.threads, 1u);
  EXPECT_STRNE(info.isa, "auto");
  EXPECT_STREQ(info.backend, "cpu");
  auto backend = nifkit::sized<NifBackendInfo>();
  ASSERT_EQ(nifGetBackendInfo(0, &backend), NIF_OK);
  EXPECT_EQ(backend.available, 1u);
  // The machine may have a GPU; the outcome must match what nifGetBackendInfo() says.
  bool any = false;
  for (const uint32_t index : {1u, 2u}) {
    ASSERT_EQ(nifGetBackendInfo(index, &backend), NIF_OK);
    EXPECT_STREQ(backend.name, index == 1 ? "cuda" : "hip");
    EXPECT_EQ(backend.available, uint32_t(*backend.reason == 0));
    const std::string config = std::string("backend=") + backend.name;
    EXPECT_EQ(code_of(config.c_str()), backend.available ? NIF_OK : NIF_ERROR_NOT_AVAILABLE) << config;
    any = any || backend.available;
  }
  EXPECT_EQ(code_of("backend=gpu"), any ? NIF_OK : NIF_ERROR_NOT_AVAILABLE);
  EXPECT_EQ(code_of("device=0"), NIF_ERROR_INVALID_ARGUMENT) << "without a GPU backend";
  EXPECT_EQ(nifGetBackendInfo(3, &backend), NIF_ERROR_INVALID_ARGUMENT);
}

TEST_F(BadInput, CallbacksByHalves) {
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  callbacks.allocate = [](void*, uint64_t, uint64_t) -> void* { return nullptr; };
  NifDevice device = nullptr;
  EXPECT_EQ(nifNewDevice("", &callbacks, &device), NIF_ERROR_INVALID_ARGUMENT);
  callbacks.deallocate = [](void*, void*, uint64_t, uint64_t) {};
  EXPECT_EQ(nifNewDevice("", &callbacks, &device), NIF_ERROR_OUT_OF_MEMORY);
  callbacks = {};
  EXPECT_EQ(nifNewDevice("", &callbacks, &device), NIF_ERROR_INVALID_ARGUMENT) << "struct_size is 0";
  EXPECT_EQ(device, nullptr);
}

TEST_F(BadInput, StructureSizes) {
  make(2);
  const NifAsset asset = load();
  const NifScene scene = scene_of(asset, 0);
  NifAssetInfo info{};
  EXPECT_EQ(nifGetAssetInfo(asset, &info), NIF_ERROR_INVALID_ARGUMENT);
  info.struct_size = 0xcdcdcdcdcdcdcdcd;
  EXPECT_EQ(nifGetAssetInfo(asset, &info), NIF_ERROR_INVALID_ARGUMENT);

  // Smaller than in any program ever compiled.
  info.struct_size = offsetof(NifAssetInfo, network_count);
  EXPECT_EQ(nifGetAssetInfo(asset, &info), NIF_ERROR_INVALID_ARGUMENT);

  // A newer program: unknown members of outputs become zero, and unknown members of inputs must be zero.
  struct {
    NifAssetInfo info;
    uint64_t more;
  } newer{{}, 5};
  newer.info.struct_size = sizeof(newer);
  ASSERT_EQ(nifGetAssetInfo(asset, &newer.info), NIF_OK);
  EXPECT_EQ(newer.more, 0u);
  const auto answers = nifkit::sized<NifAnswers>();
  struct {
    NifRays rays;
    uint64_t more;
  } bigger{{}, 0};
  bigger.rays.struct_size = sizeof(bigger);
  EXPECT_EQ(nifQuery(scene, &bigger.rays, &answers), NIF_OK);
  bigger.more = 1;
  EXPECT_EQ(nifQuery(scene, &bigger.rays, &answers), NIF_ERROR_NOT_AVAILABLE);
  bigger.rays.struct_size = sizeof(NifRays) - 8;
  EXPECT_EQ(nifQuery(scene, &bigger.rays, &answers), NIF_ERROR_INVALID_ARGUMENT);
}

TEST_F(BadInput, Queries) {
  make(3);
  const NifScene scene = scene_of(load(), 0);
  std::vector<NifRay> rays(4);
  std::vector<uint8_t> visible(4, 7);
  const auto code_with = [&](auto&& change) {
    NifRays query = nifMakeRays(rays.data(), rays.size());
    const NifAnswers outputs = only_visible(visible.data());
    change(query);
    return nifQuery(scene, &query, &outputs);
  };
  EXPECT_EQ(code_with([](NifRays& query) { query.flags = 1; }), NIF_ERROR_NOT_AVAILABLE);
  EXPECT_EQ(code_with([](auto&) {}), NIF_OK);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(code_with([&](auto& q) { q.origin[a] = nullptr; }), NIF_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(code_with([&](auto& q) { q.direction[a] = nullptr; }), NIF_ERROR_INVALID_ARGUMENT);
  }
  EXPECT_EQ(code_with([](auto& q) { q.memory = NIF_MEMORY_DEVICE; }), NIF_ERROR_NOT_AVAILABLE);
  EXPECT_EQ(code_with([](auto& q) { q.memory = 9; }), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(code_with([&](auto& q) { q.stream = &rays; }), NIF_ERROR_NOT_AVAILABLE);
  // No rays: nothing is read or written, whatever the pointers.
  std::fill(visible.begin(), visible.end(), uint8_t(7));
  EXPECT_EQ(code_with([](auto& q) { q.count = 0; }), NIF_OK);
  EXPECT_EQ(visible[0], 7);
  const auto nothing = nifkit::sized<NifAnswers>();
  const NifRays some = nifMakeRays(rays.data(), rays.size()), none = nifMakeRays(nullptr, 0);
  EXPECT_EQ(nifQuery(scene, &none, &nothing), NIF_OK);
  EXPECT_EQ(nifQuery(scene, &some, &nothing), NIF_ERROR_INVALID_ARGUMENT) << "no output";
  uint64_t bytes = 1;
  EXPECT_EQ(nifGetQueryScratchBytes(scene, 0, &bytes), NIF_OK);
  EXPECT_EQ(bytes, 0u);
  EXPECT_EQ(nifGetQueryScratchBytes(scene, ~uint64_t{0}, &bytes), NIF_OK);
  const AlignedBytes memory(bytes + 64);
  void* scratch = memory.get();
  EXPECT_EQ(code_with([&](auto& q) { q.scratch = scratch, q.scratch_bytes = bytes; }), NIF_OK);
  EXPECT_EQ(code_with([&](auto& q) { q.scratch = scratch, q.scratch_bytes = bytes - 1; }),
            NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(code_with([&](auto& q) { q.scratch = static_cast<char*>(scratch) + 8, q.scratch_bytes = bytes; }),
            NIF_ERROR_INVALID_ARGUMENT);
}

TEST_F(BadInput, ScenesThatAreNotReady) {
  make(4);
  const NifAsset asset = load();
  const NifScene scene = new_scene();
  const NifRay ray{{0, 0, 0}, 0, {1, 0, 0}, 1};
  uint8_t visible = 9;
  const NifAnswers one = only_visible(&visible);
  EXPECT_EQ(nifQueryRay(scene, &ray, &one), NIF_ERROR_INVALID_OPERATION);
  EXPECT_EQ(visible, 9);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_EQ(nifQueryRay(scene, &ray, &one), NIF_OK);
  EXPECT_EQ(visible, 1) << "nothing blocks in an empty scene";
  ASSERT_EQ(nifAddInstance(scene, asset, 0, nullptr, nullptr), NIF_OK);
  EXPECT_EQ(nifQueryRay(scene, &ray, &one), NIF_ERROR_INVALID_OPERATION);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_EQ(nifQueryRay(scene, &ray, &one), NIF_OK);
  ASSERT_EQ(nifSetInstanceTransform(scene, 0, kIdentity.data()), NIF_OK);
  EXPECT_EQ(nifQueryRay(scene, &ray, &one), NIF_ERROR_INVALID_OPERATION);

  EXPECT_EQ(nifAddInstance(scene, asset, 3, nullptr, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifSetInstanceTransform(scene, 1, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  NifDevice other = nullptr;
  ASSERT_EQ(nifNewDevice(nullptr, nullptr, &other), NIF_OK);
  NifScene foreign = nullptr;
  ASSERT_EQ(nifNewScene(other, &foreign), NIF_OK);
  EXPECT_EQ(nifAddInstance(foreign, asset, 0, nullptr, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifAddAsset(foreign, asset, nullptr, nullptr, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  nifReleaseScene(foreign);
  nifReleaseDevice(other);
}

TEST_F(BadInput, Transforms) {
  make(5);
  const NifAsset asset = load();
  const NifScene scene = scene_of(asset, 0);
  const auto code_of = [&](std::array<float, 12> transform) {
    const NifError error = nifAddInstance(scene, asset, 0, transform.data(), nullptr);
    EXPECT_EQ(nifSetInstanceTransform(scene, 0, transform.data()), error);
    EXPECT_EQ(nifAddAsset(scene, asset, transform.data(), nullptr, nullptr), error);
    return error;
  };
  EXPECT_EQ(code_of({0}), NIF_ERROR_SINGULAR_TRANSFORM);
  EXPECT_EQ(code_of({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}), NIF_ERROR_SINGULAR_TRANSFORM);
  EXPECT_EQ(code_of({1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0}), NIF_ERROR_SINGULAR_TRANSFORM);
  EXPECT_EQ(code_of({1e-44f, 0, 0, 0, 0, 1e-44f, 0, 0, 0, 0, 1e-44f, 0}), NIF_ERROR_SINGULAR_TRANSFORM);
  for (size_t i = 0; i < 12; ++i)
    for (const float bad : {kInf, -kInf, kNan}) {
      auto transform = kIdentity;
      transform[i] = bad;
      EXPECT_EQ(code_of(transform), NIF_ERROR_INVALID_ARGUMENT);
    }
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_EQ(info.instance_count, 1u) << "a failed call changed the scene";
}

TEST_F(BadInput, MessagesNameTheAssetAndThePlace) {
  format::Asset source = random_asset(8);
  source.instances[2].transform = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0};
  file_ = format::encode(source);
  const NifAsset asset = load();
  const NifScene scene = new_scene();
  EXPECT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_ERROR_SINGULAR_TRANSFORM);
  EXPECT_NE(std::strstr(nifGetErrorMessage(), "memory: instance 2 (instance 2): "), nullptr);
  EXPECT_EQ(nifAddInstance(scene, asset, 3, nullptr, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(nifGetErrorMessage(), "memory: no object 3; there are only 3");
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_EQ(info.instance_count, 0u);
}

TEST_F(BadInput, InvalidRays) {
  const format::AssetView& view = make(6, {.objects = 2, .bvhs = 1});
  const NifAsset asset = load();
  const std::array<float, 12> turned{0, -2, 0, 5, 2, 0, 0, 1, 0, 0, 2, 0};
  const NifRay good = to_ray({{0, 0, 0}, {1, 1, 1}, 0, 1});
  std::vector<NifRay> rays;
  for (const float bad : {kNan, kInf, -kInf})
    for (int a = 0; a < 3; ++a) {
      rays.push_back(good);
      rays.back().origin[a] = bad;
      rays.push_back(good);
      rays.back().direction[a] = bad;
    }
  for (const float tiny : {0.0f, 1e-44f, 1e-30f}) {
    rays.push_back(good);
    for (float& d : rays.back().direction) d = tiny;
  }
  rays.push_back(good);
  for (float& d : rays.back().direction) d = 3e38f;
  for (const auto& [tmin, tmax] : {std::pair{kNan, 1.0f}, {0.0f, kNan}, {kNan, kNan}}) {
    rays.push_back(good);
    rays.back().tmin = tmin;
    rays.back().tmax = tmax;
  }
  std::vector<NifRay> empty;
  for (const auto& [tmin, tmax] : {std::pair{1.0f, 0.0f}, {kInf, 0.0f}, {kInf, -kInf}}) {
    empty.push_back(good);
    empty.back().tmin = tmin;
    empty.back().tmax = tmax;
  }
  std::vector<NifScene> scenes;
  for (const uint32_t object : {0, 2}) {  // one per encoding
    scenes.push_back(scene_of(asset, object));
    scenes.push_back(scene_of(asset, object, turned.data()));
  }
  scenes.push_back(new_scene());  // several instances of both
  for (int i = 0; i < 9; ++i)
    ASSERT_EQ(nifAddInstance(scenes.back(), asset, i % 3, i < 5 ? nullptr : turned.data(), nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scenes.back()), NIF_OK);
  for (const NifScene scene : scenes) {
    const Answers answers = query_all(scene, rays);
    for (size_t i = 0; i < rays.size(); ++i) {
      EXPECT_EQ(answers.visible[i], 1) << i;
      EXPECT_EQ(answers.certain[i], 0) << i;
    }
    const Answers nothing = query_all(scene, empty);
    for (size_t i = 0; i < empty.size(); ++i) {
      EXPECT_EQ(nothing.visible[i], 1) << i;
      EXPECT_EQ(nothing.certain[i], 1) << i;
      EXPECT_EQ(nothing.probability[i], 1.0f) << i;
    }
  }
  // Arbitrary bits get the reference's answer, and do not crash.
  Random random(6);
  std::vector<NifRay> noise(5000);
  for (NifRay& ray : noise) {
    uint32_t words[8];
    for (uint32_t& word : words) word = random.below(0xffffffff);
    std::memcpy(&ray, words, sizeof(ray));
  }
  const Answers answers = query_all(scene_of(asset, 1), noise);
  for (size_t i = 0; i < noise.size(); ++i) {
    const auto expected = kernels::query(view.objects[1].as<kernels::SegmentField>(), to_segment(noise[i]));
    EXPECT_EQ(answers.visible[i], expected.visible);
    EXPECT_EQ(answers.certain[i], expected.certain);
  }
  query_all(scene_of(asset, 1, turned.data()), noise);
  query_all(scenes.back(), noise);
}

TEST_F(BadInput, JobsAndFallbacks) {
  make(7);
  const NifAsset asset = load();
  const NifScene scene = scene_of(asset, 0), uncommitted = new_scene();
  std::vector<NifRay> rays(4);
  std::vector<uint8_t> visible(4, 7);
  NifRays query = nifMakeRays(rays.data(), rays.size());
  auto outputs = nifkit::sized<NifAnswers>();
  const NifFallback none = [](void*, uint64_t, const uint64_t*, uint8_t*) {};
  NifJob job = nullptr;
  uint32_t done = 7;
  EXPECT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_ERROR_INVALID_ARGUMENT) << "no output";
  EXPECT_EQ(nifQueryWithFallback(scene, &query, &outputs, 0.9f, none, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  outputs.visible = visible.data();
  EXPECT_EQ(nifQueryAsync(nullptr, &query, &outputs, &job), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryAsync(scene, nullptr, &outputs, &job), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryAsync(scene, &query, &outputs, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryAsync(uncommitted, &query, &outputs, &job), NIF_ERROR_INVALID_OPERATION);
  EXPECT_EQ(job, nullptr);
  EXPECT_EQ(nifWaitJob(nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifIsJobDone(nullptr, &done), NIF_ERROR_INVALID_ARGUMENT);
  nifRetainJob(nullptr);
  nifReleaseJob(nullptr);
  EXPECT_EQ(nifQueryWithFallback(nullptr, &query, &outputs, 0.9f, none, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryWithFallback(scene, nullptr, &outputs, 0.9f, none, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryWithFallback(scene, &query, &outputs, 0.9f, nullptr, nullptr),
            NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryWithFallback(uncommitted, &query, &outputs, 0.9f, none, nullptr),
            NIF_ERROR_INVALID_OPERATION);
  for (const float confidence : {kNan, -kInf, -0.1f})
    EXPECT_EQ(nifQueryWithFallback(scene, &query, &outputs, confidence, none, nullptr),
              NIF_ERROR_INVALID_ARGUMENT);
  for (const float confidence : {0.0f, 1.0f, kInf})
    EXPECT_EQ(nifQueryWithFallback(scene, &query, &outputs, confidence, none, nullptr), NIF_OK);

  // No rays: done at once.
  query = nifMakeRays(nullptr, 0);
  EXPECT_EQ(nifQueryWithFallback(scene, &query, &outputs, 0.9f, none, nullptr), NIF_OK);
  ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
  EXPECT_EQ(nifIsJobDone(job, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifIsJobDone(job, &done), NIF_OK);
  EXPECT_EQ(done, 1u);
  EXPECT_EQ(nifWaitJob(job), NIF_OK);
  nifReleaseJob(job);
}

TEST(Errors, NamesArePinned) {
  const std::pair<int, const char*> pinned[] = {{0, "NIF_OK"},
                                                {1, "NIF_ERROR_UNKNOWN"},
                                                {2, "NIF_ERROR_INVALID_ARGUMENT"},
                                                {3, "NIF_ERROR_INVALID_OPERATION"},
                                                {4, "NIF_ERROR_OUT_OF_MEMORY"},
                                                {5, "NIF_ERROR_NOT_AVAILABLE"},
                                                {6, "NIF_ERROR_CANCELLED"},
                                                {7, "NIF_ERROR_SINGULAR_TRANSFORM"},
                                                {10, "NIF_ERROR_FILE_NOT_FOUND"},
                                                {11, "NIF_ERROR_FILE_UNREADABLE"},
                                                {12, "NIF_ERROR_FILE_EMPTY"},
                                                {13, "NIF_ERROR_FILE_TRUNCATED"},
                                                {30, "NIF_ERROR_NOT_A_NIF"},
                                                {31, "NIF_ERROR_FOREIGN_NIF"},
                                                {32, "NIF_ERROR_DAMAGED_NIF"},
                                                {33, "NIF_ERROR_UNSUPPORTED_NIF"},
                                                {60, "NIF_ERROR_DEVICE_LOST"},
                                                {61, "NIF_ERROR_OUT_OF_DEVICE_MEMORY"},
                                                {62, "NIF_ERROR_WRONG_POINTER"}};
  for (const auto& [number, name] : pinned) EXPECT_STREQ(nifGetErrorName(NifError(number)), name);
  EXPECT_STREQ(nifGetErrorName(NifError(9)), "unknown error code");
}

/// From which the kernels' own tables would be built.
TEST_F(BadInput, SurfaceBitsBeyondTheGrid) {
  for (const BeyondGrid& kind : kBeyondGrid) {
    const FileBeyondGrid file = file_beyond_grid(kind);
    const ExactBuffer bad(file.bad);
    NifAsset asset = nullptr;
    EXPECT_EQ(nifLoadAssetMemory(device_, bad.bytes().data(), bad.bytes().size(), NIF_LOAD_COPY, &asset),
              NIF_ERROR_DAMAGED_NIF);
    EXPECT_EQ(nifGetErrorMessage(), std::string("memory: ") + kBeyondGridSentence);
    EXPECT_EQ(asset, nullptr);
    file_ = file.good;
    scene_of(load(), 0);
  }
}

}  // namespace
}  // namespace nif::test
