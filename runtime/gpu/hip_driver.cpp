// Drives AMD GPUs through libamdhip64.so, of ROCm 5, 6 or 7.
#include <algorithm>
#include <cstring>

#include "images.hpp"
#include "library_driver.hpp"

namespace nif::gpu {
namespace {

struct HipCalls : SharedCalls {
  PlaceCalls place;
  int (*init)(unsigned flags);
  int (*driver_version)(int* version);
  int (*device_count)(int* count);
  int (*device_name)(char* name, int length, int device);
  int (*device_memory)(size_t* bytes, int device);
  int (*device_properties)(void* properties, int device);
  int (*device_attribute)(int* value, int attribute, int device);
  int (*get_device)(int* device);
  int (*set_device)(int device);
  int (*pointer_attributes)(void* attributes, const void* pointer);
  int (*stream_device)(void* stream, int* device);  ///< null in older versions
  const char* (*error_string)(int result);

  explicit HipCalls(Library& library) {
    library.get(load_module, "hipModuleLoadData");
    library.get(unload_module, "hipModuleUnload");
    library.get(get_function, "hipModuleGetFunction");
    library.get(launch, "hipModuleLaunchKernel");
    library.get(allocate, "hipMalloc");
    library.get(free, "hipFree");
    library.get(allocate_host, "hipHostMalloc");
    library.get(free_host, "hipHostFree");
    library.get(copy_in, "hipMemcpyHtoDAsync");
    library.get(copy_out, "hipMemcpyDtoHAsync");
    library.get(clear, "hipMemsetD8Async");
    library.get(make_stream, "hipStreamCreateWithFlags");
    library.get(free_stream, "hipStreamDestroy");
    library.get(wait_stream, "hipStreamSynchronize");
    library.get(hold_back, "hipStreamWaitEvent");
    library.get(make_event, "hipEventCreateWithFlags");
    library.get(free_event, "hipEventDestroy");
    library.get(record, "hipEventRecord");
    library.get(query_event, "hipEventQuery");
    library.get(wait_event, "hipEventSynchronize");
    library.get(elapsed, "hipEventElapsedTime");
    library.find(place.pci_bus_id, "hipDeviceGetPCIBusId");
    library.find(place.uuid, "hipDeviceGetUuid");
    library.get(init, "hipInit");
    library.get(driver_version, "hipRuntimeGetVersion");
    library.get(device_count, "hipGetDeviceCount");
    library.get(device_name, "hipDeviceGetName");
    library.get(device_memory, "hipDeviceTotalMem");
    library.get(device_attribute, "hipDeviceGetAttribute");
    library.get(get_device, "hipGetDevice");
    library.get(set_device, "hipSetDevice");
    library.get(pointer_attributes, "hipPointerGetAttributes");
    library.get(error_string, "hipGetErrorString");
    const bool newer = library.find("hipGetDevicePropertiesR0600") != nullptr;
    library.get(device_properties, newer ? "hipGetDevicePropertiesR0600" : "hipGetDeviceProperties");
    stream_device = reinterpret_cast<int (*)(void*, int*)>(library.find("hipStreamGetDevice"));
  }

  std::string text_of(int result) const {
    const char* text = error_string(result);
    return std::string(text ? text : "unknown error") + " (HIP " + std::to_string(result) + ")";
  }
};

/// The first members of hipPointerAttribute_t, the same in all versions. A `kind` of 0 means host memory
/// before ROCm 6, and memory unknown to HIP since then.
struct PointerAttributes {
  int kind, device;
  void *device_pointer, *host_pointer;
  int managed;
  unsigned flags;
  char room[64];
};

const Image* image_for(std::string_view target) {
  for (const Image& image : all_images())
    if (image.target == target) return &image;
  return nullptr;
}

class HipContext final : public LibraryContext {
 public:
  HipContext(const HipCalls& calls, int device, int version, const Image& image)
      : LibraryContext(calls), calls_(calls), device_(device), version_(version) {
    const Current current(*this);
    const int result = load_image(image.data);
    if (result == kNoBinary)
      throw GpuError(NIF_ERROR_NOT_AVAILABLE,
                     "the GPU module has no kernels for this GPU: " + text_of(result));
    check(result, "loading kernels");
  }
  ~HipContext() override {
    where_possible(*this, [&] { unload_image(); });
  }

  void enter() override {
    int before = device_;
    check(calls_.get_device(&before), "turning to the GPU");
    check(calls_.set_device(device_), "turning to the GPU");
    before_ = before;
  }
  void leave() noexcept override { calls_.set_device(before_); }

