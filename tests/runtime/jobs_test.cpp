// Queries that several threads answer, with the device's own threads and with the caller's task runner: they
// give the same answers, allocate nothing, and end whatever the runner does. Also meant for the thread
// sanitizer.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <thread>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/aligned.hpp"

namespace nif::test {
namespace {

/// A thread-safe allocator that knows what is still allocated.
struct Allocations {
  std::atomic<int64_t> live = 0, calls = 0;

  void install(NifDeviceCallbacks& callbacks) {
    callbacks.user = this;
    callbacks.allocate = [](void* user, uint64_t bytes, uint64_t alignment) -> void* {
      auto& self = *static_cast<Allocations*>(user);
      ++self.live, ++self.calls;
      return allocate_aligned(alignment, bytes);
    };
    callbacks.deallocate = [](void* user, void* memory, uint64_t, uint64_t alignment) {
      --static_cast<Allocations*>(user)->live;
      free_aligned(alignment, memory);
    };
  }
};

/// The caller's task runner.
struct Runner : Allocations {
  enum class When { never, inside, later, backwards, on_threads };
  struct Given {
    NifTask task;
    void* argument;
    uint64_t index;
  };

  explicit Runner(When what) : when(what) {
    if (when == When::on_threads)
      for (int i = 0; i < 2; ++i) threads.emplace_back([this] { work(); });
  }
  ~Runner() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    wake.notify_all();
    for (std::thread& thread : threads) thread.join();
  }

  NifDeviceCallbacks callbacks() {
    auto result = nifkit::sized<NifDeviceCallbacks>();
    install(result);
    result.user = static_cast<Allocations*>(this);
    result.submit = [](void* user, NifTask task, void* argument, uint64_t count) {
      auto& self = *static_cast<Runner*>(static_cast<Allocations*>(user));
      self.submitted += count;
      for (uint64_t i = 0; i < count; ++i) {
        if (self.when == When::inside) {
          task(argument, i);
          continue;
        }
        const std::lock_guard lock(self.mutex);
        self.given.push_back({task, argument, i});
      }
      self.wake.notify_all();
    };
    return result;
  }
  void run_what_was_given() {
    while (!given.empty()) {
      const Given next = when == When::backwards ? given.back() : given.front();
      when == When::backwards ? given.pop_back() : given.pop_front();
      next.task(next.argument, next.index);
    }
  }
  void work() {
    std::unique_lock lock(mutex);
    for (;;) {
      wake.wait(lock, [&] { return stopping || !given.empty(); });
      if (given.empty()) return;
      const Given next = given.front();
      given.pop_front();
      lock.unlock();
      next.task(next.argument, next.index);
      lock.lock();
    }
  }

  When when;
  std::atomic<uint64_t> submitted = 0;
  std::mutex mutex;
  std::condition_variable wake;
  std::deque<Given> given;
  std::vector<std::thread> threads;
  bool stopping = false;
};

class ThreadJobs : public RuntimeTest {
 protected:
  void SetUp() override {
    RuntimeTest::SetUp();
    const format::AssetView& view = make(1);
    Random random(1);
    rays_ = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 20001);
    expected_ = std::make_unique<Answers>(query_all(whole_asset(load()), rays_));
  }
  /// The asset's own instances, on the test's device.
  NifScene whole_asset(NifAsset asset) {
    const NifScene scene = new_scene();
    EXPECT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_OK);
    EXPECT_EQ(nifCommitScene(scene), NIF_OK);
    return scene;
  }
  /// The same scene on another device, which only the scene keeps alive.
  NifScene scene_on(const char* config, const NifDeviceCallbacks* callbacks) {
    NifDevice device = nullptr;
    NifAsset asset = nullptr;
    NifScene scene = nullptr;
    EXPECT_EQ(nifNewDevice(config, callbacks, &device), NIF_OK) << nifGetErrorMessage();
    EXPECT_EQ(nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &asset), NIF_OK);
    EXPECT_EQ(nifNewScene(device, &scene), NIF_OK);
    EXPECT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_OK);
    EXPECT_EQ(nifCommitScene(scene), NIF_OK);
    nifReleaseAsset(asset);
    nifReleaseDevice(device);
    return scene;
  }

  std::vector<NifRay> rays_;
  std::unique_ptr<Answers> expected_;
};

