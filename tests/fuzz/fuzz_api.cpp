// The C API as a sequence of calls that the input spells: devices, assets, scenes, queries and jobs, in any
// order, with handles that are null or released, in one thread. Calls that the header allows succeed, those
// that it calls an error give the code that it names, all memory comes back, and what different calls say of
// the same rays agrees.
#include <nif/nif.h>

#include <array>
#include <vector>

#include "formats/nif/writer.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/first_hits.hpp"
#include "tests/support/random_asset.hpp"

namespace {

using nif::test::Budget, nif::test::Choices, nif::test::must;

constexpr uint32_t kSlots = 4, kMostCalls = 200, kMostRays = 24, kMostInstances = 64;

using File = std::vector<std::byte>;

/// Files of every encoding, coded and not.
const std::vector<File>& files() {
  static const std::vector<File> files = [] {
    using Options = nif::test::RandomAssetOptions;
    std::vector<File> made;
    for (const Options& options :
         {Options{.objects = 1, .instances = 2, .max_voxels = 6, .features = 2},
          Options{
              .objects = 0, .instances = 3, .max_voxels = 6, .bvhs = 2, .sources = 1, .translations = true},
          Options{.objects = 0, .instances = 1, .max_voxels = 6, .exacts = 1, .colors = 1},
          Options{.objects = 0, .instances = 0, .max_voxels = 6, .proofs = 2},
          Options{.objects = 0, .instances = 1, .max_voxels = 6, .sphericals = 1, .primaries = 1},
          Options{.objects = 1,
          .instances = 5,
          .max_voxels = 9,
          .bvhs = 1,
          .sphericals = 1,
          .exacts = 1,
          .proofs = 1,
          .coded = nif::test::kCodedAll}})
      made.push_back(nif::format::encode(nif::test::random_asset(made.size(), options)));
    return made;
  }();
  return files;
}

/// Borrowed bytes, at the alignment that this takes, which must outlive all handles.
const void* borrowed(uint32_t which) {
  struct alignas(NIF_ASSET_ALIGNMENT) Line {
    std::byte bytes[NIF_ASSET_ALIGNMENT];
  };
  static std::array<std::vector<Line>, 6> copies;
  std::vector<Line>& copy = copies[which];
  if (copy.empty()) {
    copy.resize(files()[which].size() / sizeof(Line) + 1);
    std::memcpy(copy.data(), files()[which].data(), files()[which].size());
  }
  return copy.data();
}

/// A handle, and how many references of it we hold. It may be dead: then the value stays.
template <class Handle>
struct Slot {
  Handle handle = nullptr;
  uint32_t references = 0;
  int device = -1;  ///< which of ours it belongs to, by serial number
  bool alive() const { return references > 0; }
};

struct SceneSlot : Slot<NifScene> {
  uint32_t instances = 0;
  bool committed = false;
};

class Session {
 public:
  explicit Session(Choices choices) : choices_(choices) {
    callbacks_.struct_size = sizeof(callbacks_);
    callbacks_.user = &budget_;
    callbacks_.allocate = Budget::allocate;
    callbacks_.deallocate = Budget::deallocate;
    budget_.limit = 256 << 20;
  }

  void run() {
    for (uint32_t calls = 0; calls < kMostCalls && !choices_.empty(); ++calls) call();
    for (auto& job : jobs_)
      while (job.alive()) release(job, nifReleaseJob);
    for (auto& scene : scenes_)
      while (scene.alive()) release(scene, nifReleaseScene);
    for (auto& asset : assets_)
      while (asset.alive()) release(asset, nifReleaseAsset);
    for (auto& device : devices_)
      while (device.alive()) release(device, nifReleaseDevice);
    must(budget_.held == 0);
  }

 private:
  template <class S>
  S& pick(std::array<S, kSlots>& slots) {
    return slots[choices_.below(kSlots)];
  }

  template <class S, class Release>
  static void release(S& slot, Release give_back) {
    give_back(slot.handle);
    if (slot.references > 0) --slot.references;
  }

  /// A dead or null handle gives this code, and a sentence.
  static void must_be_dead(NifError error) {
    must(error == NIF_ERROR_INVALID_ARGUMENT && nifGetErrorMessage()[0] != 0);
  }

