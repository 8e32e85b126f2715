// Drives NVIDIA GPUs through libcuda.so.1, which comes with the driver.
#include <algorithm>

#include "images.hpp"
#include "library_driver.hpp"

namespace nif::gpu {
namespace {

// From cuda.h; these numbers never change.
constexpr int kProcessorsAttribute = 16, kMajorAttribute = 75, kMinorAttribute = 76;
constexpr int kPointerMemoryType = 2, kPointerIsManaged = 8, kPointerDevice = 9;
constexpr unsigned kHostMemory = 1;

struct CudaCalls : SharedCalls {
  PlaceCalls place;
  int (*init)(unsigned flags);
  int (*driver_version)(int* version);
  int (*device_count)(int* count);
  int (*device_get)(int* device, int ordinal);
  int (*device_name)(char* name, int length, int device);
  int (*device_memory)(size_t* bytes, int device);
  int (*device_attribute)(int* value, int attribute, int device);
  int (*retain_context)(void** context, int device);
  int (*release_context)(int device);
  int (*push_context)(void* context);
  int (*pop_context)(void** context);
  int (*pointer_attribute)(void* value, int attribute, uint64_t pointer);
  int (*stream_context)(void* stream, void** context);
  int (*error_string)(int result, const char** text);

  explicit CudaCalls(Library& library) {
    library.get(load_module, "cuModuleLoadData");
    library.get(unload_module, "cuModuleUnload");
    library.get(get_function, "cuModuleGetFunction");
    library.get(launch, "cuLaunchKernel");
    library.get(allocate, "cuMemAlloc_v2");
    library.get(free, "cuMemFree_v2");
    library.get(allocate_host, "cuMemHostAlloc");
    library.get(free_host, "cuMemFreeHost");
    library.get(copy_in, "cuMemcpyHtoDAsync_v2");
    library.get(copy_out, "cuMemcpyDtoHAsync_v2");
    library.get(clear, "cuMemsetD8Async");
    library.get(make_stream, "cuStreamCreate");
    library.get(free_stream, "cuStreamDestroy_v2");
    library.get(wait_stream, "cuStreamSynchronize");
    library.get(hold_back, "cuStreamWaitEvent");
    library.get(make_event, "cuEventCreate");
    library.get(free_event, "cuEventDestroy_v2");
    library.get(record, "cuEventRecord");
    library.get(query_event, "cuEventQuery");
    library.get(wait_event, "cuEventSynchronize");
    library.get(elapsed, "cuEventElapsedTime");
    library.find(place.pci_bus_id, "cuDeviceGetPCIBusId");
    library.find(place.uuid, "cuDeviceGetUuid_v2");
    if (!place.uuid) library.find(place.uuid, "cuDeviceGetUuid");
    library.find(place.luid, "cuDeviceGetLuid");
    library.get(init, "cuInit");
    library.get(driver_version, "cuDriverGetVersion");
    library.get(device_count, "cuDeviceGetCount");
    library.get(device_get, "cuDeviceGet");
    library.get(device_name, "cuDeviceGetName");
    library.get(device_memory, "cuDeviceTotalMem_v2");
    library.get(device_attribute, "cuDeviceGetAttribute");
    library.get(retain_context, "cuDevicePrimaryCtxRetain");
    library.get(release_context, "cuDevicePrimaryCtxRelease_v2");
    library.get(push_context, "cuCtxPushCurrent_v2");
    library.get(pop_context, "cuCtxPopCurrent_v2");
    library.get(pointer_attribute, "cuPointerGetAttribute");
    library.get(stream_context, "cuStreamGetCtx");
    library.get(error_string, "cuGetErrorString");
  }

  std::string text_of(int result) const {
    const char* text = nullptr;
    if (error_string(result, &text) != kSuccess || text == nullptr) text = "unknown error";
    return std::string(text) + " (CUDA " + std::to_string(result) + ")";
  }
};

/// Returns the best code for a GPU: compiled for it, else for an older GPU of its generation, else PTX,
/// which the driver compiles. Null if none fits.
const Image* image_for(int major, int minor) {
  const Image* best = nullptr;
  int best_minor = -1;
  for (const Image& image : all_images()) {
    int number = 0;
    if (image.target.starts_with("sm_"))
      number = std::stoi(std::string(image.target.substr(3)));
    else if (image.target.starts_with("compute_"))
      number = std::stoi(std::string(image.target.substr(8)));
    else
      continue;
    const bool binary = image.target.starts_with("sm_");
    if (binary && number / 10 == major && number % 10 <= minor && number % 10 > best_minor)
      best = &image, best_minor = number % 10;
    if (!binary && best_minor < 0 && number <= 10 * major + minor) best = &image;
  }
  return best;
}

class CudaContext final : public LibraryContext {
 public:
  CudaContext(const CudaCalls& calls, int ordinal, int device, const Image& image)
      : LibraryContext(calls), calls_(calls), ordinal_(ordinal), device_(device) {
    check(calls_.retain_context(&context_, device), "starting to use the GPU");
    try {
      const Current current(*this);
      const int result = load_image(image.data);
      if (result == kUnsupportedPtx)
        throw GpuError(NIF_ERROR_NOT_AVAILABLE,
                       "the NVIDIA driver is too old for these kernels: " + text_of(result));
      if (result == kNoBinary)
        throw GpuError(NIF_ERROR_NOT_AVAILABLE,
                       "the GPU module has no kernels for this GPU: " + text_of(result));
      check(result, "loading kernels");
    } catch (...) {
      calls_.release_context(device_);
      throw;
    }
  }
  ~CudaContext() override {
    where_possible(*this, [&] { unload_image(); });
    calls_.release_context(device_);
  }

