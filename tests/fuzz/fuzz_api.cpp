// The C API as a sequence of calls that the input spells: devices, assets, scenes, queries and jobs, in any
// order, with handles that are null or released, in one thread; instances are changed, removed and asked back,
// and the caller's callbacks fail, or run late. Calls that the header allows succeed, those that it calls an
// error give the code that it names, all memory comes back, and what different calls say of the same rays
// agrees.
#include <nif/nif.h>

#include <cmath>
#include <vector>

#include "tests/fuzz/api_model.hpp"
#include "tests/support/query_answers.hpp"
#include "tests/support/test_first_hits.hpp"

namespace {

using namespace nif::test;

constexpr uint32_t kSlots = 4, kMostCalls = 200, kMostInstances = 64;

class Session : Drawn {
 public:
  explicit Session(Choices choices) : Drawn(choices) {
    callbacks_.struct_size = sizeof(callbacks_);
    callbacks_.user = &caller_;
    callbacks_.allocate = Caller::allocate;
    callbacks_.deallocate = Caller::deallocate;
    caller_.budget.limit = 256 << 20;
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
    caller_.runner.run(~size_t{0});  // a device lives until its tasks have run
    must(caller_.budget.held == 0);
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
    switch (choices_.below(40)) {
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
      case 18:
      case 19:
        return bend();
      case 22:
      case 23:
      case 24:
        return change();
      case 25:
      case 26:
        return remove();
      case 27:
        return move_many();
      case 28:
      case 29:
        return set_origin();
      case 30:
        return set_scene_origin();
      case 31:
      case 32:
        return ask_back();
      case 33:
        return load_piecewise();
      case 34:
        return caller_.runner.run(1 + choices_.below(4));
      case 35:
      case 36:
        return commit();
      case 37:
      case 38:
        return ask();
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
                                               "queries=-1",   "threads=1,threads=1",
                                               "shaders=on",   "shaders=on,memory=least"};
    NifDevice device = nullptr;
    const char* config = kConfigs[choices_.below(std::size(kConfigs))];
    NifDeviceCallbacks callbacks = callbacks_;
    const uint32_t more = choices_.below(8);
    if (more & 1) callbacks.log = Caller::log;
    if (more & 2) callbacks.submit = Caller::submit, config = more & 4 ? "threads=2" : config;
    const NifError error = nifNewDevice(config, &callbacks, &device);
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
                           borrow ? NIF_LOAD_IN_PLACE : NIF_LOAD_COPY, &asset);
    if (!device.alive()) return must_be_dead(error);
    must(error == NIF_OK);
    slot = {asset, 1, device.device};
  }

