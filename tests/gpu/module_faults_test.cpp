// Failures of GPUs: each gives a code and a sentence, and leaves a scene that the CPU still answers.
#include <cstdlib>
#include <thread>

#include "tests/gpu/module_fixture.hpp"
#include "tests/runtime/runtime_first_hits.hpp"
#include "tests/support/beyond_grid.hpp"

namespace nif::test {
namespace {

class GpuFaults : public GpuModuleTest {
 protected:
  /// Code and sentence of an attempt to make a device.
  static NifError code_of(const std::string& config) {
    NifDevice device = nullptr;
    const NifError error = nifNewDevice(config.c_str(), nullptr, &device);
    nifReleaseDevice(device);
    return error;
  }
  static void expect_unavailable(const std::string& config, const char* why) {
    EXPECT_EQ(code_of(config), NIF_ERROR_NOT_AVAILABLE) << config;
    EXPECT_NE(std::string(nifGetErrorMessage()).find(why), std::string::npos) << nifGetErrorMessage();
  }
  /// 1: cuda; 2: hip, the backend of the emulated GPUs.
  static NifBackendInfo gpu_backend(uint32_t index = 2) {
    auto info = nifkit::sized<NifBackendInfo>();
    EXPECT_EQ(nifGetBackendInfo(index, &info), NIF_OK);
    EXPECT_STREQ(info.name, index == 1 ? "cuda" : "hip");
    return info;
  }