  void call() {
    switch (choices_.below(22)) {
      case 0:
        return new_device();
      case 1:
      case 2:
        return load();
      case 3:
        return new_scene();
      case 4:
      case 5:
      case 6:
        return add();
      case 7:
        return move();
      case 8:
      case 9:
      case 10:
        return commit();
      case 11:
      case 12:
      case 13:
        return ask();
      case 14:
        return ask_in_background();
      case 15:
        return info();
      case 16:
        return retain();
      case 17:
        return load_damaged();
      default:
        return let_go();
    }
  }

  void new_device() {
    Slot<NifDevice>& slot = pick(devices_);
    if (slot.alive()) return;
    static constexpr const char* kConfigs[] = {nullptr,        "",
                                               "isa=scalar",   "isa=sse4",
                                               "isa=avx2",     "isa=avx512",
                                               "memory=least", "queries=1",
                                               "threads=1",    "queries=2,isa=scalar",
                                               "isa=nonsense", "backend=vulkan",
                                               "queries=-1",   "threads=1,threads=1"};
    NifDevice device = nullptr;
    const NifError error = nifNewDevice(kConfigs[choices_.below(std::size(kConfigs))], &callbacks_, &device);
    must(error == NIF_OK || error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_NOT_AVAILABLE);
    if (error == NIF_OK) slot = {device, 1, ++serial_};
  }

  void load() {
    const Slot<NifDevice>& device = pick(devices_);
    Slot<NifAsset>& slot = pick(assets_);
    if (slot.alive()) return;
    const uint32_t which = choices_.below(uint32_t(files().size()));
    const File& file = files()[which];
    NifAsset asset = nullptr;
    const bool borrow = choices_.below(2);
    const NifError error =
        nifLoadAssetMemory(device.handle, borrow ? borrowed(which) : file.data(), file.size(),
                           borrow ? NIF_MEMORY_BORROW : NIF_MEMORY_COPY, &asset);
    if (!device.alive()) return must_be_dead(error);
    must(error == NIF_OK);
    slot = {asset, 1, device.device};
  }

  /// One bit of it turned over, or a beginning of it.
  void load_damaged() {
    const Slot<NifDevice>& device = pick(devices_);
    File file = files()[choices_.below(uint32_t(files().size()))];
    const size_t at = 1 + choices_.word() % (file.size() - 1);
    if (choices_.below(2))
      file[at] ^= std::byte(1u << choices_.below(8));
    else
      file.resize(at);
    file.shrink_to_fit();
    NifAsset asset = nullptr;
    const NifError error =
        nifLoadAssetMemory(device.handle, file.data(), file.size(), NIF_MEMORY_COPY, &asset);
    if (!device.alive()) return must_be_dead(error);
    must(error >= NIF_ERROR_FILE_EMPTY && error <= NIF_ERROR_UNSUPPORTED_NIF && asset == nullptr);
  }

  void new_scene() {
    const Slot<NifDevice>& device = pick(devices_);
    SceneSlot& slot = pick(scenes_);
    if (slot.alive()) return;
    NifScene scene = nullptr;
    const NifError error = nifNewScene(device.handle, &scene);
    if (!device.alive()) return must_be_dead(error);
    must(error == NIF_OK);
    slot = SceneSlot();
    slot.handle = scene;
    slot.references = 1;
    slot.device = device.device;
  }

