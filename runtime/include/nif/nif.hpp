// nif.hpp: nif.h for C++20, with handles that release themselves, errors as exceptions, and spans for arrays.
//
//   nifkit::Device device;
//   nifkit::Scene scene(device);
//   scene.add(nifkit::Asset::load(device, "dragon.nif"));
//   scene.commit();
//   scene.query(nifkit::rays(my_rays).visible(my_bytes));
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

/// Describes a GPU, numbered as in device=N. The texts are valid until the next call on this thread.
inline NifCardInfo card(uint32_t index) {
  auto info = sized<NifCardInfo>();
  check(nifGetCardInfo(index, &info));
  return info;
}

class Asset : public Handle<NifAsset, nifRetainAsset, nifReleaseAsset> {
 public:
  static Asset load(const Device& device, const std::string& path, NifLoadMode mode = NIF_LOAD_READ) {
    Asset asset;
    check(nifLoadAssetFile(device.get(), path.c_str(), mode, &asset.pointer_));
    return asset;
  }
  /// Copies the bytes; free them when you like.
  static Asset copy(const Device& device, std::span<const std::byte> bytes) {
    return from(device, bytes, NIF_MEMORY_COPY);
  }
  /// Uses the bytes in place. They must not move or change until the last reference to the asset is gone,
  /// including those of scenes.
  static Asset borrow(const Device& device, std::span<const std::byte> bytes) {
    return from(device, bytes, NIF_MEMORY_BORROW);
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
  NifInstanceInfo instance(uint32_t index) const {
    auto info = sized<NifInstanceInfo>();
    check(nifGetInstanceInfo(pointer_, index, &info));
    return info;
  }
  /// The file's metadata as JSON; empty if it has none.
  std::string_view metadata() const {
    const NifAssetInfo about = info();
    return {about.metadata, about.metadata_bytes};
  }

 private:
  static Asset from(const Device& device, std::span<const std::byte> bytes, NifMemoryMode mode) {
    Asset asset;
    check(nifLoadAssetMemory(device.get(), bytes.data(), bytes.size(), mode, &asset.pointer_));
    return asset;
  }
};

/// A NifQuery with setters that check lengths. The arrays belong to the caller.
class Query {
 public:
  explicit Query(const NifQuery& query) : query_(query) {}

  Query& visible(std::span<uint8_t> bytes) { return output(query_.visible, bytes, query_.count); }
  Query& visible_bits(std::span<uint8_t> bytes) {
    return output(query_.visible_bits, bytes, query_.count / 8 + (query_.count % 8 != 0));
  }
  Query& probability(std::span<float> values) { return output(query_.probability, values, query_.count); }
  Query& certain(std::span<uint8_t> bytes) { return output(query_.certain, bytes, query_.count); }
  Query& logit(std::span<int32_t> values) { return output(query_.logit, values, query_.count); }

  const NifQuery& get() const { return query_; }

 private:
  template <class T>
  Query& output(T*& pointer, std::span<T> array, uint64_t needed) {
    if (array.size() < needed) throw Error(NIF_ERROR_INVALID_ARGUMENT, "query: an output is too short");
    pointer = array.data();
    return *this;
  }

  NifQuery query_;
};

/// A query that runs in the background. Do not change its arrays or the scene until it is done.
class Job : public Handle<NifJob, nifRetainJob, nifReleaseJob> {
 public:
  using Handle::Handle;
  /// Helps with the work, and returns when the job is done.
  void wait() const { check(nifWaitJob(pointer_)); }
  bool done() const {
    uint32_t done = 0;
    check(nifIsJobDone(pointer_, &done));
    return done != 0;
  }
};

/// A query for these rays. Set the outputs that you want before you ask it.
inline Query rays(std::span<const NifRay> rays) { return Query(nifQueryRays(rays.data(), rays.size())); }

class Scene : public Handle<NifScene, nifRetainScene, nifReleaseScene> {
 public:
  explicit Scene(const Device& device) { check(nifNewScene(device.get(), &pointer_)); }