TEST_F(ThreadJobs, AnyNumberOfThreadsSaysTheSame) {
  for (const char* config : {"threads=2", "threads=3", "threads=7,queries=9"}) {
    const NifScene scene = scene_on(config, nullptr);
    for (int round = 0; round < 5; ++round) EXPECT_EQ(query_all(scene, rays_), *expected_);
    for (const size_t count : {1, 7, 2047, 2048, 2049, 5000, 10007}) {
      Answers answers(count);
      NifRays query = nifMakeRays(rays_.data(), count);
      const NifAnswers outputs = answers.outputs();
      ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
      EXPECT_TRUE(std::equal(answers.logit.begin(), answers.logit.end(), expected_->logit.begin()));
      EXPECT_TRUE(std::equal(answers.certain.begin(), answers.certain.end(), expected_->certain.begin()));
      EXPECT_TRUE(std::equal(answers.bits.begin(), answers.bits.end() - 1, expected_->bits.begin()));
    }
    nifReleaseScene(scene);
  }
}

TEST_F(ThreadJobs, QueriesAllocateNothing) {
  Allocations memory;
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  memory.install(callbacks);
  const NifScene scene = scene_on("threads=3", &callbacks);
  Answers answers(rays_.size());
  NifRays query = nifMakeRays(rays_.data(), rays_.size());
  const NifAnswers outputs = answers.outputs();
  const int64_t before = memory.calls;
  ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
  EXPECT_EQ(memory.calls, before);
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
  ASSERT_EQ(nifWaitJob(job), NIF_OK);
  EXPECT_EQ(memory.calls, before + 1) << "the job";
  EXPECT_EQ(answers, *expected_);
  nifReleaseJob(job);
  nifReleaseScene(scene);
  EXPECT_EQ(memory.live, 0) << "all is gone as soon as the last reference is";
}

TEST_F(ThreadJobs, Asynchronous) {
  for (const char* config : {"threads=1", "threads=2", "threads=4"}) {
    const NifScene scene = scene_on(config, nullptr);
    constexpr size_t kJobs = 5;
    std::vector<Answers> answers(kJobs, Answers(rays_.size()));
    NifJob jobs[kJobs];
    char unused = 7;  // scratch that no query would accept
    for (size_t k = 0; k < kJobs; ++k) {
      NifRays query = nifMakeRays(rays_.data(), rays_.size());
      const NifAnswers outputs = answers[k].outputs();
      query.scratch = &unused;
      query.scratch_bytes = sizeof(unused);
      ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &jobs[k]), NIF_OK);
    }
    // Polls the first two, waits for the others, and for the last from two threads.
    for (size_t k = 0; k < 2; ++k) {
      for (uint32_t done = 0; !done; std::this_thread::yield())
        ASSERT_EQ(nifIsJobDone(jobs[k], &done), NIF_OK);
      EXPECT_EQ(answers[k], *expected_);
    }
    std::thread other([&] { EXPECT_EQ(nifWaitJob(jobs[kJobs - 1]), NIF_OK); });
    for (size_t k = 2; k < kJobs; ++k) {
      ASSERT_EQ(nifWaitJob(jobs[k]), NIF_OK);
      EXPECT_EQ(answers[k], *expected_);
    }
    other.join();
    EXPECT_EQ(unused, 7);
    for (const NifJob job : jobs) nifReleaseJob(job);
    nifReleaseScene(scene);
  }
}

