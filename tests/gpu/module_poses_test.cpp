// Poses in memory of a GPU: the same bits as from memory of the host, in the order of the caller's stream, without waiting
// before the commit. What the driver or the values refuse leaves the last pose.
#include <limits>
#include <memory>
#include <optional>
#include <thread>

#include "tests/gpu/gpu_hit_query.hpp"
#include "tests/gpu/module_fixture.hpp"
#include "tests/runtime/runtime_first_hits.hpp"

namespace nif::test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A pose in memory of the host: by the skin, or by positions.
struct HostPose {
  std::vector<nifkit::Transform> joints{};
  std::vector<float> weights{};
  std::vector<std::array<float, 3>> positions{};

  NifPose get() const {
    auto pose = nifkit::sized<NifPose>();
    if (!joints.empty()) pose.joints = joints[0].data();
    if (!weights.empty()) pose.weights = weights.data();
    pose.joint_count = uint32_t(joints.size());
    pose.target_count = uint32_t(weights.size());
    if (!positions.empty()) pose.positions = positions[0].data();
    pose.position_stride = 12;
    return pose;
  }
};

/// The same scene on the CPU and on a GPU: some instances of an object with a skin, and one that is stiff, the last.
class GpuPoses : public GpuModuleTest {
 protected:
  void SetUp() override {
    GpuModuleTest::SetUp();
    asset_ = random_asset(21, {.objects = 0, .instances = 0, .bvhs = 2, .skins = 1});
    asset_.objects[0].skin = random_skin(random_, asset_.objects[0].skin->vertex_count, 4, 2);
    // Streams are freed at the end, whatever a test leaves in them.
    for (void*& stream : streams_) stream = machine().make_stream(0);
    rays_ = rays_in_cube(random_, 5, 600);
  }
  void TearDown() override {
    twins_.reset();
    for (void* stream : streams_) machine().free_stream(stream);
    arrays_.clear();
    machine().fail_pinning = machine().fail_copy_out = 0;
    EXPECT_EQ(machine().pinned, 0u);
    GpuModuleTest::TearDown();
  }

  const format::Skin& skin() const { return *asset_.objects[0].skin; }
  TwinScenes& twins() { return *twins_; }
  void place(uint32_t instances, const std::string& more = "") {
    twins_.emplace(config() + more);
    const uint32_t asset = twins_->load(asset_);
    for (uint32_t i = 0; i < instances; ++i) twins_->add(asset, 0, random_transform(random_, 3));
    twins_->add(asset, 1, kIdentity);
    twins_->commit();
  }

  HostPose by_skin() {
    HostPose pose;
    for (uint32_t j = 0; j < skin().joint_count; ++j) {
      nifkit::Transform& joint = pose.joints.emplace_back();
      for (size_t i = 0; i < 12; ++i)
        joint[i] = (i % 5 == 0 ? 1.0f : 0.0f) + 0.3f * random_.between(-1.0f, 1.0f);
    }
    for (uint32_t t = 0; t < skin().target_count; ++t) pose.weights.push_back(random_.between(-1.0f, 1.0f));
    return pose;
  }
  HostPose by_positions() {
    HostPose pose;
    const auto& rest =
        asset_.objects[0].triangles->vertices;  // each is one of the source, which has some more
    for (uint32_t v = 0; v < skin().vertex_count; ++v) {
      auto& at = pose.positions.emplace_back();
      for (size_t a = 0; a < 3; ++a)
        at[a] = v < rest.size() ? rest[v][a] + random_.between(-0.4f, 0.4f) : kNaN;  // no triangle has it
    }
    return pose;
  }

