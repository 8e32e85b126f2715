// nif.hpp: nif.h for C++20, with handles that release themselves, errors as exceptions, and spans for arrays.
//
//   nifkit::Device device;
//   nifkit::Scene scene(device);
//   scene.add_asset(nifkit::Asset::load(device, "dragon.nif"));
//   scene.commit();
//   scene.query(nifkit::Rays(my_rays), nifkit::Answers().visible(my_bytes));
//
// What nif.h says about a call is true here too. Header only.
#pragma once

#include <nif/nif.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace nifkit {

/// Thrown when a call fails: its error code, and its message as what().
class Error : public std::runtime_error {
 public:
  Error(NifError code, const char* sentence) : std::runtime_error(sentence), code_(code) {}
  NifError code() const { return code_; }
  /// E.g. "NIF_ERROR_FILE_NOT_FOUND".
  const char* code_name() const { return nifGetErrorName(code_); }

 private:
  NifError code_;
};

inline void check(NifError code) {
  if (code != NIF_OK) throw Error(code, nifGetErrorMessage());
}

/// A structure of nif.h with its size set and everything else zero.
template <class Structure>
Structure sized() {
  Structure structure{};
  structure.struct_size = sizeof(structure);
  return structure;
}

/// One reference to an object of nif.h. Copies share the object.
template <class Pointer, void (*kRetain)(Pointer), void (*kRelease)(Pointer)>
class Handle {
 public:
  Handle() = default;
  /// Takes over one reference from the caller.
  explicit Handle(Pointer pointer) : pointer_(pointer) {}
  Handle(const Handle& other) : pointer_(other.pointer_) { kRetain(pointer_); }
  Handle(Handle&& other) noexcept : pointer_(std::exchange(other.pointer_, nullptr)) {}
  Handle& operator=(Handle other) noexcept {
    std::swap(pointer_, other.pointer_);
    return *this;
  }
  ~Handle() { kRelease(pointer_); }

  /// The handle for calls of nif.h. Null after a move.
  Pointer get() const { return pointer_; }

 protected:
  Pointer pointer_ = nullptr;
};

/// Object to world, row-major 3x4.
using Transform = std::array<float, 12>;

class Device : public Handle<NifDevice, nifRetainDevice, nifReleaseDevice> {
 public:
  explicit Device(const std::string& config = {}, const NifDeviceCallbacks* callbacks = nullptr) {
    check(nifNewDevice(config.c_str(), callbacks, &pointer_));
  }
  NifDeviceInfo info() const {
    auto info = sized<NifDeviceInfo>();
    check(nifGetDeviceInfo(pointer_, &info));
    return info;
  }
};

/// Describes a backend of this version: index = 0, 1, ... until it throws NIF_ERROR_INVALID_ARGUMENT. The texts
/// are valid until the next call on this thread.
inline NifBackendInfo backend(uint32_t index) {
  auto info = sized<NifBackendInfo>();
  check(nifGetBackendInfo(index, &info));
  return info;
}

/// Describes a GPU: index = 0, 1, ... as in device=N, until it throws NIF_ERROR_INVALID_ARGUMENT (without a GPU
/// NIF_ERROR_NOT_AVAILABLE). The texts are valid until the next call on this thread.
inline NifGpuInfo gpu(uint32_t index) {
  auto info = sized<NifGpuInfo>();
  check(nifGetGpuInfo(index, &info));
  return info;
}

/// The text of functions for shaders, to be put before your own (nifGetShaderSource); null if there is no such
/// language.
inline const char* shader_source(NifShaderLanguage language = NIF_SHADER_GLSL) {
  return nifGetShaderSource(language);
}

