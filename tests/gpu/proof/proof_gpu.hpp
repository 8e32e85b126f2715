// Memory and a stream of a GPU, from its driver itself: what a program has that asks about device memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace nif::test {

/// One GPU, which the calling thread works on from now on. All calls throw std::runtime_error.
class Gpu {
 public:
  /// The GPU that nif.h numbers so. `module`: the GPU module with emulated GPUs, or empty.
  static std::unique_ptr<Gpu> open(uint32_t device, const std::string& module);
  virtual ~Gpu() = default;

  virtual void* allocate(size_t bytes) = 0;
  virtual void free(void* memory) noexcept = 0;
  /// In the order of the stream; both wait until it has come so far.
  virtual void copy_in(void* to, const void* from, size_t bytes) = 0;
  virtual void copy_out(void* to, const void* from, size_t bytes) = 0;

  virtual void* stream() const = 0;
  virtual void wait() = 0;
};

/// Arrays of the GPU that belong together. Each is filled with bytes of 0xa5, so that what is not written
/// shows, and lies at an odd address, unless it has contents.
class GpuArrays {
 public:
  explicit GpuArrays(Gpu& gpu) : gpu_(gpu) {}
  ~GpuArrays() {
    for (void* memory : all_) gpu_.free(memory);
  }
  GpuArrays(const GpuArrays&) = delete;
  GpuArrays& operator=(const GpuArrays&) = delete;

  /// A copy, aligned as memory of the driver is.
  template <class T>
  T* copy(const std::vector<T>& from) {
    auto* memory = static_cast<T*>(allocate(from.size() * sizeof(T)));
    gpu_.copy_in(memory, from.data(), from.size() * sizeof(T));
    return memory;
  }
  /// An output for what `host` is to hold, and `host` made as long.
  template <class T>
  T* output(std::vector<T>& host, size_t count) {
    host.assign(count, T());
    const std::vector<std::byte> untouched(count * sizeof(T), std::byte(0xa5));
    auto* memory = static_cast<char*>(allocate(untouched.size() + 1)) + 1;
    gpu_.copy_in(memory, untouched.data(), untouched.size());
    return reinterpret_cast<T*>(memory);
  }
  /// After the stream has passed it.
  template <class T>
  void fetch(std::vector<T>& host, const T* output) {
    gpu_.copy_out(host.data(), output, host.size() * sizeof(T));
  }

 private:
  void* allocate(size_t bytes) {
    all_.push_back(gpu_.allocate(bytes));
    return all_.back();
  }

  Gpu& gpu_;
  std::vector<void*> all_;
};

}  // namespace nif::test