  /// At an odd address; in managed memory at an aligned one, because the CPU reads it, too.
  template <class T>
  const float* copy(const std::vector<T>& from, bool managed = false, uint32_t gpu = 0) {
    const size_t bytes = from.size() * sizeof(T);
    void* memory = managed ? machine().allocate_managed(gpu, bytes + 1) : machine().allocate(gpu, bytes + 1);
    arrays_.push_back({memory, machine().free});
    char* const to = static_cast<char*>(memory) + (managed ? 0 : 1);
    if (bytes > 0) std::memcpy(to, from.data(), bytes);
    return reinterpret_cast<const float*>(to);
  }
  NifPose copy(const HostPose& from, void* stream = nullptr, int64_t stride = 12) {
    NifPose pose = from.get();
    if (pose.joints) pose.joints = copy(from.joints);
    if (pose.weights) pose.weights = copy(from.weights);
    if (pose.positions) {
      const size_t step = size_t(std::abs(stride)), count = from.positions.size();
      std::vector<char> apart((count - 1) * step + 12, char(0xff));  // not a number
      char* const first = apart.data() + (stride < 0 ? (count - 1) * step : 0);
      for (size_t v = 0; v < count; ++v) std::memcpy(first + int64_t(v) * stride, &from.positions[v], 12);
      const auto* const there = reinterpret_cast<const char*>(copy(apart));
      pose.positions = reinterpret_cast<const float*>(there + (first - apart.data()));
      pose.position_stride = uint64_t(stride);
    }
    pose.memory = NIF_MEMORY_DEVICE;
    pose.stream = stream;
    return pose;
  }
  NifError bend(uint32_t instance, const NifPose& pose) {
    return nifPoseInstance(twins().gpu(), instance, &pose);
  }
  void bend_cpu(uint32_t instance, const HostPose& pose) {
    const NifPose own = pose.get();
    ASSERT_EQ(nifPoseInstance(twins().cpu(), instance, &own), NIF_OK) << nifGetErrorMessage();
  }
  /// The same on both, on the GPU from its memory.
  void bend_both(uint32_t instance, const HostPose& pose, void* stream = nullptr, int64_t stride = 12) {
    bend_cpu(instance, pose);
    ASSERT_EQ(bend(instance, copy(pose, stream, stride)), NIF_OK) << nifGetErrorMessage();
  }

  /// Of both scenes, which are committed: by the GPU's kernels, and by the CPU.
  void expect_twins() {
    expect_same(query_all(twins().gpu(), rays_), query_all(twins().cpu(), rays_));
    const FirstHits hits = intersect_all(twins().cpu(), rays_);
    EXPECT_EQ(count_different_hits(intersect_all(twins().gpu(), rays_), hits), 0u);
    EXPECT_GT(std::count(hits.hit.begin(), hits.hit.end(), 1), 10);
  }
  Answers answers() { return query_all(twins().gpu(), rays_); }
  bool is_committed() { return twins_->gpu_scene().info().committed; }
  static void expect_error(NifError got, NifError code, const std::string& says) {
    EXPECT_EQ(got, code) << nifGetErrorMessage();
    EXPECT_NE(std::string(nifGetErrorMessage()).find(says), std::string::npos) << nifGetErrorMessage();
  }

  Random random_{5};
  format::Asset asset_;
  std::optional<TwinScenes> twins_;
  std::vector<std::unique_ptr<void, void (*)(void*)>> arrays_;
  void* streams_[2] = {};
  int written_ = 0;  ///< by kernels of the test
  std::vector<NifRay> rays_;
};

TEST_F(GpuPoses, HaveTheBitsOfPosesFromTheHost) {
  place(6);
  const Answers at_rest = answers();
  for (int frame = 0; frame < 3; ++frame) {
    HostPose without_weights = by_skin();
    without_weights.weights.clear();
    bend_both(0, by_skin());
    bend_both(1, by_skin(), streams_[0]);
    bend_both(2, without_weights, streams_[1]);
    bend_both(3, by_positions(), streams_[1]);
    constexpr int64_t kStrides[] = {40, -12, 2048, -2048, 13, 12};
    bend_both(4, by_positions(), nullptr, kStrides[2 * frame]);
    bend_both(5, by_positions(), streams_[0], kStrides[2 * frame + 1]);
    twins().commit();
    expect_twins();
    EXPECT_NE(answers(), at_rest);
  }
  HostPose point;
  point.positions.assign(skin().vertex_count, {0.5f, 0.25f, 0});
  bend_both(4, point, nullptr, 0);
  twins().commit();
  expect_twins();
}

