// How objects get to device memory, on the host: their layout there, and what the GPU module must know about
// each. Every encoding has a source file for it in kernels/gpu/encodings.
#pragma once

#include <cstring>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernels/gpu/kernel_list.hpp"

namespace nif::kernels::gpu {

/// An arena that will lie at `base` in device memory. It is built twice: first to learn its size, then with
/// valid pointers.
class Arena {
 public:
  explicit Arena(const unsigned char* base) : base_(reinterpret_cast<uintptr_t>(base)) {}

  /// Adds an array and sets the pointer to its future address. Data that several objects share is added once.
  template <class T>
  void move(const T*& array, size_t count) {
    array = static_cast<const T*>(add(array, count * sizeof(T)));
  }
  const void* add(const void* from, size_t bytes) {
    const auto [known, is_new] = placed_.try_emplace({from, bytes}, bytes_.size());
    if (is_new && bytes > 0) append(from, bytes);
    return reinterpret_cast<const void*>(base_ + known->second);
  }
  /// Adds a structure; its address may be that of an earlier one that no longer exists.
  template <class T>
  const T* add_structure(const T& value) {
    return add_structures(&value, 1);
  }
  /// The same for an array of structures.
  template <class T>
  const T* add_structures(const T* values, size_t count) {
    const size_t at = bytes_.size();
    if (count > 0) append(values, count * sizeof(T));
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

/// What kernels need for an object, and which of them answer its items.
struct ObjectPlan {
  SceneObject object{};               ///< without its field, lists, scales and number
  uint32_t row_words = 0;             ///< of shared memory, for a thread that answers its ray alone
  uint32_t traversal_words = 0;       ///< and for a thread of the pipeline's traversal
  Stage stages[2]{kStages, kStages};  ///< for both sorts of items; kStages: none
  uint32_t stage_bytes = 0;           ///< of shared memory, for a block of either stage except kAlone
  PipelineList list{};                ///< template of its lists, without the field

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
  /// `half`: whether objects use half precision, if the encoding supports it.
  virtual ObjectPlan plan(bool half) const = 0;
  /// Adds the field and all that it points to. Returns the field's future address.
  virtual const void* add_to(Arena& arena) const = 0;
};

}  // namespace nif::kernels::gpu