TEST_F(ThreadJobs, EverythingReleasedBeforeItIsDone) {
  Allocations memory;
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  memory.install(callbacks);
  for (int round = 0; round < 10; ++round) {
    Answers answers(rays_.size());
    NifRays query = nifMakeRays(rays_.data(), rays_.size());
    const NifAnswers outputs = answers.outputs();
    const NifScene scene = scene_on("threads=3", &callbacks);
    NifJob job = nullptr;
    ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
    nifReleaseJob(job);
    nifReleaseScene(scene);
    // The device's own threads finish the job, and thereby destroy the scene and the device.
    while (memory.live != 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_EQ(answers, *expected_);
  }
}

TEST_F(ThreadJobs, ManyCallersShareTheThreads) {
  const NifScene scene = scene_on("threads=2,queries=2", nullptr);
  std::atomic<int> wrong = 0;
  std::vector<std::thread> callers;
  for (int t = 0; t < 5; ++t)
    callers.emplace_back([&, t] {
      for (int round = 0; round < 4; ++round) {
        Answers answers(rays_.size());
        NifRays query = nifMakeRays(rays_.data(), rays_.size());
        const NifAnswers outputs = answers.outputs();
        if ((t + round) % 2) {
          wrong += nifQuery(scene, &query, &outputs) != NIF_OK;
        } else {
          NifJob job = nullptr;
          wrong += nifQueryAsync(scene, &query, &outputs, &job) != NIF_OK;
          wrong += nifWaitJob(job) != NIF_OK;
          nifReleaseJob(job);
        }
        wrong += !(answers == *expected_);
      }
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0);
  nifReleaseScene(scene);
}

TEST_F(ThreadJobs, ScratchOfTheCaller) {
  const NifScene scene = scene_on("threads=2,queries=2", nullptr);
  uint64_t bytes = 0;
  ASSERT_EQ(nifGetQueryScratchBytes(scene, rays_.size(), &bytes), NIF_OK);
  EXPECT_LT(bytes, uint64_t(1) << 20);
  std::vector<std::thread> callers;
  std::atomic<int> wrong = 0;
  for (int t = 0; t < 4; ++t)
    callers.emplace_back([&] {
      const AlignedBytes scratch(bytes);
      Answers answers(rays_.size());
      NifRays query = nifMakeRays(rays_.data(), rays_.size());
      const NifAnswers outputs = answers.outputs();
      query.scratch = scratch.get();
      query.scratch_bytes = bytes;
      wrong += nifQuery(scene, &query, &outputs) != NIF_OK;
      wrong += !(answers == *expected_);
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0);
  nifReleaseScene(scene);
}

TEST_F(ThreadJobs, RunnersOfTheCaller) {
  using When = Runner::When;
  for (const When when : {When::never, When::inside, When::later, When::backwards, When::on_threads}) {
    SCOPED_TRACE(int(when));
    Runner runner(when);
    const NifDeviceCallbacks callbacks = runner.callbacks();
    const NifScene scene = scene_on("threads=3", &callbacks);
    EXPECT_EQ(query_all(scene, rays_), *expected_);
    EXPECT_EQ(runner.submitted, 2u) << "the calling thread works, too";
    const int64_t before = runner.calls;
    for (int round = 0; round < 30; ++round)  // more jobs than the device has ready if tasks never run
      EXPECT_EQ(query_all(scene, rays_), *expected_);
    EXPECT_EQ(runner.calls, before);

    Answers answers(rays_.size());
    NifRays query = nifMakeRays(rays_.data(), rays_.size());
    const NifAnswers outputs = answers.outputs();
    NifJob job = nullptr;
    ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
    uint32_t done = 7;
    ASSERT_EQ(nifIsJobDone(job, &done), NIF_OK);
    if (when == When::inside) {
      EXPECT_EQ(done, 1u);
    }
    const bool waits = when == When::never || when == When::later || when == When::backwards;
    if (waits) {
      EXPECT_EQ(done, 0u);
    }
    ASSERT_EQ(nifWaitJob(job), NIF_OK);
    EXPECT_EQ(answers, *expected_);
    nifReleaseJob(job);
    nifReleaseScene(scene);
    if (waits) {
      EXPECT_GT(runner.live, 0) << "tasks that have not run keep their device";
      runner.run_what_was_given();  // finds nothing to do
    }
    while (when == When::on_threads && runner.live != 0) std::this_thread::yield();
    EXPECT_EQ(runner.live, 0);
  }
}

TEST_F(ThreadJobs, RunnerThatIsOutOfOrder) {
  // Several jobs at once; their tasks run in reverse order, and only one job's in time.
  Runner runner(Runner::When::backwards);
  const NifDeviceCallbacks callbacks = runner.callbacks();
  const NifScene scene = scene_on("threads=3", &callbacks);
  constexpr size_t kJobs = 4;
  std::vector<Answers> answers(kJobs, Answers(rays_.size()));
  NifJob jobs[kJobs];
  for (size_t k = 0; k < kJobs; ++k) {
    NifRays query = nifMakeRays(rays_.data(), rays_.size());
    const NifAnswers outputs = answers[k].outputs();
    ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &jobs[k]), NIF_OK);
  }
  const Runner::Given latest = runner.given.back();
  runner.given.pop_back();
  latest.task(latest.argument, latest.index);
  uint32_t done[kJobs];
  for (size_t k = 0; k < kJobs; ++k) ASSERT_EQ(nifIsJobDone(jobs[k], &done[k]), NIF_OK);
  EXPECT_EQ(done[kJobs - 1], 1u);
  EXPECT_EQ(done[0], 0u);
  ASSERT_EQ(nifWaitJob(jobs[1]), NIF_OK);
  EXPECT_EQ(answers[1], *expected_);
  nifReleaseJob(jobs[0]);  // before any thread has started it
  nifReleaseScene(scene);
  runner.run_what_was_given();
  for (size_t k = 0; k < kJobs; ++k) EXPECT_EQ(answers[k], *expected_) << k;
  for (size_t k = 1; k < kJobs; ++k) {
    EXPECT_EQ(nifWaitJob(jobs[k]), NIF_OK);
    EXPECT_EQ(nifWaitJob(jobs[k]), NIF_OK) << "again";
    nifReleaseJob(jobs[k]);
  }
  EXPECT_EQ(runner.live, 0);
}

TEST_F(ThreadJobs, BadRays) {
  // Arbitrary bits get the same answers on several threads and later as on one thread and at once.
  std::vector<NifRay> noise(20001);
  Random random(3);
  for (NifRay& ray : noise) {
    uint32_t words[8];
    for (uint32_t& word : words) word = random.below(0xffffffff);
    std::memcpy(&ray, words, sizeof(ray));
  }
  const Answers expected = query_all(whole_asset(load()), noise);
  const NifScene scene = scene_on("threads=3", nullptr);
  EXPECT_EQ(query_all(scene, noise), expected);
  Answers answers(noise.size());
  NifRays query = nifMakeRays(noise.data(), noise.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
  ASSERT_EQ(nifWaitJob(job), NIF_OK);
  EXPECT_EQ(answers, expected);
  nifReleaseJob(job);
  nifReleaseScene(scene);
}

TEST_F(ThreadJobs, RunnerAfterEverythingIsReleased) {
  Runner runner(Runner::When::later);
  const NifDeviceCallbacks callbacks = runner.callbacks();
  const NifScene scene = scene_on("threads=3", &callbacks);
  Answers answers(rays_.size());
  NifRays query = nifMakeRays(rays_.data(), rays_.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
  nifReleaseJob(job);
  nifReleaseScene(scene);
  runner.run_what_was_given();
  EXPECT_EQ(answers, *expected_);
  EXPECT_EQ(runner.live, 0);
}

TEST_F(ThreadJobs, RunnerOfOneThread) {
  // threads=1: queries stay on their thread, and asynchronous ones are one task.
  Runner runner(Runner::When::on_threads);
  const NifDeviceCallbacks callbacks = runner.callbacks();
  const NifScene scene = scene_on("threads=1", &callbacks);
  EXPECT_EQ(query_all(scene, rays_), *expected_);
  EXPECT_EQ(runner.submitted, 0u);
  Answers answers(rays_.size());
  NifRays query = nifMakeRays(rays_.data(), rays_.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(scene, &query, &outputs, &job), NIF_OK);
  for (uint32_t done = 0; !done; std::this_thread::yield()) ASSERT_EQ(nifIsJobDone(job, &done), NIF_OK);
  EXPECT_EQ(runner.submitted, 1u);
  EXPECT_EQ(answers, *expected_);
  nifReleaseJob(job);
  nifReleaseScene(scene);
}

TEST_F(ThreadJobs, CancelledJobsLeaveOutWhatNobodyHasBegun) {
  // The runner does not run the tasks, so nothing is started before the job is cancelled.
  Runner runner(Runner::When::later);
  const NifDeviceCallbacks callbacks = runner.callbacks();
  const NifScene scene = scene_on("threads=3", &callbacks);
  Answers answers(rays_.size());
  const std::vector<uint8_t> untouched = answers.visible;
  const NifRays rays = nifMakeRays(rays_.data(), rays_.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(scene, &rays, &outputs, &job), NIF_OK);
  ASSERT_EQ(nifCancelJob(job), NIF_OK);
  ASSERT_EQ(nifCancelJob(job), NIF_OK) << "twice does no harm";
  uint32_t done = 0;
  EXPECT_EQ(nifIsJobDone(job, &done), NIF_OK);
  EXPECT_EQ(done, 1u);
  EXPECT_EQ(nifWaitJob(job), NIF_ERROR_CANCELLED);
  EXPECT_EQ(answers.visible, untouched);
  runner.run_what_was_given();
  EXPECT_EQ(answers.visible, untouched);
  nifReleaseJob(job);
  nifReleaseScene(scene);
  EXPECT_EQ(runner.live, 0);
}

TEST_F(ThreadJobs, JobsAreCancelledWhileThreadsWorkOnThem) {
  const NifScene scene = scene_on("threads=3", nullptr);
  const NifRays rays = nifMakeRays(rays_.data(), rays_.size());
  for (int round = 0; round < 200; ++round) {
    Answers answers(rays_.size());
    const NifAnswers outputs = answers.outputs();
    NifJob job = nullptr;
    ASSERT_EQ(nifQueryAsync(scene, &rays, &outputs, &job), NIF_OK);
    std::thread waits;
    NifError waited = NIF_OK;
    if (round % 3 == 0) waits = std::thread([&] { waited = nifWaitJob(job); });
    for (int i = 0; i < round * 20; ++i) std::atomic_signal_fence(std::memory_order_seq_cst);
    ASSERT_EQ(nifCancelJob(job), NIF_OK);
    const NifError error = nifWaitJob(job);
    if (waits.joinable()) {
      waits.join();
      EXPECT_EQ(waited, error);
    }
    ASSERT_TRUE(error == NIF_OK || error == NIF_ERROR_CANCELLED);
    if (error == NIF_OK) {
      EXPECT_EQ(answers, *expected_);
    } else {
      for (size_t i = 0; i < rays_.size(); ++i)
        ASSERT_TRUE(answers.visible[i] == 0xcc || answers.visible[i] == expected_->visible[i]);
    }
    nifReleaseJob(job);
  }
  nifReleaseScene(scene);
}

TEST_F(ThreadJobs, ACancelledJobThatIsDoneStaysDone) {
  const NifScene scene = scene_on("threads=1", nullptr);
  Answers answers(rays_.size());
  const NifRays rays = nifMakeRays(rays_.data(), rays_.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(scene, &rays, &outputs, &job), NIF_OK);
  ASSERT_EQ(nifCancelJob(job), NIF_OK);
  EXPECT_EQ(nifWaitJob(job), NIF_OK);
  EXPECT_EQ(answers, *expected_);
  nifReleaseJob(job);
  nifReleaseScene(scene);
}

}  // namespace
}  // namespace nif::test