/// What the stream does before a call is in the pose, and what it does later is not. No call waits for anything.
TEST_F(GpuPoses, InTheOrderOfTheStream) {
  place(2);
  const HostPose first = by_skin(), second = by_positions();
  HostPose unwritten = first, also_unwritten = second;
  for (nifkit::Transform& joint : unwritten.joints) joint.fill(kNaN);
  for (float& weight : unwritten.weights) weight = kNaN;
  for (auto& position : also_unwritten.positions) position.fill(kNaN);
  const NifPose there[] = {copy(unwritten, streams_[0]), copy(also_unwritten, streams_[0])};
  const auto write = [&](const HostPose& skin, const HostPose& positions) {
    machine().launch(streams_[0], [=, this] {
      std::memcpy(const_cast<float*>(there[0].joints), skin.joints.data(), 48 * skin.joints.size());
      std::memcpy(const_cast<float*>(there[0].weights), skin.weights.data(), 4 * skin.weights.size());
      std::memcpy(const_cast<float*>(there[1].positions), positions.positions.data(),
                  12 * positions.positions.size());
      ++written_;
    });
  };
  const uint32_t waits = machine().waits;
  write(first, second);
  for (uint32_t i = 0; i < 2; ++i) ASSERT_EQ(bend(i, there[i]), NIF_OK) << nifGetErrorMessage();
  write(unwritten, also_unwritten);
  EXPECT_EQ(machine().waits, waits);
  EXPECT_EQ(written_, 0) << "a call has waited for the stream";
  bend_cpu(0, first);
  bend_cpu(1, second);
  twins().commit();
  EXPECT_EQ(written_, 1) << "the commit waits for the poses, not for what comes after them";
  expect_twins();
  machine().wait_stream(streams_[0]);
  EXPECT_EQ(written_, 2);
  expect_twins();
}

/// The last one counts, whichever stream comes first.
TEST_F(GpuPoses, OfOneInstanceBeforeACommit) {
  place(1);
  const HostPose last = by_skin();
  ASSERT_EQ(bend(0, copy(by_skin(), streams_[0])), NIF_OK);
  ASSERT_EQ(bend(0, copy(last, streams_[1])), NIF_OK);
  machine().wait_stream(streams_[1]);
  machine().wait_stream(streams_[0]);
  bend_cpu(0, last);
  twins().commit();
  expect_twins();
  // More bytes than before, while copies are under way.
  ASSERT_EQ(bend(0, copy(by_skin(), streams_[0])), NIF_OK);
  bend_both(0, by_positions(), streams_[1], 60);
  twins().commit();
  expect_twins();
}

TEST_F(GpuPoses, AndOfTheHostBeforeACommit) {
  place(3);
  const auto of_host = [&](uint32_t instance, const HostPose& pose) {
    const NifPose own = pose.get();
    ASSERT_EQ(bend(instance, own), NIF_OK) << nifGetErrorMessage();
  };
  for (uint32_t i = 0; i < 3; ++i) bend_both(i, by_positions());
  twins().commit();
  // From the host later: by a pose, by vertices, at rest.
  const HostPose skin = by_skin(), positions = by_positions();
  for (uint32_t i = 0; i < 3; ++i) ASSERT_EQ(bend(i, copy(by_skin())), NIF_OK);
  of_host(0, skin);
  bend_cpu(0, skin);
  twins().both([&](nifkit::Scene& scene) {
    scene.set_instance_vertices(1, positions.positions);
    scene.set_instance_vertices(2, {});
  });
  twins().commit();
  expect_twins();
  // And earlier.
  for (uint32_t i = 0; i < 3; ++i) {
    of_host(i, by_skin());
    bend_both(i, by_skin());
  }
  twins().commit();
  expect_twins();
  // A pose of the host that is refused leaves the one that is expected.
  bend_both(0, by_skin());
  HostPose bad = by_skin();
  bad.joints[0][0] = kNaN;
  EXPECT_EQ(bend(0, bad.get()), NIF_ERROR_INVALID_ARGUMENT);
  twins().commit();
  expect_twins();
}