  static void fill(TwinScenes& twins) {
    Random random(1);
    const uint32_t asset = twins.load(random_asset(1, {.objects = 2, .bvhs = 1, .sphericals = 1}));
    for (uint32_t i = 0; i < 7; ++i) twins.add(asset, i % 4, random_transform(random, 5));
  }
  static std::vector<NifRay> some_rays() {
    Random random(2);
    return rays_in_cube(random, 7, 500);
  }
};

TEST_F(GpuFaults, OfTheModule) {
  expect_unavailable("backend=gpu,module=/no/such/module.so", "/no/such/module.so cannot be loaded");
  expect_unavailable("backend=gpu,module=/dev/null", "/dev/null cannot be loaded");
  expect_unavailable("backend=gpu,module=libc.so.6", "libc.so.6 is no GPU module");
  EXPECT_EQ(code_of("device=0"), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(code_of("module=" NIF_EMULATED_MODULE), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(code_of("backend=gpu,device=x"), NIF_ERROR_INVALID_ARGUMENT);
}

TEST_F(GpuFaults, OfTheMachine) {
  machine().no_driver = true;
  expect_unavailable(config(), "there is no driver");
  machine().no_driver = false;
  machine().driver_too_old = true;
  expect_unavailable(config(), "too old");
  machine().driver_too_old = false;
  machine().gpus = 0;
  expect_unavailable(config(), "finds no GPU");
  machine().gpus = 2;
  expect_unavailable(config(2), "there is no GPU 2; the drivers find 2");
  machine().no_image = true;
  expect_unavailable(config(), "has no kernels for wmma");
  machine().no_image = false;
  EXPECT_EQ(code_of(config(1)), NIF_OK) << nifGetErrorMessage();
}

/// The numbers by which an engine finds the GPU that it renders on.
TEST_F(GpuFaults, GpusAreToldApart) {
  ASSERT_EQ(setenv("NIF_GPU_MODULE", NIF_EMULATED_MODULE, 1), 0);
  for (uint32_t number = 0; number < machine().gpus; ++number) {
    const NifGpuInfo gpu = nifkit::gpu(number);
    EXPECT_EQ(gpu.pci_domain, 1u);
    EXPECT_EQ(gpu.pci_bus, number + 2);
    EXPECT_EQ(gpu.pci_device, 3u);
    uint8_t uuid[16] = {0xab, uint8_t(number)}, luid[8] = {0xcd, uint8_t(number)};
    EXPECT_EQ(std::memcmp(gpu.uuid, uuid, sizeof(uuid)), 0);
    EXPECT_EQ(std::memcmp(gpu.luid, luid, sizeof(luid)), 0);
    EXPECT_EQ(gpu.has_luid, 1u);
    EXPECT_EQ(gpu.reserved, 0u);
    EXPECT_EQ(gpu.struct_size, sizeof(gpu));
  }
  machine().no_place = true;
  const NifGpuInfo gpu = nifkit::gpu(1);
  const uint8_t zeros[16] = {};
  EXPECT_EQ(std::memcmp(gpu.uuid, zeros, sizeof(zeros)), 0);
  EXPECT_EQ(gpu.has_luid, 0u);
  EXPECT_STREQ(gpu.name, "emulated GPU 1");
  unsetenv("NIF_GPU_MODULE");
}

/// All of its GPUs belong to HIP.
TEST_F(GpuFaults, OfABackendWithoutGpus) {
  const std::string module = ",module=" NIF_EMULATED_MODULE;
  expect_unavailable("backend=cuda,device=0" + module, "GPU 0 (emulated GPU 0) is one of hip, not of cuda");
  expect_unavailable("backend=cuda" + module, "there is no GPU of cuda");
  EXPECT_EQ(code_of("backend=hip" + module), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(code_of("backend=hip,device=1" + module), NIF_OK) << nifGetErrorMessage();
  machine().gpus = 0;
  expect_unavailable("backend=cuda" + module, "finds no GPU");
  machine().gpus = 2;
  ASSERT_EQ(setenv("NIF_GPU_MODULE", NIF_EMULATED_MODULE, 1), 0);
  EXPECT_EQ(gpu_backend(1).available, 0u);
  EXPECT_STREQ(gpu_backend(1).reason, "there is no GPU of cuda");
  EXPECT_EQ(gpu_backend(2).available, 1u);
  unsetenv("NIF_GPU_MODULE");
}

/// The calls that describe backends and GPUs give the same reasons, and look again each time.
TEST_F(GpuFaults, AreToldBeforehand) {
  ASSERT_EQ(setenv("NIF_GPU_MODULE", NIF_EMULATED_MODULE, 1), 0);
  EXPECT_EQ(gpu_backend().available, 1u);
  EXPECT_STREQ(gpu_backend().reason, "");
  auto gpu = nifkit::sized<NifGpuInfo>();
  ASSERT_EQ(nifGetGpuInfo(1, &gpu), NIF_OK) << nifGetErrorMessage();
  EXPECT_STREQ(gpu.name, "emulated GPU 1");
  EXPECT_STREQ(gpu.target, "imma");
  EXPECT_STREQ(gpu.driver, "emulated 1.0");
  EXPECT_EQ(gpu.memory_bytes, uint64_t{1} << 30);
  EXPECT_EQ(gpu.available, 1u);
  EXPECT_STREQ(gpu.reason, "");
  EXPECT_STREQ(gpu.backend, "hip");
  EXPECT_EQ(nifGetGpuInfo(6, &gpu), NIF_ERROR_INVALID_ARGUMENT);

  machine().no_image = true;
  EXPECT_EQ(gpu_backend().available, 0u);
  EXPECT_NE(std::string(gpu_backend().reason).find("no kernels"), std::string::npos);
  ASSERT_EQ(nifGetGpuInfo(0, &gpu), NIF_OK);
  EXPECT_EQ(gpu.available, 0u);
  EXPECT_NE(std::string(gpu.reason).find("no kernels"), std::string::npos);
  machine().no_image = false;
  machine().no_driver = true;
  EXPECT_NE(std::string(gpu_backend().reason).find("no driver"), std::string::npos);
  EXPECT_EQ(nifGetGpuInfo(0, &gpu), NIF_ERROR_NOT_AVAILABLE);
  ASSERT_EQ(setenv("NIF_GPU_MODULE", "/no/such/module.so", 1), 0);
  EXPECT_NE(std::string(gpu_backend().reason).find("/no/such/module.so cannot be loaded"), std::string::npos);
  EXPECT_EQ(nifGetGpuInfo(0, &gpu), NIF_ERROR_NOT_AVAILABLE);
  unsetenv("NIF_GPU_MODULE");
}

TEST_F(GpuFaults, TellsWhatTheDeviceIs) {
  const nifkit::Device device(config(1));
  const NifDeviceInfo info = device.info();
  EXPECT_STREQ(info.backend, "hip");
  EXPECT_STREQ(info.gpu, "emulated GPU 1");
  EXPECT_STREQ(nifkit::Device("backend=gpu,module=" NIF_EMULATED_MODULE).info().backend, "hip");
}

/// Memory runs out at the first allocation of a commit, or the second, and so on.
TEST_F(GpuFaults, OutOfMemoryAtACommit) {
  const std::vector<NifRay> rays = some_rays();
  uint32_t failures = 0;
  for (uint32_t nth = 1;; ++nth) {
    TwinScenes twins(config());
    fill(twins);
    ASSERT_EQ(nifCommitScene(twins.cpu()), NIF_OK);
    const Answers expected = query_all(twins.cpu(), rays);
    machine().fail_allocation = nth;
    const NifError error = nifCommitScene(twins.gpu());
    machine().fail_allocation = 0;
    if (error == NIF_OK) break;
    ++failures;
    EXPECT_EQ(error, NIF_ERROR_OUT_OF_DEVICE_MEMORY);
    EXPECT_NE(std::string(nifGetErrorMessage()).find("no memory left"), std::string::npos);
    // The CPU answers, with the same bits; the GPU does not.
    const uint32_t launches = machine().launches;
    EXPECT_EQ(query_all(twins.gpu(), rays), expected);
    EXPECT_EQ(machine().launches, launches);
    NifRays query = nifMakeRays(rays.data(), rays.size());
    uint8_t visible;
    auto outputs = nifkit::sized<NifAnswers>();
    outputs.visible = &visible;
    query.memory = NIF_MEMORY_DEVICE;
    EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_INVALID_OPERATION);
    // The next commit tries again.
    ASSERT_EQ(nifCommitScene(twins.gpu()), NIF_OK) << nifGetErrorMessage();
    expect_same(query_all(twins.gpu(), rays), expected);
    EXPECT_GT(machine().launches, launches);
  }
  EXPECT_EQ(failures, 2u) << "the asset, and the scene";
}

TEST_F(GpuFaults, OutOfMemoryAtAQuery) {
  const std::vector<NifRay> rays = some_rays();
  TwinScenes twins(config());
  fill(twins);
  twins.commit();
  Answers answers(rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  machine().fail_allocation = 1;
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_OUT_OF_DEVICE_MEMORY);
  NifJob job = nullptr;
  machine().fail_allocation = 1;
  EXPECT_EQ(nifQueryAsync(twins.gpu(), &query, &outputs, &job), NIF_ERROR_OUT_OF_DEVICE_MEMORY);
  EXPECT_EQ(job, nullptr);
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK);
  expect_same(answers, query_all(twins.cpu(), rays));
}

/// If the GPU has no room for a growing scene, the CPU answers the new scene.
TEST_F(GpuFaults, OutOfMemoryAtALaterCommit) {
  const std::vector<NifRay> rays = some_rays();
  TwinScenes twins(config());
  fill(twins);
  twins.commit();
  Random random(4);
  for (uint32_t i = 0; i < 50; ++i) twins.add(0, i % 4, random_transform(random, 5));
  ASSERT_EQ(nifCommitScene(twins.cpu()), NIF_OK);
  machine().fail_allocation = 1;
  EXPECT_EQ(nifCommitScene(twins.gpu()), NIF_ERROR_OUT_OF_DEVICE_MEMORY);
  const Answers expected = query_all(twins.cpu(), rays);
  EXPECT_EQ(query_all(twins.gpu(), rays), expected);
  ASSERT_EQ(nifCommitScene(twins.gpu()), NIF_OK);
  expect_same(query_all(twins.gpu(), rays), expected);
}

/// Work that a failed query has put into the stream is done when it returns, because no commit would wait for
/// it.
TEST_F(GpuFaults, QueriesThatFailHalfWayAreWaitedFor) {
  const std::vector<NifRay> rays = some_rays();
  TwinScenes twins(config() + ",pipeline=off");
  fill(twins);
  twins.commit();
  const GpuArray on_gpu(machine(), 0, rays.data(), rays.size() * sizeof(NifRay));
  const GpuAnswerArrays answers(machine(), 0, rays.size());
  NifRays query = nifMakeRays(on_gpu.as<NifRay>(), rays.size());
  query.memory = NIF_MEMORY_DEVICE;
  const NifAnswers outputs = answers.outputs();
  machine().fail_record = 1;
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_UNKNOWN);
  EXPECT_EQ(machine().fail_record, 0u);
  expect_same(answers.get(), query_all(twins.cpu(), rays));
}

/// The query that notices the loss fails; then the CPU answers. Nothing is freed on a lost GPU, and nothing
/// hangs.
TEST_F(GpuFaults, ALostGpu) {
  const std::vector<NifRay> rays = some_rays();
  const auto lose = [&](bool by_job) {
    TwinScenes twins(config());
    fill(twins);
    twins.commit();
    Answers answers(rays.size());
    NifRays query = nifMakeRays(rays.data(), rays.size());
    const NifAnswers outputs = answers.outputs();
    const GpuArray on_gpu(machine(), 0, rays.data(), rays.size() * sizeof(NifRay));
    const GpuArray visible(machine(), 0, nullptr, rays.size());
    NifRays gpu_query = nifMakeRays(on_gpu.as<NifRay>(), rays.size());
    gpu_query.memory = NIF_MEMORY_DEVICE;
    auto gpu_outputs = nifkit::sized<NifAnswers>();
    gpu_outputs.visible = visible.as<uint8_t>();
    if (by_job) {
      NifJob job = nullptr;
      ASSERT_EQ(nifQueryAsync(twins.gpu(), &gpu_query, &gpu_outputs, &job), NIF_OK) << nifGetErrorMessage();
      machine().lost = true;
      EXPECT_EQ(nifWaitJob(job), NIF_ERROR_DEVICE_LOST);
      nifReleaseJob(job);
    } else {
      machine().fail_launch = 1;
      EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_DEVICE_LOST);
      EXPECT_NE(std::string(nifGetErrorMessage()).find("lost"), std::string::npos);
    }
    EXPECT_EQ(nifQuery(twins.gpu(), &gpu_query, &gpu_outputs), NIF_ERROR_DEVICE_LOST);
    EXPECT_EQ(query_all(twins.gpu(), rays), query_all(twins.cpu(), rays));
    // A changed scene can still be committed for the CPU.
    twins.move(0, kIdentity);
    ASSERT_EQ(nifCommitScene(twins.cpu()), NIF_OK);
    EXPECT_EQ(nifCommitScene(twins.gpu()), NIF_ERROR_DEVICE_LOST);
    EXPECT_EQ(query_all(twins.gpu(), rays), query_all(twins.cpu(), rays));
  };
  for (const bool by_job : {false, true}) {
    lose(by_job);
    machine().lost = false;
  }
}

TEST_F(GpuFaults, WrongPointers) {
  const std::vector<NifRay> rays = some_rays();
  TwinScenes twins(config());
  fill(twins);
  twins.commit();
  const size_t count = rays.size();
  const GpuArray here(machine(), 0, rays.data(), count * sizeof(NifRay));
  const GpuArray there(machine(), 1, rays.data(), count * sizeof(NifRay));
  const GpuArray memory(machine(), 0, nullptr, 16 * count);
  Answers answers(count);
  const auto expect_wrong = [&](const NifRays& query, const NifAnswers& outputs, const char* name) {
    EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_WRONG_POINTER);
    EXPECT_NE(std::string(nifGetErrorMessage()).find(name), std::string::npos) << nifGetErrorMessage();
    NifJob job = nullptr;
    EXPECT_EQ(nifQueryAsync(twins.gpu(), &query, &outputs, &job), NIF_ERROR_WRONG_POINTER);
  };
  // Each array in turn: host memory instead of GPU memory, and the reverse.
  NifRays query = nifMakeRays(here.as<NifRay>(), count);
  query.memory = NIF_MEMORY_DEVICE;
  auto outputs = nifkit::sized<NifAnswers>();
  outputs.visible = memory.as<uint8_t>();
  void* const stream = query.stream = machine().make_stream(0);
  ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
  machine().wait_stream(stream);
  machine().free_stream(stream);
  query.stream = nullptr;
  for (int a = 0; a < 3; ++a) {
    NifRays wrong = query;
    wrong.origin[a] = &rays[0].origin[a];
    expect_wrong(wrong, outputs, "rays: origin is memory of the host");
    wrong = query;
    wrong.direction[a] = &there.as<NifRay>()->direction[a];
    expect_wrong(wrong, outputs, "rays: direction is memory of another GPU");
  }
  NifRays wrong = query;
  wrong.tmin = &rays[0].tmin;
  expect_wrong(wrong, outputs, "tmin");
  wrong = query;
  wrong.tmax = &rays[0].tmax;
  expect_wrong(wrong, outputs, "tmax");
  wrong = query;
  const uint32_t mask = 1;
  wrong.mask = &mask;
  expect_wrong(wrong, outputs, "rays: mask is memory of the host");
  const NifAnswers wrong_ones = answers.outputs();
  const auto expect_wrong_output = [&](auto NifAnswers::*member, const char* name) {
    NifAnswers some = outputs;
    some.*member = wrong_ones.*member;
    expect_wrong(query, some, name);
  };
  expect_wrong_output(&NifAnswers::visible, "visible");
  expect_wrong_output(&NifAnswers::visible_bits, "visible_bits");
  expect_wrong_output(&NifAnswers::probability, "probability");
  expect_wrong_output(&NifAnswers::certain, "certain");
  expect_wrong_output(&NifAnswers::logit, "logit");
  wrong = nifMakeRays(rays.data(), count);
  expect_wrong(wrong, outputs, "answers: visible is memory of a GPU");

