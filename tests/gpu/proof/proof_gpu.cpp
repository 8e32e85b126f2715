// The driver is loaded at run time and its calls are looked up by name, so no SDK is needed to build. A
// second kind of GPU is emulated, in memory of the host, for tests without a GPU.
#include "proof_gpu.hpp"

#include <dlfcn.h>

#include <cstring>
#include <nif/nif.hpp>
#include <stdexcept>

#include "tests/gpu/emulator/machine.hpp"

namespace nif::test {
namespace {

/// By libcuda or libamdhip64, whose calls differ in their names.
class DriverGpu final : public Gpu {
 public:
  DriverGpu(uint32_t device, bool cuda) {
    const char* names[] = {"libcuda.so.1", "libamdhip64.so.7", "libamdhip64.so.6", "libamdhip64.so.5",
                           "libamdhip64.so"};
    for (size_t i = cuda ? 0 : 1; !library_ && i < (cuda ? 1 : std::size(names)); ++i)
      library_ = dlopen(names[i], RTLD_NOW | RTLD_LOCAL);
    if (cuda) {
      call<int(unsigned)>("cuInit", 0u);
      int handle = 0;
      call<int(int*, int)>("cuDeviceGet", &handle, int(device));
      void* context = nullptr;
      call<int(void**, int)>("cuDevicePrimaryCtxRetain", &context, handle);
      call<int(void*)>("cuCtxPushCurrent_v2", context);
    } else {
      call<int(int)>("hipSetDevice", int(device));
    }
    get(allocate_, cuda ? "cuMemAlloc_v2" : "hipMalloc");
    get(free_, cuda ? "cuMemFree_v2" : "hipFree");
    get(copy_in_, cuda ? "cuMemcpyHtoDAsync_v2" : "hipMemcpyHtoDAsync");
    get(copy_out_, cuda ? "cuMemcpyDtoHAsync_v2" : "hipMemcpyDtoHAsync");
    get(wait_, cuda ? "cuStreamSynchronize" : "hipStreamSynchronize");
    constexpr unsigned kNonBlocking = 1;
    call<int(void**, unsigned)>(cuda ? "cuStreamCreate" : "hipStreamCreateWithFlags", &stream_, kNonBlocking);
  }

  void* allocate(size_t bytes) override {
    void* memory = nullptr;
    check(allocate_(&memory, bytes), "taking memory");
    return memory;
  }
  void free(void* memory) noexcept override { free_(memory); }
  void copy_in(void* to, const void* from, size_t bytes) override {
    check(copy_in_(to, from, bytes, stream_), "copying to the GPU");
    wait();
  }
  void copy_out(void* to, const void* from, size_t bytes) override {
    check(copy_out_(to, from, bytes, stream_), "copying from the GPU");
    wait();
  }
  void* stream() const override { return stream_; }
  void wait() override { check(wait_(stream_), "waiting for a stream"); }

 private:
  static void check(int result, const char* doing) {
    if (result != 0)
      throw std::runtime_error(std::string("the driver fails at ") + doing + ": " + std::to_string(result));
  }
  template <class Function>
  void get(Function*& function, const char* name) const {
    function = library_ ? reinterpret_cast<Function*>(dlsym(library_, name)) : nullptr;
    if (!function) throw std::runtime_error(std::string("the driver has no ") + name);
  }
  template <class Function, class... Arguments>
  void call(const char* name, Arguments... arguments) const {
    Function* function;
    get(function, name);
    check(function(arguments...), name);
  }

  void* library_ = nullptr;
  void* stream_ = nullptr;
  int (*allocate_)(void**, size_t);
  int (*free_)(void*);
  int (*copy_in_)(void*, const void*, size_t, void*);
  int (*copy_out_)(void*, const void*, size_t, void*);
  int (*wait_)(void*);
};

/// Whose memory is the host's.
class EmulatedGpu final : public Gpu {
 public:
  EmulatedGpu(uint32_t device, const std::string& module)
      : machine_(emulated_machine(module)), device_(device), stream_(machine_.make_stream(device)) {}
  ~EmulatedGpu() override { machine_.free_stream(stream_); }

  void* allocate(size_t bytes) override { return machine_.allocate(device_, bytes); }
  void free(void* memory) noexcept override { machine_.free(memory); }
  void copy_in(void* to, const void* from, size_t bytes) override { std::memcpy(to, from, bytes); }
  void copy_out(void* to, const void* from, size_t bytes) override { std::memcpy(to, from, bytes); }
  void* stream() const override { return stream_; }
  void wait() override { machine_.wait_stream(stream_); }

 private:
  EmulatedMachine& machine_;
  uint32_t device_;
  void* stream_;
};

}  // namespace

std::unique_ptr<Gpu> Gpu::open(uint32_t device, const std::string& module) {
  if (!module.empty()) return std::make_unique<EmulatedGpu>(device, module);
  // nif.h numbers NVIDIA's GPUs first, then AMD's; each driver numbers its own.
  uint32_t nvidias = 0;
  for (uint32_t number = 0;; ++number) {
    auto info = nifkit::sized<NifGpuInfo>();
    nifkit::check(nifGetGpuInfo(number, &info));
    const bool nvidia = std::string_view(info.target).starts_with("sm_");
    if (number == device) return std::make_unique<DriverGpu>(nvidia ? number : number - nvidias, nvidia);
    nvidias += nvidia;
  }
}

}  // namespace nif::test