/// Values are found at the commit: the instance keeps its last pose, and all else is committed.
TEST_F(GpuPoses, WithBadValues) {
  place(5);
  bend_both(0, by_skin());
  bend_both(1, by_positions());
  twins().commit();
  constexpr const char* kMatrix = "a matrix of a joint is not finite; it keeps the vertices that it had";
  HostPose bad = by_skin(), far = by_positions(), heavy = by_skin();
  bad.joints.back()[11] = kNaN;
  far.positions[3][1] = 0x1p60f;
  heavy.weights[1] = std::numeric_limits<float>::infinity();
  // One, which had a pose.
  ASSERT_EQ(bend(0, copy(bad)), NIF_OK);
  bend_both(3, by_skin());
  ASSERT_EQ(nifCommitScene(twins().cpu()), NIF_OK);
  expect_error(nifCommitScene(twins().gpu()), NIF_ERROR_INVALID_ARGUMENT,
               std::string("instance 0: ") + kMatrix);
  EXPECT_TRUE(is_committed());
  expect_twins();
  GpuHitQuery hits(machine(), 0, rays_);  // the GPU has the scene
  hits.query.stream = streams_[0];
  EXPECT_EQ(nifIntersect(twins().gpu(), &hits.query, &hits.hits), NIF_OK) << nifGetErrorMessage();
  machine().wait_stream(streams_[0]);
  EXPECT_EQ(count_different_hits(hits.get(), intersect_all(twins().cpu(), rays_)), 0u);
  EXPECT_EQ(nifCommitScene(twins().gpu()), NIF_OK) << "it is forgotten";
  // Of several, the message is about the lowest instance, in whichever order they began to bend; 2 was at rest.
  ASSERT_EQ(bend(3, copy(far)), NIF_OK);
  ASSERT_EQ(bend(2, copy(heavy)), NIF_OK);
  ASSERT_EQ(bend(1, copy(far)), NIF_OK);
  bend_both(0, by_skin());
  ASSERT_EQ(nifCommitScene(twins().cpu()), NIF_OK);
  expect_error(
      nifCommitScene(twins().gpu()), NIF_ERROR_INVALID_ARGUMENT,
      "instance 1: vertex 3 is too far from the origin to compute with; it keeps the vertices that it had, "
      "and so do 2 more");
  expect_twins();
  ASSERT_EQ(bend(2, copy(heavy)), NIF_OK);
  expect_error(nifCommitScene(twins().gpu()), NIF_ERROR_INVALID_ARGUMENT,
               "instance 2: the weight of a morph target is not finite");
  // After it, good ones.
  for (uint32_t i = 0; i < 4; ++i) bend_both(i, by_skin());
  twins().commit();
  expect_twins();
}