class Asset : public Handle<NifAsset, nifRetainAsset, nifReleaseAsset> {
 public:
  static Asset load(const Device& device, const std::string& path, NifLoadMode mode = NIF_LOAD_COPY) {
    Asset asset;
    check(nifLoadAssetFile(device.get(), path.c_str(), mode, &asset.pointer_));
    return asset;
  }
  /// Loads a whole file from memory. In place: the bytes must not move or change until the last reference to
  /// the asset is gone, including those of scenes.
  static Asset load(const Device& device, std::span<const std::byte> bytes,
                    NifLoadMode mode = NIF_LOAD_COPY) {
    Asset asset;
    check(nifLoadAssetMemory(device.get(), bytes.data(), bytes.size(), mode, &asset.pointer_));
    return asset;
  }
  /// Loads a file of `size` bytes. `read(offset, bytes)` fills the span with the file's bytes and returns
  /// whether it could. It must not throw.
  template <class Read>
  requires std::is_invocable_r_v<bool, Read&, uint64_t, std::span<std::byte>>
  static Asset load(const Device& device, const char* name, uint64_t size, Read&& read) {
    auto reader = sized<NifReader>();
    reader.user = const_cast<void*>(static_cast<const void*>(std::addressof(read)));
    reader.name = name;
    reader.size = size;
    reader.read = [](void* user, uint64_t offset, void* to, uint64_t bytes) -> uint32_t {
      return (*static_cast<std::remove_reference_t<Read>*>(user))(
          offset, std::span(static_cast<std::byte*>(to), bytes));
    };
    Asset asset;
    check(nifLoadAssetReader(device.get(), &reader, &asset.pointer_));
    return asset;
  }

  NifAssetInfo info() const {
    auto info = sized<NifAssetInfo>();
    check(nifGetAssetInfo(pointer_, &info));
    return info;
  }
  /// All parts, in order.
  std::vector<NifPartInfo> parts() const {
    std::vector<NifPartInfo> all;
    for (auto info = sized<NifPartInfo>();; all.push_back(info)) {
      const NifError error = nifGetPartInfo(pointer_, uint32_t(all.size()), &info);
      if (error == NIF_ERROR_INVALID_ARGUMENT && !all.empty()) return all;
      check(error);
    }
  }
  NifObjectInfo object(uint32_t index) const {
    auto info = sized<NifObjectInfo>();
    check(nifGetObjectInfo(pointer_, index, &info));
    return info;
  }
  NifAssetInstanceInfo instance(uint32_t index) const {
    auto info = sized<NifAssetInstanceInfo>();
    check(nifGetAssetInstanceInfo(pointer_, index, &info));
    return info;
  }
  /// The words of an object for a shader (nifGetShaderTables).
  std::vector<uint32_t> shader_tables(uint32_t object) const {
    uint64_t count = 0;
    check(nifGetShaderTables(pointer_, object, nullptr, 0, &count));
    std::vector<uint32_t> words(count);
    check(nifGetShaderTables(pointer_, object, words.data(), words.size(), &count));
    return words;
  }
  /// The file's metadata as JSON; empty if it has none.
  std::string_view metadata() const {
    const NifAssetInfo about = info();
    return {about.metadata, about.metadata_bytes};
  }
};

/// The rays of a query. The arrays belong to the caller.
class Rays {
 public:
  /// An array of NifRay: a span, or anything that converts to one.
  template <class Array>
  requires std::is_convertible_v<const Array&, std::span<const NifRay>> Rays(const Array& rays) {
    const std::span<const NifRay> array(rays);
    rays_ = nifMakeRays(array.data(), array.size());
  }
  /// Any other layout.
  explicit Rays(const NifRays& rays) : rays_(rays) {}

  /// A mask for each ray.
  Rays& masks(std::span<const uint32_t> masks) {
    if (masks.size() < rays_.count) throw Error(NIF_ERROR_INVALID_ARGUMENT, "rays: there are too few masks");
    rays_.mask = masks.data();
    rays_.mask_stride = sizeof(uint32_t);
    return *this;
  }
  /// One mask for all rays: a variable, which must stay in place until the query is done.
  Rays& mask(const uint32_t& mask) {
    rays_.mask = &mask;
    rays_.mask_stride = 0;
    return *this;
  }
  Rays& mask(uint32_t&&) = delete;
  /// The caller's work memory for the calling thread, aligned to 64: see Scene::query_scratch_bytes().
  Rays& scratch(std::span<std::byte> bytes) {
    rays_.scratch = bytes.data();
    rays_.scratch_bytes = bytes.size();
    return *this;
  }
  const NifRays& get() const { return rays_; }

 private:
  NifRays rays_;
};

/// NifAnswers or NifHits, with a check of the arrays' lengths once the number of rays is known.
template <class Structure>
class Outputs {
 public:
  /// The structure, for a query of this many rays. Throws Error if an array is too short.
  const Structure& get(uint64_t rays) const {
    if (rays > rays_) throw Error(NIF_ERROR_INVALID_ARGUMENT, too_short_);
    return outputs_;
  }

