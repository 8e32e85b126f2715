// The base of what handles refer to: a reference-counted object in memory from its device's allocator.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <utility>

// The objects behind the caller's handles.
struct NifDeviceObject;
struct NifAssetObject;
struct NifSceneObject;
struct NifJobObject;

namespace nif::runtime {

class Object {
 public:
  Object() = default;
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;

  void retain() { references_.fetch_add(1, std::memory_order_relaxed); }
  /// Returns true if that was the last reference.
  bool drop() { return references_.fetch_sub(1, std::memory_order_acq_rel) == 1; }

 private:
  std::atomic<uint32_t> references_{1};
};

/// Makes an object in the given memory.
template <class T, class... Arguments>
T* create(std::pmr::memory_resource* memory, Arguments&&... arguments) {
  void* at = memory->allocate(sizeof(T), alignof(T));
  try {
    return new (at) T(std::forward<Arguments>(arguments)...);
  } catch (...) {
    memory->deallocate(at, sizeof(T), alignof(T));
    throw;
  }
}

template <class T>
void destroy(std::pmr::memory_resource* memory, T* object) {
  object->~T();
  memory->deallocate(object, sizeof(T), alignof(T));
}

/// One object's reference to another. T has release(T*).
template <class T>
class Ref {
 public:
  Ref() = default;
  explicit Ref(T* object) : object_(object) {
    if (object_) object_->retain();
  }
  Ref(Ref&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Ref(const Ref& other) : Ref(other.object_) {}
  Ref& operator=(Ref other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  ~Ref() { release(object_); }
  T* get() const { return object_; }
  T* operator->() const { return object_; }

 private:
  T* object_ = nullptr;
};

}  // namespace nif::runtime
