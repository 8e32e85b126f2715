// How objects get to device memory, on the host: what is laid out for them there, and what the GPU module has
// to know of each. The encodings' folders have an upload.cpp each.
#pragma once

#include <cstring>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernels/gpu/kernel_list.hpp"

namespace nif::kernels::gpu {

/// An arena that will lie at `base` in device memory. It is built twice: first to learn how large it is, and
/// once more with pointers that hold.
class Arena {
 public:
  explicit Arena(const unsigned char* base) : base_(reinterpret_cast<uintptr_t>(base)) {}

  /// Adds an array and lets the pointer point to where it will be. What several objects share is added once.
  template <class T>
  void move(const T*& array, size_t count) {
    array = static_cast<const T*>(add(array, count * sizeof(T)));
  }
  const void* add(const void* from, size_t bytes) {
    const auto [known, is_new] = placed_.try_emplace({from, bytes}, bytes_.size());
    if (is_new && bytes > 0) append(from, bytes);
    return reinterpret_cast<const void*>(base_ + known->second);
  }
  /// Adds a structure; it may have the address of one that is no more.
  template <class T>
  const T* add_structure(const T& value) {
    const size_t at = bytes_.size();
    append(&value, sizeof(value));
    return reinterpret_cast<const T*>(base_ + at);
  }
  const std::vector<unsigned char>& bytes() const { return bytes_; }

 private:
  void append(const void* from, size_t bytes) {
    const size_t at = bytes_.size();
    bytes_.resize(at + (bytes + kAlignment - 1) / kAlignment * kAlignment);
    std::memcpy(bytes_.data() + at, from, bytes);
  }

  static constexpr size_t kAlignment = 64;
  uintptr_t base_;
  std::vector<unsigned char> bytes_;
  std::map<std::pair<const void*, size_t>, size_t> placed_;
};

/// What kernels take for an object, and by which of them its items are answered.
struct ObjectPlan {
  SceneObject object{};               ///< without its field, lists, scales and number
  uint32_t row_words = 0;             ///< of shared memory, for a thread that goes all the way with its ray
  uint32_t walk_words = 0;            ///< and for one of the pipeline's walk
  Stage stages[2]{kStages, kStages};  ///< of both sorts of items; kStages: there are none
  uint32_t stage_bytes = 0;           ///< of shared memory, of a block of either stage but kAlone
  PipelineList list{};                ///< what its lists are like, without the field

  template <class Layout>
  void set_layout(const Layout& layout) {
    static_assert(sizeof(layout) <= sizeof(list.layout) && std::is_trivially_copyable_v<Layout>);
    std::memcpy(list.layout, &layout, sizeof(layout));
  }
};

/// A field on its way to device memory. It may use the memory of the field that it was made from.
class FieldUpload {
 public:
  virtual ~FieldUpload() = default;
  /// `half`: whether objects are asked in half precision where the encoding knows of that.
  virtual ObjectPlan plan(bool half) const = 0;
  /// Adds the field and all that it points to. Returns where the field will be.
  virtual const void* add_to(Arena& arena) const = 0;
};

}  // namespace nif::kernels::gpu