  // The other GPU's stream.
  query.stream = machine().make_stream(1);
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_INVALID_ARGUMENT);
  machine().free_stream(query.stream);
}

/// Warnings: a scene that is not on the GPU, and, once, the loss of the GPU.
TEST_F(GpuFaults, AreLogged) {
  std::vector<std::string> warnings;
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  callbacks.user = &warnings;
  callbacks.log = [](void* user, uint32_t level, const char* message) {
    if (level == NIF_LOG_WARNING) static_cast<std::vector<std::string>*>(user)->emplace_back(message);
  };
  const std::vector<std::byte> file = format::encode(random_asset(1, {}));
  const nifkit::Device device(config(), &callbacks);
  nifkit::Scene scene(device);
  scene.add_asset(nifkit::Asset::load(device, file));
  machine().fail_allocation = 1;
  EXPECT_EQ(nifCommitScene(scene.get()), NIF_ERROR_OUT_OF_DEVICE_MEMORY);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("a scene could not be copied to the GPU: memory: "), std::string::npos)
      << warnings[0];
  ASSERT_EQ(nifCommitScene(scene.get()), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(warnings.size(), 1u);
  machine().lost = true;
  const std::vector<NifRay> rays = some_rays();
  std::vector<uint8_t> visible(rays.size());
  const nifkit::Answers answers = nifkit::Answers().visible(visible);
  EXPECT_THROW(scene.query(nifkit::Rays(rays), answers), nifkit::Error);
  scene.query(nifkit::Rays(rays), answers);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[1].find("lost"), std::string::npos) << warnings[1];
}

