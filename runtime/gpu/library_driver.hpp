// The code that the drivers of NVIDIA and AMD share. Their libraries are loaded on demand: nothing of theirs
// is included or linked.
//
// CUDA's driver interface and HIP have the same calls under other names, and the same numbers for errors. So
// one class makes those calls, by a table of their names. What differs (contexts, and properties of GPUs and
// pointers) is in cuda_driver.cpp and hip_driver.cpp.
#pragma once

#include <string>

#include "driver.hpp"

namespace nif::gpu {

/// The numbers that CUresult and hipError_t share.
enum Result : int {
  kSuccess = 0,
  kInvalidValue = 1,
  kOutOfMemory = 2,
  kNoDevice = 100,
  kInvalidDevice = 101,
  kNoBinary = 209,
  kUnsupportedPtx = 222,
  kInvalidHandle = 400,
  kNotReady = 600,
};

/// Flags of streams and events; both drivers have the same.
constexpr unsigned kNonBlocking = 1, kNoTiming = 2;

/// The functions that both drivers have. All return a Result.
struct SharedCalls {
  int (*load_module)(void** module, const void* image);
  int (*unload_module)(void* module);
  int (*get_function)(void** function, void* module, const char* name);
  int (*launch)(void* function, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned shared,
                void* stream, void** arguments, void** extra);
  int (*allocate)(void** memory, size_t bytes);
  int (*free)(void* memory);
  int (*allocate_host)(void** memory, size_t bytes, unsigned flags);
  int (*free_host)(void* memory);
  int (*copy_in)(void* to, const void* from, size_t bytes, void* stream);
  int (*copy_out)(void* to, const void* from, size_t bytes, void* stream);
  int (*clear)(uint64_t memory, unsigned char value, size_t bytes, void* stream);
  int (*make_stream)(void** stream, unsigned flags);
  int (*free_stream)(void* stream);
  int (*wait_stream)(void* stream);
  int (*hold_back)(void* stream, void* event, unsigned flags);
  int (*make_event)(void** event, unsigned flags);
  int (*free_event)(void* event);
  int (*record)(void* event, void* stream);
  int (*query_event)(void* event);
  int (*wait_event)(void* event);
  int (*elapsed)(float* milliseconds, void* from, void* to);
};

/// A driver's shared library; it is never unloaded.
class Library {
 public:
  /// Loads the first of the names that it can, or none.
  explicit Library(std::initializer_list<const char*> names);
  explicit operator bool() const { return handle_ != nullptr; }
  const std::string& name() const { return name_; }

  /// Returns null if the library has no such function.
  void* find(const char* name) const;
  template <class Function>
  void find(Function& function, const char* name) const {
    function = reinterpret_cast<Function>(find(name));
  }
  /// Likewise, and remembers the first missing name.
  template <class Function>
  void get(Function& function, const char* name) {
    find(function, name);
    if (!function && missing_.empty()) missing_ = name;
  }
  /// The first function that get() did not find; "" if it found all.
  const std::string& missing() const { return missing_; }

 private:
  void* handle_ = nullptr;
  std::string name_, missing_;
};

/// Calls that identify a GPU, which both drivers have; null in versions that lack them.
struct PlaceCalls {
  int (*pci_bus_id)(char* text, int length, int device) = nullptr;
  int (*uuid)(void* bytes, int device) = nullptr;
  int (*luid)(void* bytes, unsigned* node_mask, int device) = nullptr;

  runtime::GpuLocation ask(int device) const;
};

/// A GPU of either vendor.
class LibraryContext : public Context {
 public:
  Kernel find_kernel(const char* name) override;
  void launch(Kernel kernel, const LaunchShape& shape, Stream stream, void** arguments) override;
  void* allocate(size_t bytes) override;
  void free(void* memory) noexcept override { calls_.free(memory); }
  void* allocate_host(size_t bytes) override;
  void free_host(void* memory) noexcept override { calls_.free_host(memory); }
  void copy_in(void* to, const void* from, size_t bytes, Stream stream) override;
  void copy_out(void* to, const void* from, size_t bytes, Stream stream) override;
  void clear(void* memory, size_t bytes, Stream stream) override;
  Stream make_stream() override;
  void free_stream(Stream stream) noexcept override { calls_.free_stream(stream); }
  void wait_stream(Stream stream) override;
  void hold_back(Stream stream, Event event) override;
  Event make_event(bool timed) override;
  void free_event(Event event) noexcept override { calls_.free_event(event); }
  void record(Event event, Stream stream) override;
  bool is_done(Event event) override;
  void wait(Event event) override;
  double seconds_between(Event from, Event to) override;

 protected:
  explicit LibraryContext(const SharedCalls& calls) : calls_(calls) {}
  /// Throws GpuError unless the result is success.
  void check(int result, const char* doing) const;
  virtual std::string text_of(int result) const = 0;
  /// Returns the Result. The context must be entered.
  int load_image(const void* image);
  void unload_image() noexcept;

 private:
  const SharedCalls& calls_;
  void* module_ = nullptr;
};

/// Returns null and sets `why_not` if the library is missing or too old, or has no GPU.
std::unique_ptr<Driver> find_cuda(std::string& why_not);
std::unique_ptr<Driver> find_hip(std::string& why_not);

}  // namespace nif::gpu