/// Each is refused by the call, and changes nothing.
TEST_F(GpuPoses, ThatAreRefusedAtOnce) {
  place(2);
  bend_both(0, by_skin());
  twins().commit();
  const Answers before = answers();
  const uint32_t pinned = machine().pinned;
  const HostPose skin = by_skin(), positions = by_positions();
  const NifPose good = copy(skin, streams_[0]), moved = copy(positions, streams_[0]);
  const auto refused = [&](const NifPose& like, NifError code, const char* says, const auto& change) {
    NifPose pose = like;
    change(pose);
    for (const uint32_t instance : {0u, 1u}) expect_error(bend(instance, pose), code, says);
    EXPECT_TRUE(is_committed()) << says;
  };
  using P = NifPose;
  refused(good, NIF_ERROR_INVALID_ARGUMENT, "unknown memory kind 2", [](P& pose) { pose.memory = 2; });
  refused(good, NIF_ERROR_NOT_AVAILABLE, "flags is not 0", [](P& pose) { pose.flags = 4; });
  refused(skin.get(), NIF_ERROR_NOT_AVAILABLE, "has no streams", [&](P& pose) { pose.stream = streams_[0]; });
  refused(good, NIF_ERROR_INVALID_ARGUMENT, "joints, but the object", [](P& pose) { ++pose.joint_count; });
  refused(good, NIF_ERROR_INVALID_ARGUMENT, "morph targets, but", [](P& pose) { --pose.target_count; });
  refused(good, NIF_ERROR_INVALID_ARGUMENT, "joints is null", [](P& pose) { pose.joints = nullptr; });
  refused(good, NIF_ERROR_INVALID_ARGUMENT, "weights is null", [](P& pose) { pose.weights = nullptr; });
  refused(good, NIF_ERROR_INVALID_ARGUMENT, "has positions, and joints",
          [&](P& pose) { pose.positions = moved.positions; });
  for (const uint64_t stride : {uint64_t{2049}, uint64_t(-2049), uint64_t{1} << 63})
    refused(moved, NIF_ERROR_INVALID_ARGUMENT, "the stride is more than 2048 bytes",
            [&](P& pose) { pose.position_stride = stride; });
  // Memory of the wrong kind, each array in turn.
  constexpr const char* kHost = "is memory of the host, and NIF_MEMORY_DEVICE was promised";
  constexpr const char* kThere = "is memory of a GPU, which nifPoseInstance takes as NIF_MEMORY_DEVICE";
  constexpr const char* kOther = "is memory of another GPU";
  const NifPose host_skin = skin.get(), host_positions = positions.get();
  const float* const other = copy(std::vector<float>(1), false, 1);
  const auto wrong = [&](const char* name, const P& there, const P& here, const float* P::*array) {
    const auto sentence = [&](const char* says) { return std::string(name) + " " + says; };
    refused(there, NIF_ERROR_WRONG_POINTER, sentence(kHost).c_str(), [&](P& p) { p.*array = here.*array; });
    refused(there, NIF_ERROR_WRONG_POINTER, sentence(kOther).c_str(), [&](P& p) { p.*array = other; });
    refused(here, NIF_ERROR_WRONG_POINTER, sentence(kThere).c_str(), [&](P& p) { p.*array = there.*array; });
    refused(here, NIF_ERROR_WRONG_POINTER, sentence(kThere).c_str(), [&](P& p) { p.*array = other; });
  };
  wrong("joints", good, host_skin, &P::joints);
  wrong("weights", good, host_skin, &P::weights);
  wrong("positions", moved, host_positions, &P::positions);
  void* const foreign = machine().make_stream(1);
  refused(good, NIF_ERROR_INVALID_ARGUMENT, "the stream is not of the device's GPU",
          [&](P& pose) { pose.stream = foreign; });
  machine().free_stream(foreign);
  expect_error(bend(2, good), NIF_ERROR_INVALID_OPERATION, "was not baked with --deforms");
  expect_error(bend(9, good), NIF_ERROR_INVALID_ARGUMENT, "no instance 9");
  EXPECT_TRUE(is_committed());
  EXPECT_EQ(machine().pinned, pinned);
  EXPECT_EQ(answers(), before);
  // A CPU has neither.
  NifPose pose = host_skin;
  pose.memory = NIF_MEMORY_DEVICE;
  expect_error(nifPoseInstance(twins().cpu(), 0, &pose), NIF_ERROR_NOT_AVAILABLE, "this device is a CPU");
  pose.memory = NIF_MEMORY_HOST;
  pose.stream = streams_[0];
  expect_error(nifPoseInstance(twins().cpu(), 0, &pose), NIF_ERROR_NOT_AVAILABLE, "has no streams");
}

/// Managed memory is both.
TEST_F(GpuPoses, InManagedMemory) {
  place(2);
  const HostPose skin = by_skin(), positions = by_positions();
  NifPose managed = skin.get(), moved = positions.get();
  managed.joints = copy(skin.joints, true);
  managed.weights = copy(skin.weights, true);
  moved.positions = copy(positions.positions, true);
  for (const NifMemory memory : {NIF_MEMORY_DEVICE, NIF_MEMORY_HOST}) {
    managed.memory = moved.memory = memory;
    ASSERT_EQ(bend(0, managed), NIF_OK) << nifGetErrorMessage();
    ASSERT_EQ(bend(1, moved), NIF_OK) << nifGetErrorMessage();
    bend_cpu(0, skin);
    bend_cpu(1, positions);
    twins().commit();
    expect_twins();
    bend_both(0, by_skin());
    bend_both(1, by_skin());
    twins().commit();
  }
}