/// A GPU's memory is not the CPU's: what it answers in its place is checked alike.
TEST_F(GpuFaults, WrongPointersForTheCpu) {
  const std::vector<NifRay> rays = some_rays();
  const size_t count = rays.size();
  TwinScenes twins(config());
  fill(twins);
  twins.commit();
  const GpuArray here(machine(), 0, rays.data(), count * sizeof(NifRay));
  const GpuArray there(machine(), 1, nullptr, 64 * count);
  FirstHits found(count);
  Answers answers(count);
  std::vector<uint32_t> listed(count);
  uint32_t counted = 0;
  NifAnswers outputs = answers.outputs();
  NifHits hits = found.outputs();
  auto open = nifkit::sized<NifOpenRays>();
  open.capacity = count;
  open.rays = listed.data();
  open.count = &counted;
  const auto nothing = [](void*, uint64_t, const uint64_t*, uint8_t*) {};
  NifRays query = nifMakeRays(rays.data(), count);
  const auto expect_all = [&](NifError error, const char* says) {
    const auto expect = [&](NifError got) {
      EXPECT_EQ(got, error) << nifGetErrorMessage();
      if (error != NIF_OK) {
        EXPECT_NE(std::string(nifGetErrorMessage()).find(says), std::string::npos) << nifGetErrorMessage();
      }
    };
    NifJob job = nullptr;
    expect(nifQueryWithFallback(twins.gpu(), &query, &outputs, 1, nothing, nullptr));
    expect(nifQueryOpen(twins.gpu(), &query, &outputs, &open));
    expect(nifIntersect(twins.gpu(), &query, &hits));
    expect(nifIntersectAsync(twins.gpu(), &query, &hits, &job));
    nifReleaseJob(job);
  };
  const auto expect_wrong = [&](auto& member, auto* pointer, const char* says) {
    const auto good = std::exchange(member, pointer);
    expect_all(NIF_ERROR_WRONG_POINTER, says);
    member = good;
  };
  expect_all(NIF_OK, "");
  expect_wrong(query.origin[1], &here.as<NifRay>()->origin[1], "rays: origin is memory of a GPU");
  expect_wrong(query.direction[2], &here.as<NifRay>()->direction[2], "rays: direction is memory of a GPU");
  expect_wrong(query.tmin, &here.as<NifRay>()->tmin, "rays: tmin is");
  expect_wrong(query.tmax, there.as<float>(), "rays: tmax is");
  expect_wrong(query.mask, there.as<uint32_t>(), "rays: mask is");
  const auto refused = [&](NifError got, const char* says) {
    EXPECT_EQ(got, NIF_ERROR_WRONG_POINTER);
    EXPECT_NE(std::string(nifGetErrorMessage()).find(says), std::string::npos) << nifGetErrorMessage();
  };
  hits.color = there.as<float>();
  refused(nifIntersect(twins.gpu(), &query, &hits), "hits: color is memory of a GPU");
  open.instance = there.as<uint32_t>();
  refused(nifQueryOpen(twins.gpu(), &query, nullptr, &open), "open: instance is memory of a GPU");
  const uint8_t* const visible = std::exchange(outputs.visible, there.as<uint8_t>());
  refused(nifQueryWithFallback(twins.gpu(), &query, &outputs, 1, nothing, nullptr),
          "answers: visible is memory of a GPU");
  outputs.visible = const_cast<uint8_t*>(visible);
  uint64_t scratch_bytes = 0;
  ASSERT_EQ(nifGetQueryScratchBytes(twins.gpu(), count, &scratch_bytes), NIF_OK);
  const GpuArray scratch(machine(), 0, nullptr, scratch_bytes);
  query.scratch = scratch.as<void>();
  query.scratch_bytes = scratch_bytes;
  refused(nifQueryOpen(twins.gpu(), &query, nullptr, &open), "rays: scratch is memory of a GPU");
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << "a GPU does not use scratch";
  query.scratch = nullptr;

  // The scene is not on the GPU; then the GPU is lost, and no driver can tell.
  for (uint32_t i = 0; i < 100; ++i) twins.add(0, 0, kIdentity);
  machine().fail_allocation = 1;
  EXPECT_EQ(nifCommitScene(twins.gpu()), NIF_ERROR_OUT_OF_DEVICE_MEMORY);
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK);
  query.mask = there.as<uint32_t>();
  refused(nifQuery(twins.gpu(), &query, &outputs), "rays: mask is memory of a GPU");
  query.mask = nullptr;
  open.instance = nullptr;
  hits.color = found.color.data();
  machine().lost = true;
  EXPECT_EQ(nifCommitScene(twins.gpu()), NIF_ERROR_DEVICE_LOST);
  expect_all(NIF_OK, "");
}