 protected:
  explicit Outputs(const char* too_short) : too_short_(too_short) {}
  /// `values`: how many the array has per ray, e.g. 3 for a normal.
  template <class T>
  void set(T* Structure::*member, std::span<T> array, uint64_t values = 1) {
    outputs_.*member = array.data();
    limit(array.size() / values);
  }
  void limit(uint64_t rays) { rays_ = std::min(rays_, rays); }

  Structure outputs_ = sized<Structure>();

 private:
  const char* too_short_;
  uint64_t rays_ = ~uint64_t{0};  ///< how many fit in every array
};

/// Where a query writes its answers: one element per ray. The arrays belong to the caller.
class Answers : public Outputs<NifAnswers> {
 public:
  Answers() : Outputs("answers: an array is too short") {}
  Answers& visible(std::span<uint8_t> bytes) { return with(&NifAnswers::visible, bytes); }
  /// Needs (rays + 7) / 8 bytes.
  Answers& visible_bits(std::span<uint8_t> bytes) {
    outputs_.visible_bits = bytes.data();
    limit(bytes.size() * 8);
    return *this;
  }
  Answers& probability(std::span<float> values) { return with(&NifAnswers::probability, values); }
  Answers& certain(std::span<uint8_t> bytes) { return with(&NifAnswers::certain, bytes); }
  Answers& logit(std::span<int32_t> values) { return with(&NifAnswers::logit, values); }

 private:
  template <class T>
  Answers& with(T* NifAnswers::*member, std::span<T> array) {
    set(member, array);
    return *this;
  }
};

/// Where a query writes first hits: one element per ray, three for normals and colours. The arrays belong to
/// the caller.
class Hits : public Outputs<NifHits> {
 public:
  Hits() : Outputs("hits: an array is too short") {}
  Hits& hit(std::span<uint8_t> bytes) { return with(&NifHits::hit, bytes); }
  Hits& t(std::span<float> values) { return with(&NifHits::t, values); }
  Hits& normal(std::span<float> values) { return with(&NifHits::normal, values, 3); }
  Hits& instance(std::span<uint32_t> numbers) { return with(&NifHits::instance, numbers); }
  Hits& object(std::span<uint32_t> numbers) { return with(&NifHits::object, numbers); }
  Hits& triangle(std::span<uint32_t> numbers) { return with(&NifHits::triangle, numbers); }
  Hits& u(std::span<float> values) { return with(&NifHits::u, values); }
  Hits& v(std::span<float> values) { return with(&NifHits::v, values); }
  Hits& certain(std::span<uint8_t> bytes) { return with(&NifHits::certain, bytes); }
  Hits& t_low(std::span<float> values) { return with(&NifHits::t_low, values); }
  Hits& t_high(std::span<float> values) { return with(&NifHits::t_high, values); }
  Hits& color(std::span<float> values) { return with(&NifHits::color, values, 3); }
  Hits& user(std::span<uint64_t> values) { return with(&NifHits::user, values); }

 private:
  template <class T>
  Hits& with(T* NifHits::*member, std::span<T> array, uint64_t values = 1) {
    set(member, array, values);
    return *this;
  }
};

/// A query that runs in the background. Do not change its arrays or the scene until it is done. The
/// destructor waits for that.
class Job {
 public:
  Job() = default;
  /// Takes over one reference from the caller.
  explicit Job(NifJob job) : job_(job) {}
  Job(Job&& other) noexcept : job_(std::exchange(other.job_, nullptr)) {}
  Job& operator=(Job&& other) noexcept {
    std::swap(job_, other.job_);
    return *this;
  }
  ~Job() {
    if (job_) nifWaitJob(job_);
    nifReleaseJob(job_);
  }

  /// Helps with the work, and returns when the job is done.
  void wait() const { check(nifWaitJob(job_)); }
  bool done() const {
    uint32_t done = 0;
    check(nifIsJobDone(job_, &done));
    return done != 0;
  }
  /// Skips the rays that no thread has started; wait() then throws NIF_ERROR_CANCELLED.
  void cancel() const { check(nifCancelJob(job_)); }
  NifJob get() const { return job_; }

 private:
  NifJob job_ = nullptr;
};