/// Poses that have not arrived are lost with the GPU; the CPU goes on with the last ones.
TEST_F(GpuPoses, OfALostGpu) {
  place(3);
  bend_both(0, by_skin(), streams_[0]);
  twins().commit();
  ASSERT_EQ(bend(0, copy(by_skin(), streams_[0])), NIF_OK);
  ASSERT_EQ(bend(1, copy(by_positions(), streams_[1])), NIF_OK);
  const HostPose later = by_skin();
  const NifPose there = copy(by_skin()), own = later.get();
  machine().lost = true;
  // The runtime does not know yet.
  expect_error(bend(2, there), NIF_ERROR_DEVICE_LOST, "lost");
  ASSERT_EQ(bend(2, own), NIF_OK) << nifGetErrorMessage();
  bend_cpu(2, later);
  ASSERT_EQ(nifCommitScene(twins().cpu()), NIF_OK);
  EXPECT_EQ(nifCommitScene(twins().gpu()), NIF_ERROR_DEVICE_LOST);
  EXPECT_TRUE(is_committed());
  expect_twins();
  EXPECT_EQ(nifCommitScene(twins().gpu()), NIF_ERROR_DEVICE_LOST);
  // Known from now on, even if the driver could go on.
  machine().lost = false;
  expect_error(bend(1, there), NIF_ERROR_DEVICE_LOST, "make a new device");
  EXPECT_TRUE(is_committed());
  ASSERT_EQ(bend(1, own), NIF_OK) << nifGetErrorMessage();
  bend_cpu(1, later);
  ASSERT_EQ(nifCommitScene(twins().cpu()), NIF_OK);
  EXPECT_EQ(nifCommitScene(twins().gpu()), NIF_ERROR_DEVICE_LOST);
  expect_twins();
}

/// Driver calls that fail, other than by a loss.
TEST_F(GpuPoses, ThatTheDriverRefuses) {
  place(2);
  bend_both(0, by_skin());
  twins().commit();
  const Answers before = answers();
  const uint32_t pinned = machine().pinned, events = machine().events;
  // The first pose of an instance, from the first call of the driver to the last: nothing is left.
  const auto fail = [&](std::atomic<uint32_t>& which, uint32_t count) { which = count; };
  const NifPose pose = copy(by_skin());
  fail(machine().fail_pinning, 1);
  expect_error(bend(1, pose), NIF_ERROR_OUT_OF_DEVICE_MEMORY, "cannot pin more memory");
  for (const uint32_t count : {1u, 2u}) {
    fail(machine().fail_copy_out, count);
    expect_error(bend(1, pose), NIF_ERROR_UNKNOWN, "copying from the GPU");
  }
  fail(machine().fail_record, 1);
  expect_error(bend(1, pose), NIF_ERROR_UNKNOWN, "recording an event");
  EXPECT_TRUE(is_committed());
  EXPECT_EQ(machine().pinned, pinned);
  EXPECT_EQ(machine().events, events);
  EXPECT_EQ(answers(), before);
  // A later pose, which needs more memory: the one that is expected stays.
  bend_both(0, by_skin(), streams_[0]);
  fail(machine().fail_pinning, 1);
  expect_error(bend(0, copy(by_positions(), nullptr, 2048)), NIF_ERROR_OUT_OF_DEVICE_MEMORY, "cannot pin");
  twins().commit();
  expect_twins();
  // One that fails halfway takes the expected one with it, and the commit says so.
  ASSERT_EQ(bend(0, copy(by_skin(), streams_[0])), NIF_OK);
  fail(machine().fail_copy_out, 2);
  expect_error(bend(0, pose), NIF_ERROR_UNKNOWN, "copying from the GPU");
  expect_error(nifCommitScene(twins().gpu()), NIF_ERROR_UNKNOWN,
               "instance 0: GPU: a later copy of the pose has failed");
  EXPECT_TRUE(is_committed());
  expect_twins();
  bend_both(0, by_skin(), streams_[1]);
  twins().commit();
  expect_twins();
}