/// Poses are read by the CPU.
TEST_F(GpuFaults, PosesInDeviceMemory) {
  TwinScenes twins(config());
  format::Asset bending = random_asset(21, {.objects = 0, .bvhs = 1, .skins = 1});
  Random random(22);
  const format::Skin skin = random_skin(random, bending.objects[0].skin->vertex_count, 4, 2);
  bending.objects[0].skin = skin;
  const uint32_t asset = twins.load(bending);
  for (uint32_t i = 0; i < 2; ++i) twins.add(asset, 0, kIdentity);
  std::vector<std::array<float, 3>> positions(skin.vertex_count, {0.5f, 0, 0});
  std::vector<nifkit::Transform> joints(skin.joint_count,
                                        nifkit::Transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
  std::vector<float> weights(skin.target_count, 0.5f);
  twins.both([&](nifkit::Scene& scene) { scene.pose_instance(0, joints, weights); });
  twins.commit();
  const std::vector<NifRay> rays = some_rays();
  const Answers posed = query_all(twins.gpu(), rays);
  for (const uint32_t gpu : {0u, 1u}) {
    const GpuArray there(machine(), gpu, nullptr, 64 * (positions.size() + joints.size() + weights.size()));
    auto pose = nifkit::sized<NifPose>();
    pose.joint_count = skin.joint_count;
    pose.target_count = skin.target_count;
    const auto refused = [&](NifError got, const char* says) {
      EXPECT_EQ(got, NIF_ERROR_WRONG_POINTER);
      EXPECT_NE(std::string(nifGetErrorMessage()).find(says), std::string::npos) << nifGetErrorMessage();
    };
    for (const uint32_t instance : {0u, 1u}) {
      refused(nifSetInstanceVertices(twins.gpu(), instance, there.as<float>(), 12),
              "positions is memory of a GPU, which nifPoseInstance takes as NIF_MEMORY_DEVICE");
      pose.joints = there.as<float>();
      pose.weights = weights.data();
      refused(nifPoseInstance(twins.gpu(), instance, &pose), "joints is memory of a GPU");
      pose.joints = joints[0].data();
      pose.weights = there.as<float>();
      refused(nifPoseInstance(twins.gpu(), instance, &pose), "weights is memory of a GPU");
    }
  }
  // Nothing has changed, and the scene is still committed.
  EXPECT_EQ(query_all(twins.gpu(), rays), posed);
  // A GPU that is lost cannot tell, and the CPU needs none.
  machine().lost = true;
  twins.both([&](nifkit::Scene& scene) { scene.set_instance_vertices(0, positions); });
  ASSERT_EQ(nifCommitScene(twins.cpu()), NIF_OK);
  EXPECT_EQ(nifCommitScene(twins.gpu()), NIF_ERROR_DEVICE_LOST);
  twins.both([&](nifkit::Scene& scene) { scene.pose_instance(1, joints, weights); });
  ASSERT_EQ(nifCommitScene(twins.cpu()), NIF_OK);
  EXPECT_EQ(nifCommitScene(twins.gpu()), NIF_ERROR_DEVICE_LOST);
  EXPECT_EQ(query_all(twins.gpu(), rays), query_all(twins.cpu(), rays));
}

TEST_F(GpuFaults, QueriesOfNothing) {
  TwinScenes twins(config());
  fill(twins);
  twins.commit();
  auto query = nifkit::sized<NifRays>();
  const auto outputs = nifkit::sized<NifAnswers>();
  const uint32_t launches = machine().launches;
  for (const NifMemory memory : {NIF_MEMORY_HOST, NIF_MEMORY_DEVICE}) {
    query.memory = memory;
    EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
    NifJob job = nullptr;
    ASSERT_EQ(nifQueryAsync(twins.gpu(), &query, &outputs, &job), NIF_OK);
    uint32_t done = 0;
    EXPECT_EQ(nifIsJobDone(job, &done), NIF_OK);
    EXPECT_EQ(done, 1u);
    nifReleaseJob(job);
  }
  EXPECT_EQ(machine().launches, launches);
  query.count = 1;
  query.memory = NIF_MEMORY_DEVICE;
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_INVALID_ARGUMENT) << "no origins";
}