  uint32_t processors() const override {
    // From hip_runtime_api.h, since ROCm 5. An implausible value means that the number stands for another
    // attribute.
    constexpr int kProcessorsAttribute = 63, kMostProcessors = 1024;
    int count = 0;
    if (calls_.device_attribute(&count, kProcessorsAttribute, device_) != kSuccess || count < 1 ||
        count > kMostProcessors)
      count = 64;
    return uint32_t(count);
  }

  bool owns(Stream stream) override {
    int device = device_;
    if (calls_.stream_device) return calls_.stream_device(stream, &device) == kSuccess && device == device_;
    // Older versions lack the call, but refuse an event of this GPU in a stream of another.
    void* event = nullptr;
    if (calls_.make_event(&event, kNoTiming) != kSuccess) return true;
    const bool taken = calls_.record(event, stream) == kSuccess;
    calls_.free_event(event);
    return taken;
  }

  PointerKind kind_of(const void* pointer) override {
    PointerAttributes attributes{};
    if (calls_.pointer_attributes(&attributes, pointer) != kSuccess) return PointerKind::host;
    const bool newer = version_ >= 60'000'000;
    const int host = newer ? 1 : 0, device = newer ? 2 : 1;
    if (attributes.managed || attributes.kind == host) return PointerKind::both;
    if (attributes.kind != device)
      return newer && attributes.kind == 0 ? PointerKind::host : PointerKind::both;
    return attributes.device == device_ ? PointerKind::device : PointerKind::other_device;
  }

 private:
  std::string text_of(int result) const override { return calls_.text_of(result); }

  const HipCalls& calls_;
  int device_, version_;
  static thread_local int before_;  ///< one is enough, because Current is not nested
};
thread_local int HipContext::before_ = 0;

class HipDriver final : public Driver {
 public:
  HipDriver(const HipCalls& calls, uint32_t count, int version)
      : calls_(calls), count_(count), version_(version) {}

  const char* backend() const override { return "hip"; }
  uint32_t count() override { return count_; }

  GpuProperties describe(uint32_t gpu) override {
    GpuProperties about;
    char name[256] = "";
    size_t bytes = 0;
    calls_.device_name(name, sizeof(name), int(gpu));
    calls_.device_memory(&bytes, int(gpu));
    about.name = name;
    about.memory = bytes;
    about.target = target_of(gpu);
    about.driver =
        "HIP " + std::to_string(version_ / 10'000'000) + "." + std::to_string(version_ / 100'000 % 100);
    about.place = calls_.place.ask(int(gpu));
    return about;
  }

  std::string trouble(uint32_t gpu) override {
    const std::string target = target_of(gpu);
    if (image_for(target)) return "";
    return "the GPU module has no kernels for " + (target.empty() ? "this GPU" : target) + "; it has" +
           std::string(image_names());
  }

  std::unique_ptr<Context> open(uint32_t gpu) override {
    return std::make_unique<HipContext>(calls_, int(gpu), version_, *image_for(target_of(gpu)));
  }

 private:
  /// The layout of the properties differs between versions, so this searches for the target: it is the only
  /// text that starts with "gfx". Features follow after a colon.
  std::string target_of(uint32_t gpu) const {
    static constexpr size_t kRoom = 16 * 1024;
    const auto properties = std::make_unique<char[]>(kRoom);
    std::memset(properties.get(), 0, kRoom);
    if (calls_.device_properties(properties.get(), int(gpu)) != kSuccess) return "";
    const std::string_view all(properties.get(), kRoom);
    const size_t at = all.find("gfx");
    if (at == std::string_view::npos) return "";
    const std::string_view rest = all.substr(at);
    return std::string(rest.substr(0, rest.find_first_of(std::string_view(":\0", 2))));
  }

  const HipCalls& calls_;
  uint32_t count_;
  int version_;
};

}  // namespace

std::unique_ptr<Driver> find_hip(std::string& why_not) {
  static Library library({"libamdhip64.so.7", "libamdhip64.so.6", "libamdhip64.so.5", "libamdhip64.so"});
  if (!library) {
    why_not = "there is no HIP of AMD's (libamdhip64.so)";
    return nullptr;
  }
  static const HipCalls calls(library);
  if (!library.missing().empty()) {
    why_not = "AMD's HIP is too old: it has no " + library.missing();
    return nullptr;
  }
  int version = 0, count = 0;
  int result = calls.init(0);
  if (result == kSuccess) result = calls.driver_version(&version);
  if (result == kSuccess) result = calls.device_count(&count);
  if (result == kNoDevice || result == kInvalidDevice || (result == kSuccess && count == 0)) {
    why_not = "AMD's HIP finds no GPU";
    return nullptr;
  }
  if (result != kSuccess) {
    why_not = "AMD's HIP does not start: " + calls.text_of(result);
    return nullptr;
  }
  return std::make_unique<HipDriver>(calls, uint32_t(count), version);
}

}  // namespace nif::gpu