  /// With one bit flipped, or truncated.
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
    const NifError error = nifLoadAssetMemory(device.handle, file.data(), file.size(), NIF_LOAD_COPY, &asset);
    if (!device.alive()) return must_be_dead(error);
    must(error >= NIF_ERROR_FILE_EMPTY && error <= NIF_ERROR_UNSUPPORTED_NIF && asset == nullptr);
  }

  /// Through a reader of a stated size, which may fail.
  void load_piecewise() {
    const Slot<NifDevice>& device = pick(devices_);
    Slot<NifAsset>& slot = pick(assets_);
    if (slot.alive()) return;
    const File& file = files()[choices_.below(uint32_t(files().size()))];
    Piecewise piecewise{&file};
    piecewise.reads = choices_.below(4) ? 1000 : choices_.below(3);
    NifReader reader{};
    reader.struct_size = sizeof(reader);
    reader.user = &piecewise;
    reader.name = choices_.below(2) ? "piecewise" : nullptr;
    reader.size = file.size();
    const uint32_t lie = choices_.below(6);
    if (lie == 0) reader.size = choices_.word() % file.size();
    if (lie == 1) reader.size += 1 + choices_.word();
    if (lie == 2) reader.size = ~uint64_t{0} - choices_.below(9);
    reader.read = Piecewise::read;
    NifAsset asset = nullptr;
    const NifError error = nifLoadAssetReader(device.handle, &reader, &asset);
    if (!device.alive()) return must_be_dead(error);
    if (piecewise.failed) must(error == NIF_ERROR_FILE_UNREADABLE);
    if (error != NIF_OK) {
      must(asset == nullptr && error >= NIF_ERROR_FILE_UNREADABLE && error <= NIF_ERROR_UNSUPPORTED_NIF);
      must(std::strstr(nifGetErrorMessage(), reader.name ? "piecewise" : "reader") != nullptr);
      return must(piecewise.failed || reader.size != file.size());
    }
    must(reader.size == file.size() && piecewise.next == file.size());
    slot = {asset, 1, device.device};
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

  void add() {
    SceneSlot& scene = pick(scenes_);
    const Slot<NifAsset>& asset = pick(assets_);
    if (scene.instances.size() > kMostInstances) return;
    const bool whole = choices_.below(2), placed = choices_.below(2);
    const std::array<float, 12> transform = matrix();
    const float* where = placed ? transform.data() : nullptr;
    const uint32_t object = choices_.below(8);
    uint32_t first = 0xdead, count = 1;
    const NifError error = whole ? nifAddAsset(scene.handle, asset.handle, where, &first, &count)
                                 : nifAddInstance(scene.handle, asset.handle, object, where, &first);
    if (!scene.alive() || !asset.alive()) return must_be_dead(error);
    // If several things are wrong, any of them may be reported.
    if (scene.device != asset.device || (placed && !is_finite(transform))) must(error != NIF_OK);
    must(error == NIF_OK || error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_SINGULAR_TRANSFORM ||
         error == NIF_ERROR_UNSUPPORTED_NIF);
    if (error != NIF_OK) return;
    must(first == scene.lowest_free(count));
    if (scene.instances.size() < first + count) scene.instances.resize(first + count);
    std::fill_n(scene.instances.begin() + first, count, Known());
    NifAssetInstanceInfo of_file{};
    of_file.struct_size = sizeof(of_file);
    for (uint32_t i = 0; whole && i < count; ++i) {
      if (nifGetAssetInstanceInfo(asset.handle, i, &of_file) != NIF_OK) break;  // the file has no instances
      Known& known = scene.instances[first + i];
      known.mask = of_file.mask, known.flags = of_file.flags, known.user = of_file.user;
    }
    if (count > 0) scene.committed = false;
  }

  void move() {
    SceneSlot& scene = pick(scenes_);
    const uint32_t instance = choices_.below(kMostInstances);
    const std::array<float, 12> transform = matrix();
    const NifError error = nifSetInstanceTransform(scene.handle, instance, transform.data());
    if (!scene.alive()) return must_be_dead(error);
    if (!scene.has(instance) || !is_finite(transform)) must(error != NIF_OK);
    must_be_placed(error);
    if (error == NIF_OK) scene.committed = false;
  }

  /// By vertices or by a pose, which may be anything.
  void bend() {
    SceneSlot& scene = pick(scenes_);
    const uint32_t instance = any_instance(scene);
    const NifInstanceInfo about = instance_info(scene, instance);
    NifObjectInfo object{};
    object.struct_size = sizeof(object);
    if (about.asset != nullptr) must(nifGetObjectInfo(about.asset, about.object, &object) == NIF_OK);
    NifError error;
    bool fine = scene.has(instance);
    if (choices_.below(2)) {
      std::vector<float> positions(3 * (object.vertices + 1));
      for (float& x : positions) x = matrix()[0];
      error =
          nifSetInstanceVertices(scene.handle, instance, choices_.below(4) ? positions.data() : nullptr, 12);
    } else {
      std::vector<std::array<float, 12>> joints(object.joints + choices_.below(2));
      for (auto& joint : joints) joint = matrix();
      std::vector<float> weights(object.targets);
      for (float& weight : weights) weight = matrix()[1];
      NifPose pose{};
      pose.struct_size = sizeof(pose);
      pose.joints = joints.empty() ? nullptr : joints[0].data();
      pose.joint_count = uint32_t(joints.size());
      pose.weights = weights.data();
      pose.target_count = uint32_t(weights.size());
      std::vector<float> positions(3 * (object.vertices + 1));
      for (float& x : positions) x = matrix()[2];
      const uint32_t rare = choices_.below(8);  // vertices in place of joints, or too; another kind of memory
      if (rare == 0) pose.joint_count = pose.target_count = 0, pose.joints = pose.weights = nullptr;
      if (rare <= 1) pose.positions = positions.data(), pose.position_stride = 12;
      if (rare == 2) pose.memory = 1 + choices_.below(2);
      error = nifPoseInstance(scene.handle, instance, &pose);
      fine = fine && rare != 2 && (rare <= 1 ? pose.joints == nullptr : joints.size() == object.joints);
    }
    if (!scene.alive()) return must_be_dead(error);
    if (!fine) must(error != NIF_OK);
    if (error == NIF_OK) scene.committed = false;
  }

  /// It may also be refused for its position.
  static void must_be_placed(NifError error) {
    must(error == NIF_OK || error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_SINGULAR_TRANSFORM);
  }

  uint32_t any_instance(const SceneSlot& scene) {
    return choices_.below(uint32_t(scene.instances.size()) + 2);
  }

  /// For many instances at once: some, or the first ones; with any stride, also negative, zero or unaligned.
  void move_many() {
    SceneSlot& scene = pick(scenes_);
    static constexpr uint64_t kStrides[] = {48, 0, 64, uint64_t(-48), 49};
    constexpr uint32_t kMost = 6;
    const uint64_t stride = kStrides[choices_.below(5)];
    const bool first_ones = choices_.below(2);
    const uint32_t count = choices_.below(kMost + 1);
    std::vector<char> bytes(64 * kMost);
    char* const start = bytes.data() + (stride == uint64_t(-48) ? 48 * (kMost - 1) : 0);
    uint32_t numbers[kMost];
    bool fine = true;
    for (uint32_t k = 0; k < count; ++k) {
      numbers[k] = any_instance(scene);
      fine = fine && scene.has(first_ones ? k : numbers[k]);
      const std::array<float, 12> transform = matrix();
      std::memcpy(start + std::ptrdiff_t(int64_t(k * stride)), transform.data(), sizeof(transform));
    }
    for (uint32_t k = 0; k < count; ++k) {
      std::array<float, 12> transform;
      std::memcpy(transform.data(), start + std::ptrdiff_t(int64_t(k * stride)), sizeof(transform));
      fine = fine && is_finite(transform);
    }
    NifInstanceInfo before = instance_info(scene, 0), after;
    const NifError error = nifSetInstanceTransforms(scene.handle, count, first_ones ? nullptr : numbers,
                                                    reinterpret_cast<const float*>(start), stride);
    if (!scene.alive()) return must_be_dead(error);
    if (!fine) must(error != NIF_OK);
    must_be_placed(error);
    if (error == NIF_OK && count > 0) scene.committed = false;
    if (error == NIF_OK) return;
    after = instance_info(scene, 0);
    must(std::memcmp(&before, &after, sizeof(before)) == 0);
  }

  /// Zeros if there is none.
  static NifInstanceInfo instance_info(const SceneSlot& scene, uint32_t number) {
    NifInstanceInfo info{};
    info.struct_size = sizeof(info);
    if (nifGetInstanceInfo(scene.handle, number, &info) != NIF_OK) info = {};
    return info;
  }

  /// Its mask, flags or user value.
  void change() {
    SceneSlot& scene = pick(scenes_);
    const uint32_t number = any_instance(scene);
    Known known = scene.has(number) ? scene.instances[number] : Known();
    NifError error;
    bool fine = scene.has(number);
    switch (choices_.below(3)) {
      case 0:
        known.mask = any_mask();
        error = nifSetInstanceMask(scene.handle, number, known.mask);
        break;
      case 1:
        known.flags = choices_.below(8) ? choices_.below(2) : choices_.word();
        fine = fine && known.flags <= NIF_INSTANCE_DISABLED;
        error = nifSetInstanceFlags(scene.handle, number, known.flags);
        break;
      default:
        known.user = uint64_t{choices_.word()} << choices_.below(33);
        error = nifSetInstanceUser(scene.handle, number, known.user);
    }
    if (!scene.alive()) return must_be_dead(error);
    // An instance too far from the scene's new origin is refused whatever is changed.
    if (!fine || !scene.moved) must((error == NIF_OK) == fine);
    must_be_placed(error == NIF_ERROR_NOT_AVAILABLE && !fine ? NIF_OK : error);
    if (error != NIF_OK) return;
    scene.instances[number] = known;
    scene.committed = false;
  }

  void remove() {
    SceneSlot& scene = pick(scenes_);
    const uint32_t number = any_instance(scene);
    const NifError error = nifRemoveInstance(scene.handle, number);
    if (!scene.alive()) return must_be_dead(error);
    must(error == (scene.has(number) ? NIF_OK : NIF_ERROR_INVALID_ARGUMENT));
    if (error != NIF_OK) return;
    scene.instances[number].exists = false;
    while (!scene.instances.empty() && !scene.instances.back().exists) scene.instances.pop_back();
    scene.committed = false;
  }

  void set_origin() {
    SceneSlot& scene = pick(scenes_);
    const uint32_t number = any_instance(scene);
    const std::array<double, 3> at = place();
    const bool none = choices_.below(8) == 0;
    const NifError error = nifSetInstanceOrigin(scene.handle, number, none ? nullptr : at.data());
    if (!scene.alive()) return must_be_dead(error);
    if (!scene.has(number) || (!none && !is_finite(at))) must(error != NIF_OK);
    must_be_placed(error);
    if (error != NIF_OK) return;
    scene.instances[number].origin = none ? std::array<double, 3>{} : at;
    scene.committed = false;
  }

  void set_scene_origin() {
    SceneSlot& scene = pick(scenes_);
    const std::array<double, 3> at = place();
    const bool none = choices_.below(4) == 0;
    const NifError error = nifSetSceneOrigin(scene.handle, none ? nullptr : at.data());
    if (!scene.alive()) return must_be_dead(error);
    must(error == (none || is_finite(at) ? NIF_OK : NIF_ERROR_INVALID_ARGUMENT));
    if (error != NIF_OK) return;
    scene.origin = none ? std::array<double, 3>{} : at;
    scene.committed = false;
    scene.moved = true;
  }

  /// Checks that all instances of a scene are as we have set them.
  void ask_back() {
    const SceneSlot& scene = pick(scenes_);
    for (uint32_t number = 0; number < scene.instances.size() + 2; ++number) {
      NifInstanceInfo info{};
      info.struct_size = sizeof(info);
      const NifError error = nifGetInstanceInfo(scene.handle, number, &info);
      if (!scene.alive()) return must_be_dead(error);
      must(error == (scene.has(number) ? NIF_OK : NIF_ERROR_INVALID_ARGUMENT));
      if (error != NIF_OK) continue;
      const Known& known = scene.instances[number];
      must(info.mask == known.mask && info.flags == known.flags && info.user == known.user);
      must(std::equal(known.origin.begin(), known.origin.end(), info.origin));
    }
  }

  void commit() {
    SceneSlot& scene = pick(scenes_);
    const NifError error = nifCommitScene(scene.handle);
    if (!scene.alive()) return must_be_dead(error);
    // Instances may be too far from the scene's new origin.
    if (scene.moved) must_be_placed(error);
    if (!scene.moved) must(error == NIF_OK);
    if (error != NIF_OK) return must(!scene.committed);
    scene.committed = true;
    scene.moved = false;
  }

  /// All kinds of calls for the same rays.
  void ask() {
    const SceneSlot& scene = pick(scenes_);
    const std::vector<NifRay> asked = rays();
    const size_t count = asked.size();
    const std::vector<uint32_t> masks = this->masks(count);
    const auto mask_of = [&](size_t i) {
      return masks.empty() ? 0xffffffffu : masks.size() == 1 ? masks[0] : masks[i];
    };
    Answers answers(count);
    NifRays query = nifMakeRays(asked.data(), count);
    query.mask = masks.empty() ? nullptr : masks.data();
    query.mask_stride = masks.size() == 1 ? 0 : sizeof(uint32_t);
    NifAnswers outputs = answers.outputs();
    const NifError error = nifQuery(scene.handle, &query, &outputs);
    if (!scene.alive()) return must_be_dead(error);
    if (!scene.committed) return must(error == NIF_ERROR_INVALID_OPERATION);
    must(error == NIF_OK);

    std::vector<uint32_t> open(count), open_instance(count);
    uint32_t open_count = 0;
    NifOpenRays lists{};
    lists.struct_size = sizeof(lists);
    lists.capacity = count;
    lists.rays = open.data();
    lists.instance = open_instance.data();
    lists.count = &open_count;
    must(nifQueryOpen(scene.handle, &query, nullptr, &lists) == NIF_OK);
    must(open_count <= count);
    std::vector<bool> is_open(count);
    for (uint32_t k = 0; k < open_count; ++k) {
      const uint32_t ray = open[k], instance = open_instance[k];
      must(ray < count && !is_open[ray]);
      is_open[ray] = true;
      must(instance == NIF_NONE ||
           (instance < scene.instances.size() && scene.instances[instance].lets_in(mask_of(ray))));
    }

    FirstHits hits(count);
    const NifHits to_hits = hits.outputs();
    must(nifIntersect(scene.handle, &query, &to_hits) == NIF_OK);

    for (size_t i = 0; i < count; ++i) {
      must(answers.visible[i] <= 1 && (answers.bits[i / 8] >> i % 8 & 1) == answers.visible[i]);
      must(answers.probability[i] >= 0 && answers.probability[i] <= 1);
      if (masks.empty()) ask_alone(scene, asked[i], answers.visible[i]);
      must(hits.hit[i] == 1 - answers.visible[i]);
      if (hits.hit[i]) {
        const uint32_t instance = hits.instance[i];
        must(instance < scene.instances.size() && scene.instances[instance].lets_in(mask_of(i)));
        must(hits.user[i] == scene.instances[instance].user);
      } else {
        must(hits.instance[i] == NIF_NONE && hits.t[i] == INFINITY && hits.user[i] == 0);
      }
      must(!(hits.high[i] < hits.low[i]));
      must(!is_open[i] || !answers.certain[i]);
    }
  }

  static void ask_alone(const SceneSlot& scene, const NifRay& ray, uint8_t visible) {
    uint8_t one = 7, hit = 7;
    NifAnswers answers{};
    answers.struct_size = sizeof(answers);
    answers.visible = &one;
    must(nifQueryRay(scene.handle, &ray, &answers) == NIF_OK && one == visible);
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.hit = &hit;
    must(nifIntersectRay(scene.handle, &ray, &hits) == NIF_OK && hit == 1 - visible);
  }

  void ask_in_background() {
    const SceneSlot& scene = pick(scenes_);
    Slot<NifJob>& slot = pick(jobs_);
    if (slot.alive()) return cancel(slot);
    const std::vector<NifRay> asked = rays();
    Answers background(asked.size()), plain(asked.size());
    const NifRays query = nifMakeRays(asked.data(), asked.size());
    NifAnswers outputs = background.outputs();
    NifJob job = nullptr;
    const NifError error = nifQueryAsync(scene.handle, &query, &outputs, &job);
    if (!scene.alive()) return must_be_dead(error);
    if (!scene.committed) return must(error == NIF_ERROR_INVALID_OPERATION && job == nullptr);
    must(error == NIF_OK);
    // Tasks may run before the job is waited for, or only after it is done.
    const uint32_t what = choices_.below(4);
    if (what & 1) caller_.runner.run(1);
    if (what == 3) must(nifCancelJob(job) == NIF_OK);
    const NifError waited = nifWaitJob(job);
    must(waited == NIF_OK || (what == 3 && waited == NIF_ERROR_CANCELLED));
    must(nifWaitJob(job) == waited);
    uint32_t done = 0;
    must(nifIsJobDone(job, &done) == NIF_OK && done == 1);
    outputs = plain.outputs();
    must(nifQuery(scene.handle, &query, &outputs) == NIF_OK);
    must(waited == NIF_ERROR_CANCELLED || background == plain);
    slot = {job, 1, scene.device};
  }

  /// A finished job keeps its result.
  static void cancel(const Slot<NifJob>& job) {
    const NifError before = nifWaitJob(job.handle);
    must(nifCancelJob(job.handle) == NIF_OK && nifWaitJob(job.handle) == before);
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
    NifAssetInstanceInfo instance{};
    instance.struct_size = sizeof(instance);
    must((nifGetAssetInstanceInfo(asset.handle, number, &instance) == NIF_OK) ==
         (number < about.instance_count));
    uint64_t resident = 0, in_file = 0;
    NifPartInfo part{};
    part.struct_size = sizeof(part);
    for (uint32_t p = 0; nifGetPartInfo(asset.handle, p, &part) == NIF_OK; ++p) {
      resident += part.resident_bytes;
      in_file += part.file_bytes;
    }
    must(resident == about.resident_bytes && in_file == about.file_bytes);
    uint64_t words = 0;
    if (nifGetShaderTables(asset.handle, number, nullptr, 0, &words) == NIF_OK) {
      std::vector<uint32_t> tables(words);
      const uint64_t room = choices_.below(2) ? words : choices_.below(uint32_t(words));
      must((nifGetShaderTables(asset.handle, number, tables.data(), room, &words) == NIF_OK) ==
           (room == tables.size()));
    }
    const SceneSlot& scene = pick(scenes_);
    NifSceneInfo of_scene{};
    of_scene.struct_size = sizeof(of_scene);
    const NifError answer = nifGetSceneInfo(scene.handle, &of_scene);
    if (!scene.alive()) return must_be_dead(answer);
    must(answer == NIF_OK && of_scene.instance_count == scene.count() &&
         std::equal(scene.origin.begin(), scene.origin.end(), of_scene.origin) &&
         of_scene.instance_end == scene.instances.size() && of_scene.committed == uint32_t(scene.committed));
  }

  /// Retaining a dead handle does nothing.
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

  Caller caller_;
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