  void enter() override { check(calls_.push_context(context_), "turning to the GPU"); }
  void leave() noexcept override {
    void* ignored;
    calls_.pop_context(&ignored);
  }

  uint32_t processors() const override {
    int count = 0;
    calls_.device_attribute(&count, kProcessorsAttribute, device_);
    return uint32_t(std::max(count, 1));
  }

  bool owns(Stream stream) override {
    void* context = nullptr;
    return calls_.stream_context(stream, &context) == kSuccess && context == context_;
  }

  PointerKind kind_of(const void* pointer) override {
    const auto address = reinterpret_cast<uint64_t>(pointer);
    unsigned type = 0;
    if (calls_.pointer_attribute(&type, kPointerMemoryType, address) != kSuccess) return PointerKind::host;
    unsigned managed = 0;
    calls_.pointer_attribute(&managed, kPointerIsManaged, address);
    if (managed || type == kHostMemory) return PointerKind::both;
    int ordinal = ordinal_;
    calls_.pointer_attribute(&ordinal, kPointerDevice, address);
    return ordinal == ordinal_ ? PointerKind::device : PointerKind::other_device;
  }

 private:
  std::string text_of(int result) const override { return calls_.text_of(result); }

  const CudaCalls& calls_;
  int ordinal_, device_;
  void* context_ = nullptr;
};

class CudaDriver final : public Driver {
 public:
  CudaDriver(const CudaCalls& calls, uint32_t count, int version)
      : calls_(calls), count_(count), version_(version) {}

  const char* backend() const override { return "cuda"; }
  uint32_t count() override { return count_; }

  GpuProperties describe(uint32_t gpu) override {
    const int device = device_of(gpu);
    GpuProperties about;
    char name[256] = "";
    size_t bytes = 0;
    calls_.device_name(name, sizeof(name), device);
    calls_.device_memory(&bytes, device);
    about.name = name;
    about.memory = bytes;
    const auto [major, minor] = capability(device);
    about.target = "sm_" + std::to_string(10 * major + minor);
    about.driver = "CUDA " + std::to_string(version_ / 1000) + "." + std::to_string(version_ % 1000 / 10);
    about.place = calls_.place.ask(device);
    return about;
  }

  std::string trouble(uint32_t gpu) override {
    const auto [major, minor] = capability(device_of(gpu));
    if (image_for(major, minor)) return "";
    return "the GPU module has no kernels for sm_" + std::to_string(10 * major + minor) + "; it has" +
           std::string(image_names());
  }

  std::unique_ptr<Context> open(uint32_t gpu) override {
    const int device = device_of(gpu);
    const auto [major, minor] = capability(device);
    return std::make_unique<CudaContext>(calls_, int(gpu), device, *image_for(major, minor));
  }

 private:
  int device_of(uint32_t gpu) const {
    int device = 0;
    calls_.device_get(&device, int(gpu));
    return device;
  }
  std::pair<int, int> capability(int device) const {
    int major = 0, minor = 0;
    calls_.device_attribute(&major, kMajorAttribute, device);
    calls_.device_attribute(&minor, kMinorAttribute, device);
    return {major, minor};
  }

  const CudaCalls& calls_;
  uint32_t count_;
  int version_;
};

}  // namespace

std::unique_ptr<Driver> find_cuda(std::string& why_not) {
  static Library library({"libcuda.so.1"});
  if (!library) {
    why_not = "there is no NVIDIA driver (libcuda.so.1)";
    return nullptr;
  }
  static const CudaCalls calls(library);
  if (!library.missing().empty()) {
    why_not = "the NVIDIA driver is too old: it has no " + library.missing();
    return nullptr;
  }
  int version = 0, count = 0;
  int result = calls.init(0);
  if (result == kSuccess) result = calls.driver_version(&version);
  if (result == kSuccess) result = calls.device_count(&count);
  if (result == kNoDevice || (result == kSuccess && count == 0)) {
    why_not = "the NVIDIA driver finds no GPU";
    return nullptr;
  }
  if (result != kSuccess) {
    why_not = "the NVIDIA driver does not start: " + calls.text_of(result);
    return nullptr;
  }
#ifdef NIF_CUDA_MAJOR
  // Drivers do not run code of a newer major version of CUDA.
  if (version / 1000 < NIF_CUDA_MAJOR) {
    why_not = "the NVIDIA driver is too old: it is for CUDA " + std::to_string(version / 1000) +
              ", and the GPU module's kernels are of CUDA " + std::to_string(NIF_CUDA_MAJOR);
    return nullptr;
  }
#endif
  return std::make_unique<CudaDriver>(calls, uint32_t(count), version);
}

}  // namespace nif::gpu