/// After the first pose of an instance.
TEST_F(GpuPoses, AllocateNothing) {
  static std::atomic<uint64_t> allocations;
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  callbacks.allocate = [](void*, uint64_t bytes, uint64_t alignment) -> void* {
    ++allocations;
    return ::operator new(bytes, std::align_val_t(alignment));
  };
  callbacks.deallocate = [](void*, void* memory, uint64_t, uint64_t alignment) {
    ::operator delete(memory, std::align_val_t(alignment));
  };
  const auto file = format::encode(asset_);
  const nifkit::Device device(config(), &callbacks);
  const nifkit::Asset asset = nifkit::Asset::load(device, file);
  nifkit::Scene scene(device);
  for (int i = 0; i < 3; ++i) scene.add_instance(asset, 0);
  const NifPose poses[] = {copy(by_positions(), streams_[0]), copy(by_skin(), streams_[0]), copy(by_skin())};
  const auto pose_all = [&] {
    for (uint32_t i = 0; i < 3; ++i)
      for (const NifPose& pose : poses) scene.pose_instance(i, pose);
  };
  // The first call makes the instance's tree, and the first with memory of the GPU its memory for copies.
  uint64_t before = allocations;
  for (uint32_t i = 0; i < 3; ++i) scene.set_instance_vertices(i, {});
  EXPECT_GT(allocations, before);
  scene.commit();
  const uint64_t resident = scene.info().resident_bytes;
  pose_all();
  scene.commit();
  const uint32_t pinnings = machine().pinnings, events = machine().events;
  const uint64_t vertices = asset_.objects[0].triangles->vertices.size();
  EXPECT_EQ(scene.info().resident_bytes,
            resident + 3 * std::max(12 * vertices, uint64_t{48} * skin().joint_count + 8));
  for (int frame = 0; frame < 3; ++frame) {
    before = allocations;
    pose_all();
    EXPECT_EQ(allocations, before);
    scene.commit();
  }
  EXPECT_EQ(machine().pinnings, pinnings);
  EXPECT_EQ(machine().events, events);
}

/// A commit without changes does nothing, as always.
TEST_F(GpuPoses, CommittedTwice) {
  place(2);
  bend_both(0, by_skin(), streams_[0]);
  twins().commit();
  const uint32_t waits = machine().waits, uploads = machine().uploads;
  twins().commit();
  EXPECT_EQ(machine().waits, waits);
  EXPECT_EQ(machine().uploads, uploads);
  expect_twins();
  // And the pose is not taken again with other changes.
  bend_both(0, by_skin(), streams_[0]);
  twins().commit();
  twins().move(0, random_transform(random_, 3));
  twins().commit();
  expect_twins();
}

/// Memory that the stream still writes stays until it is done.
TEST_F(GpuPoses, OfInstancesThatAreRemoved) {
  place(3);
  const auto count_down = [&] { machine().launch(streams_[0], [this] { ++written_; }); };
  const uint32_t pinned = machine().pinned;
  count_down();
  for (uint32_t i = 0; i < 2; ++i) ASSERT_EQ(bend(i, copy(by_skin(), streams_[0])), NIF_OK);
  EXPECT_EQ(machine().pinned, pinned + 2);
  bend_both(2, by_skin());
  twins().both([](nifkit::Scene& scene) {
    scene.remove_instance(0);
    scene.remove_instance(1);
  });
  EXPECT_EQ(written_, 0);
  twins().commit();
  EXPECT_EQ(written_, 1);
  EXPECT_EQ(machine().pinned, pinned + 1);
  expect_twins();
  // With the scene.
  count_down();
  ASSERT_EQ(bend(2, copy(by_skin(), streams_[0])), NIF_OK);
  EXPECT_EQ(written_, 1);
  twins_.reset();
  EXPECT_EQ(written_, 2);
}

/// Several scenes of one device at once, each with its stream, and threads that share refits.
TEST_F(GpuPoses, OfManyThreads) {
  const auto file = format::encode(asset_);
  const nifkit::Device device(config() + ",threads=3");
  const nifkit::Asset asset = nifkit::Asset::load(device, file);
  const HostPose skin = by_skin(), positions = by_positions();
  const NifPose poses[] = {copy(skin), copy(positions)};
  const auto answer = [&](void* stream) {
    nifkit::Scene scene(device);
    for (int i = 0; i < 4; ++i) scene.add_instance(asset, 0);
    Answers answers(0);
    for (int frame = 0; frame < 4; ++frame) {
      for (uint32_t i = 0; i < 4; ++i) {
        NifPose pose = poses[(i + uint32_t(frame)) % 2];
        pose.stream = stream;
        scene.pose_instance(i, pose);
      }
      scene.commit();
      answers = query_all(scene.get(), rays_);
    }
    return answers;
  };
  const Answers expected = answer(streams_[0]);
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t)
    threads.emplace_back([&] {
      void* stream = machine().make_stream(0);
      for (int round = 0; round < 3; ++round) EXPECT_EQ(answer(stream), expected);
      machine().free_stream(stream);
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace nif::test