/// The instances that Scene::add_asset() added have the numbers first .. first + count - 1.
struct AddedInstances {
  uint32_t first;
  uint32_t count;
};

class Scene : public Handle<NifScene, nifRetainScene, nifReleaseScene> {
 public:
  explicit Scene(const Device& device) { check(nifNewScene(device.get(), &pointer_)); }

  /// Adds a whole asset and returns the numbers of its instances.
  AddedInstances add_asset(const Asset& asset) { return add_whole(asset, nullptr); }
  AddedInstances add_asset(const Asset& asset, const Transform& transform) {
    return add_whole(asset, transform.data());
  }
  /// Adds one object and returns the number of its instance.
  uint32_t add_instance(const Asset& asset, uint32_t object) { return add_one(asset, object, nullptr); }
  uint32_t add_instance(const Asset& asset, uint32_t object, const Transform& transform) {
    return add_one(asset, object, transform.data());
  }
  void remove_instance(uint32_t instance) { check(nifRemoveInstance(pointer_, instance)); }
  void set_instance_transform(uint32_t instance, const Transform& transform) {
    check(nifSetInstanceTransform(pointer_, instance, transform.data()));
  }
  /// transforms[k] is for instance instances[k].
  void set_instance_transforms(std::span<const uint32_t> instances, std::span<const Transform> transforms) {
    if (instances.size() != transforms.size())
      throw Error(NIF_ERROR_INVALID_ARGUMENT, "transforms: there are not as many as instances");
    if (instances.empty()) return;
    check(nifSetInstanceTransforms(pointer_, instances.size(), instances.data(), transforms[0].data(),
                                   sizeof(Transform)));
  }
  /// transforms[k] is for instance k.
  void set_instance_transforms(std::span<const Transform> transforms) {
    if (transforms.empty()) return;
    check(nifSetInstanceTransforms(pointer_, transforms.size(), nullptr, transforms[0].data(),
                                   sizeof(Transform)));
  }
  /// [NifObjectInfo::vertices], in object space; none: those at rest.
  void set_instance_vertices(uint32_t instance, std::span<const std::array<float, 3>> positions) {
    const float* const first = positions.empty() ? nullptr : positions[0].data();
    check(nifSetInstanceVertices(pointer_, instance, first, sizeof(positions[0])));
  }
  /// joints: [NifObjectInfo::joints]. weights: of the morph targets, [NifObjectInfo::targets], or none.
  void pose_instance(uint32_t instance, std::span<const Transform> joints,
                     std::span<const float> weights = {}) {
    auto pose = sized<NifPose>();
    pose.joints = joints.empty() ? nullptr : joints[0].data();
    pose.joint_count = uint32_t(joints.size());
    pose.weights = weights.data();
    pose.target_count = uint32_t(weights.size());
    pose_instance(instance, pose);
  }
  /// The same for arrays of any kind of memory, and vertices of your own (NifPose::positions).
  void pose_instance(uint32_t instance, const NifPose& pose) {
    check(nifPoseInstance(pointer_, instance, &pose));
  }
  void set_instance_origin(uint32_t instance, const std::array<double, 3>& origin) {
    check(nifSetInstanceOrigin(pointer_, instance, origin.data()));
  }
  void set_origin(const std::array<double, 3>& origin) { check(nifSetSceneOrigin(pointer_, origin.data())); }
  void set_instance_mask(uint32_t instance, uint32_t mask) {
    check(nifSetInstanceMask(pointer_, instance, mask));
  }
  void set_instance_flags(uint32_t instance, uint32_t flags) {
    check(nifSetInstanceFlags(pointer_, instance, flags));
  }
  void set_instance_user(uint32_t instance, uint64_t user) {
    check(nifSetInstanceUser(pointer_, instance, user));
  }
  NifInstanceInfo instance(uint32_t instance) const {
    auto info = sized<NifInstanceInfo>();
    check(nifGetInstanceInfo(pointer_, instance, &info));
    return info;
  }
  void commit() { check(nifCommitScene(pointer_)); }
  NifSceneInfo info() const {
    auto info = sized<NifSceneInfo>();
    check(nifGetSceneInfo(pointer_, &info));
    return info;
  }

  /// The words of the scene for a shader (nifGetSceneShaderTables).
  std::vector<uint32_t> shader_tables() const {
    uint64_t count = 0;
    check(nifGetSceneShaderTables(pointer_, nullptr, 0, &count));
    std::vector<uint32_t> words(count);
    check(nifGetSceneShaderTables(pointer_, words.data(), words.size(), &count));
    return words;
  }