  /// Adds a whole asset and returns the number of its first instance.
  uint32_t add(const Asset& asset) { return add_all(asset, nullptr); }
  uint32_t add(const Asset& asset, const Transform& transform) { return add_all(asset, transform.data()); }
  /// Adds one object and returns the number of its instance.
  uint32_t add(const Asset& asset, uint32_t object, const Transform& transform) {
    uint32_t instance = 0;
    check(nifAddInstance(pointer_, asset.get(), object, transform.data(), &instance));
    return instance;
  }
  void set_transform(uint32_t instance, const Transform& transform) {
    check(nifSetInstanceTransform(pointer_, instance, transform.data()));
  }
  void commit() { check(nifCommitScene(pointer_)); }
  NifSceneInfo info() const {
    auto info = sized<NifSceneInfo>();
    check(nifGetSceneInfo(pointer_, &info));
    return info;
  }

  void query(const Query& query) const { check(nifQuery(pointer_, &query.get())); }
  /// Destroying the job does not wait for it: call wait() before you free the arrays.
  [[nodiscard]] Job query_async(const Query& query) const {
    NifJob job = nullptr;
    check(nifQueryAsync(pointer_, &query.get(), &job));
    return Job(job);
  }
  /// `fallback(rays, visible)` sets visible[k] for ray rays[k] of the query. It must not throw. A device with
  /// several threads calls it on several at the same time.
  template <class Fallback>
  void query_with_fallback(const Query& query, float confidence, Fallback&& fallback) const {
    const NifFallback call = [](void* user, uint64_t count, const uint64_t* rays, uint8_t* visible) {
      (*static_cast<std::remove_reference_t<Fallback>*>(user))(std::span(rays, count),
                                                               std::span(visible, count));
    };
    check(nifQueryWithFallback(pointer_, &query.get(), confidence, call,
                               const_cast<void*>(static_cast<const void*>(std::addressof(fallback)))));
  }
  /// Lists what stays open in `rays`, `tmin` and `tmax` (each may be shorter than the query) and returns how
  /// many rays that are, which may be more than there is room for.
  uint32_t query_open(const Query& query, std::span<uint32_t> rays, std::span<float> tmin,
                      std::span<float> tmax) const {
    uint32_t count = 0;
    auto open = sized<NifOpenRays>();
    open.capacity = std::min({rays.size(), tmin.size(), tmax.size()});
    open.rays = rays.data();
    open.tmin = tmin.data();
    open.tmax = tmax.data();
    open.count = &count;
    check(nifQueryOpen(pointer_, &query.get(), &open));
    return count;
  }
  /// Of device memory: puts the query into its stream, and returns at once. All arrays of `open`, and its
  /// count, are device memory, too.
  void query_open(const Query& query, const NifOpenRays& open) const {
    check(nifQueryOpen(pointer_, &query.get(), &open));
  }
  /// First hits. The query has no outputs of its own; the arrays of `hits` belong to the caller, are of the
  /// same memory as the rays, and have an entry for each ray.
  void intersect(const Query& query, const NifHits& hits) const {
    check(nifIntersect(pointer_, &query.get(), &hits));
  }
  [[nodiscard]] Job intersect_async(const Query& query, const NifHits& hits) const {
    NifJob job = nullptr;
    check(nifIntersectAsync(pointer_, &query.get(), &hits, &job));
    return Job(job);
  }
  bool visible(const NifRay& ray) const {
    uint8_t visible = 0;
    check(nifQueryRay(pointer_, &ray, &visible));
    return visible != 0;
  }

 private:
  uint32_t add_all(const Asset& asset, const float* transform) {
    uint32_t first = 0;
    check(nifAddAsset(pointer_, asset.get(), transform, &first, nullptr));
    return first;
  }
};

}  // namespace nifkit