  std::array<float, 12> matrix() {
    std::array<float, 12> rows{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (uint32_t changes = choices_.below(4); changes > 0; --changes)
      rows[choices_.below(12)] = choices_.number();
    return rows;
  }
  static bool is_finite(const std::array<float, 12>& rows) {
    for (const float x : rows)
      if (!std::isfinite(x)) return false;
    return true;
  }

  void add() {
    SceneSlot& scene = pick(scenes_);
    const Slot<NifAsset>& asset = pick(assets_);
    if (scene.instances > kMostInstances) return;
    const bool whole = choices_.below(2), placed = choices_.below(2);
    const std::array<float, 12> transform = matrix();
    const float* where = placed ? transform.data() : nullptr;
    const uint32_t object = choices_.below(8);
    uint32_t first = 0xdead, count = 1;
    const NifError error = whole ? nifAddAsset(scene.handle, asset.handle, where, &first, &count)
                                 : nifAddInstance(scene.handle, asset.handle, object, where, &first);
    if (!scene.alive() || !asset.alive()) return must_be_dead(error);
    // Where several things are wrong, either may be said.
    if (scene.device != asset.device || (placed && !is_finite(transform))) must(error != NIF_OK);
    must(error == NIF_OK || error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_SINGULAR_TRANSFORM);
    if (error != NIF_OK) return;
    must(first == scene.instances);
    scene.instances += count;
    scene.committed = false;
  }

  void move() {
    SceneSlot& scene = pick(scenes_);
    const uint32_t instance = choices_.below(kMostInstances);
    const std::array<float, 12> transform = matrix();
    const NifError error = nifSetInstanceTransform(scene.handle, instance, transform.data());
    if (!scene.alive()) return must_be_dead(error);
    if (instance >= scene.instances || !is_finite(transform)) must(error != NIF_OK);
    must(error == NIF_OK || error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_SINGULAR_TRANSFORM);
    if (error == NIF_OK) scene.committed = false;
  }

  void commit() {
    SceneSlot& scene = pick(scenes_);
    const NifError error = nifCommitScene(scene.handle);
    if (!scene.alive()) return must_be_dead(error);
    must(error == NIF_OK);
    scene.committed = true;
  }

  std::vector<NifRay> rays() {
    std::vector<NifRay> rays(1 + choices_.below(kMostRays));
    for (NifRay& ray : rays) {
      for (float& x : ray.origin) x = choices_.number();
      for (float& x : ray.direction) x = choices_.number();
      ray.tmin = choices_.below(3) ? 0 : choices_.number();
      ray.tmax = choices_.below(3) ? INFINITY : choices_.number();
    }
    return rays;
  }

  struct Answers {
    explicit Answers(size_t count)
        : visible(count), bits(count / 8 + 1), certain(count), probability(count), logit(count) {}
    void ask(NifQuery& query) {
      query.visible = visible.data();
      query.visible_bits = bits.data();
      query.certain = certain.data();
      query.probability = probability.data();
      query.logit = logit.data();
    }
    bool operator==(const Answers&) const = default;
    std::vector<uint8_t> visible, bits, certain;
    std::vector<float> probability;
    std::vector<int32_t> logit;
  };

  /// Each way to ask about the same rays.
  void ask() {
    const SceneSlot& scene = pick(scenes_);
    const std::vector<NifRay> asked = rays();
    const size_t count = asked.size();
    Answers answers(count);
    NifQuery query = nifQueryRays(asked.data(), count);
    answers.ask(query);
    const NifError error = nifQuery(scene.handle, &query);
    if (!scene.alive()) return must_be_dead(error);
    if (!scene.committed) return must(error == NIF_ERROR_INVALID_OPERATION);
    must(error == NIF_OK);

    std::vector<uint32_t> open(count);
    uint32_t open_count = 0;
    NifOpenRays lists{};
    lists.struct_size = sizeof(lists);
    lists.capacity = count;
    lists.rays = open.data();
    lists.count = &open_count;
    NifQuery plain = nifQueryRays(asked.data(), count);
    must(nifQueryOpen(scene.handle, &plain, &lists) == NIF_OK);
    must(open_count <= count);
    std::vector<bool> is_open(count);
    for (uint32_t k = 0; k < open_count; ++k) {
      must(open[k] < count && !is_open[open[k]]);
      is_open[open[k]] = true;
    }

    nif::test::FirstHits hits(count);
    const NifHits outputs = hits.outputs();
    must(nifIntersect(scene.handle, &plain, &outputs) == NIF_OK);

    for (size_t i = 0; i < count; ++i) {
      must(answers.visible[i] <= 1 && (answers.bits[i / 8] >> i % 8 & 1) == answers.visible[i]);
      must(answers.probability[i] >= 0 && answers.probability[i] <= 1);
      uint8_t one = 7;
      must(nifQueryRay(scene.handle, &asked[i], &one) == NIF_OK && one == answers.visible[i]);
      must(hits.hit[i] == 1 - answers.visible[i]);
      must(hits.hit[i] ? hits.instance[i] < scene.instances
                       : hits.instance[i] == NIF_NONE && hits.t[i] == INFINITY);
      must(!(hits.high[i] < hits.low[i]));
      must(!is_open[i] || !answers.certain[i]);
    }
  }

  void ask_in_background() {
    const SceneSlot& scene = pick(scenes_);
    Slot<NifJob>& slot = pick(jobs_);
    if (slot.alive()) return;
    const std::vector<NifRay> asked = rays();
    Answers background(asked.size()), plain(asked.size());
    NifQuery query = nifQueryRays(asked.data(), asked.size());
    background.ask(query);
    NifJob job = nullptr;
    const NifError error = nifQueryAsync(scene.handle, &query, &job);
    if (!scene.alive()) return must_be_dead(error);
    if (!scene.committed) return must(error == NIF_ERROR_INVALID_OPERATION && job == nullptr);
    must(error == NIF_OK && nifWaitJob(job) == NIF_OK);
    uint32_t done = 0;
    must(nifIsJobDone(job, &done) == NIF_OK && done == 1);
    plain.ask(query);
    must(nifQuery(scene.handle, &query) == NIF_OK && background == plain);
    slot = {job, 1, scene.device};
  }

  void info() {
    const Slot<NifAsset>& asset = pick(assets_);
    NifAssetInfo about{};
    about.struct_size = sizeof(about);
    const NifError error = nifGetAssetInfo(asset.handle, &about);
    if (!asset.alive()) return must_be_dead(error);
    must(error == NIF_OK && about.object_count > 0);
    const uint32_t number = choices_.below(10);
    NifObjectInfo object{};
    object.struct_size = sizeof(object);
    must((nifGetObjectInfo(asset.handle, number, &object) == NIF_OK) == (number < about.object_count));
    NifInstanceInfo instance{};
    instance.struct_size = sizeof(instance);
    must((nifGetInstanceInfo(asset.handle, number, &instance) == NIF_OK) == (number < about.instance_count));
    uint64_t resident = 0, in_file = 0;
    NifPartInfo part{};
    part.struct_size = sizeof(part);
    for (uint32_t p = 0; nifGetPartInfo(asset.handle, p, &part) == NIF_OK; ++p) {
      resident += part.resident_bytes;
      in_file += part.file_bytes;
    }
    must(resident == about.resident_bytes && in_file == about.file_bytes);
    const SceneSlot& scene = pick(scenes_);
    NifSceneInfo of_scene{};
    of_scene.struct_size = sizeof(of_scene);
    const NifError answer = nifGetSceneInfo(scene.handle, &of_scene);
    if (!scene.alive()) return must_be_dead(answer);
    must(answer == NIF_OK && of_scene.instance_count == scene.instances &&
         of_scene.committed == uint32_t(scene.committed));
  }

  /// Retaining what is dead does nothing.
  void retain() {
    const auto one_more = [&](auto& slot, auto keep) {
      keep(slot.handle);
      if (slot.alive()) ++slot.references;
    };
    switch (choices_.below(4)) {
      case 0:
        return one_more(pick(devices_), nifRetainDevice);
      case 1:
        return one_more(pick(assets_), nifRetainAsset);
      case 2:
        return one_more(pick(scenes_), nifRetainScene);
      default:
        return one_more(pick(jobs_), nifRetainJob);
    }
  }

  /// Nor does releasing it.
  void let_go() {
    switch (choices_.below(4)) {
      case 0:
        return release(pick(devices_), nifReleaseDevice);
      case 1:
        return release(pick(assets_), nifReleaseAsset);
      case 2:
        return release(pick(scenes_), nifReleaseScene);
      default:
        return release(pick(jobs_), nifReleaseJob);
    }
  }

  Choices choices_;
  Budget budget_;
  NifDeviceCallbacks callbacks_{};
  int serial_ = 0;
  std::array<Slot<NifDevice>, kSlots> devices_;
  std::array<Slot<NifAsset>, kSlots> assets_;
  std::array<SceneSlot, kSlots> scenes_;
  std::array<Slot<NifJob>, kSlots> jobs_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Session(Choices(data, size)).run();
  return 0;
}