  /// How many bytes of scratch a query of `count` rays needs: see Rays::scratch().
  uint64_t query_scratch_bytes(uint64_t count) const {
    uint64_t bytes = 0;
    check(nifGetQueryScratchBytes(pointer_, count, &bytes));
    return bytes;
  }
  void query(const Rays& rays, const Answers& answers) const {
    check(nifQuery(pointer_, &rays.get(), &answers.get(rays.get().count)));
  }
  [[nodiscard]] Job query_async(const Rays& rays, const Answers& answers) const {
    NifJob job = nullptr;
    check(nifQueryAsync(pointer_, &rays.get(), &answers.get(rays.get().count), &job));
    return Job(job);
  }
  /// `fallback(rays, visible)` sets visible[k] for ray rays[k] of the query. It must not throw. A device with
  /// several threads calls it on several at the same time.
  template <class Fallback>
  void query_with_fallback(const Rays& rays, const Answers& answers, float confidence,
                           Fallback&& fallback) const {
    const NifFallback call = [](void* user, uint64_t count, const uint64_t* numbers, uint8_t* visible) {
      (*static_cast<std::remove_reference_t<Fallback>*>(user))(std::span(numbers, count),
                                                               std::span(visible, count));
    };
    check(nifQueryWithFallback(pointer_, &rays.get(), &answers.get(rays.get().count), confidence, call,
                               const_cast<void*>(static_cast<const void*>(std::addressof(fallback)))));
  }
  /// Lists the open rays in `numbers`, `tmin`, `tmax` and, unless it is empty, `instances` (each may be shorter
  /// than the query). Returns how many rays are open, which may be more than fit.
  uint32_t query_open(const Rays& rays, const Answers& answers, std::span<uint32_t> numbers,
                      std::span<float> tmin, std::span<float> tmax,
                      std::span<uint32_t> instances = {}) const {
    uint32_t count = 0;
    auto open = sized<NifOpenRays>();
    open.capacity = std::min({numbers.size(), tmin.size(), tmax.size()});
    if (!instances.empty()) {
      open.capacity = std::min<uint64_t>(open.capacity, instances.size());
      open.instance = instances.data();
    }
    open.rays = numbers.data();
    open.tmin = tmin.data();
    open.tmax = tmax.data();
    open.count = &count;
    query_open(rays, answers, open);
    return count;
  }
  /// For rays in device memory: puts the query into its stream, and returns at once. All arrays of `open` and
  /// its count are in device memory too.
  void query_open(const Rays& rays, const Answers& answers, const NifOpenRays& open) const {
    check(nifQueryOpen(pointer_, &rays.get(), &answers.get(rays.get().count), &open));
  }
  void intersect(const Rays& rays, const Hits& hits) const {
    check(nifIntersect(pointer_, &rays.get(), &hits.get(rays.get().count)));
  }
  [[nodiscard]] Job intersect_async(const Rays& rays, const Hits& hits) const {
    NifJob job = nullptr;
    check(nifIntersectAsync(pointer_, &rays.get(), &hits.get(rays.get().count), &job));
    return Job(job);
  }

  /// One ray: arrays of one element, e.g. Hits().t({&t, 1}).
  void query(const NifRay& ray, const Answers& answers) const {
    check(nifQueryRay(pointer_, &ray, &answers.get(1)));
  }
  void intersect(const NifRay& ray, const Hits& hits) const {
    check(nifIntersectRay(pointer_, &ray, &hits.get(1)));
  }
  /// Is one ray visible?
  bool query(const NifRay& ray) const {
    uint8_t visible = 0;
    query(ray, Answers().visible({&visible, 1}));
    return visible != 0;
  }

 private:
  AddedInstances add_whole(const Asset& asset, const float* transform) {
    AddedInstances added{};
    check(nifAddAsset(pointer_, asset.get(), transform, &added.first, &added.count));
    return added;
  }
  uint32_t add_one(const Asset& asset, uint32_t object, const float* transform) {
    uint32_t instance = 0;
    check(nifAddInstance(pointer_, asset.get(), object, transform, &instance));
    return instance;
  }
};

}  // namespace nifkit