/// Several threads, each with its own scenes and queries, on one device.
TEST_F(GpuFaults, NoneOfManyThreads) {
  const nifkit::Device device(config());
  const auto file = format::encode(random_asset(3, {.objects = 2, .bvhs = 1}));
  const nifkit::Asset asset = nifkit::Asset::load(device, file);
  const std::vector<NifRay> rays = some_rays();
  const auto answer = [&] {
    nifkit::Scene scene(device);
    scene.add_asset(asset);
    scene.commit();
    return query_all(scene.get(), rays);
  };
  const Answers expected = answer();
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 5; ++i) EXPECT_EQ(answer(), expected);
    });
  for (std::thread& thread : threads) thread.join();
}

/// The GPU's tables would be built from it. Valid files with the same grids are uploaded.
TEST_F(GpuFaults, OfSurfaceBitsBeyondTheGrid) {
  const nifkit::Device device(config());
  for (const BeyondGrid& kind : kBeyondGrid) {
    const FileBeyondGrid file = file_beyond_grid(kind);
    NifAsset asset = nullptr;
    EXPECT_EQ(nifLoadAssetMemory(device.get(), file.bad.data(), file.bad.size(), NIF_LOAD_COPY, &asset),
              NIF_ERROR_DAMAGED_NIF);
    EXPECT_EQ(nifGetErrorMessage(), std::string("memory: ") + kBeyondGridSentence);
    nifkit::Scene scene(device);
    scene.add_asset(nifkit::Asset::load(device, file.good));
    scene.commit();
  }
  EXPECT_EQ(machine().allocations, 0u);
}

}  // namespace
}  // namespace nif::test
