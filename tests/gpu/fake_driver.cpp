// A fake libcuda.so.1 or, with FAKE_HIP, libamdhip64.so.7, for tests: the calls that the GPU module makes, as
// the libraries' headers declare them. The emulator runs the kernels, immediately. So tests run the installed
// module from end to end: which code it picks, and which calls of the driver it makes. Calls that the real
// libraries would refuse (without a context, or with memory that is not the GPU's) fail, or end the process.
//
// FAKE_VERSION: the version that the driver reports. FAKE_TARGET: the GPU's target, e.g. "sm_90" or
// "gfx90a"; there is a GPU only in the library for that target. FAKE_WANTS: "elf" or "ptx", the form of code
// that must be loaded.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>

#include "runtime/src/query/outputs.hpp"
#include "tests/gpu/emulator/kernels.hpp"

#ifdef FAKE_HIP
#define NIF_NAME(cuda, hip) hip
#else
#define NIF_NAME(cuda, hip) cuda
#endif
#define NIF_FAKE extern "C" __attribute__((visibility("default")))

namespace {

namespace gpu = nif::kernels::gpu;

constexpr int kOk = 0, kInvalidValue = 1, kOutOfMemory = 2, kNoDevice = 100, kInvalidContext = 201,
              kNoBinary = 209, kNotFound = 500, kNotSupported = 801;

std::string setting(const char* variable, const char* otherwise) {
  const char* text = std::getenv(variable);
  return text ? text : otherwise;
}
std::string target() { return setting("FAKE_TARGET", "none"); }
bool has_gpu() { return target().starts_with(NIF_NAME("sm_", "gfx")); }
int version() { return std::stoi(setting("FAKE_VERSION", NIF_NAME("13000", "60342131"))); }

std::mutex mutex;
std::map<char*, size_t> memory;
int the_stream;

/// Is the GPU current for the calling thread?
bool is_current();

bool is_of_gpu(const void* at, size_t bytes = 1) {
  const std::lock_guard lock(mutex);
  const auto* address = static_cast<const char*>(at);
  auto piece = memory.upper_bound(const_cast<char*>(address));
  if (piece == memory.begin()) return false;
  --piece;
  return address + bytes <= piece->first + piece->second;
}
bool is_stream(const void* stream) { return stream == nullptr || stream == &the_stream; }

void check_arrays(const gpu::SceneArrays& scene, const gpu::SceneQuery& query) {
  const auto check = [](const void* array) {
    if (array && !is_of_gpu(array)) std::abort();
  };
  for (const void* array : {static_cast<const void*>(scene.nodes), static_cast<const void*>(scene.instances),
                            static_cast<const void*>(scene.users), static_cast<const void*>(scene.objects)})
    check(array);
  for (int a = 0; a < 3; ++a) check(query.origin[a]), check(query.direction[a]);
  check(query.tmin);
  check(query.tmax);
  check(query.mask);
  nif::runtime::visit_outputs([&](const auto&, const auto* array) { check(array); }, query);
}

/// Of the GPU's matrix instructions.
nif::test::MatrixKind matrix_kind() {
  using nif::test::MatrixKind;
  return target() == "gfx90a"    ? MatrixKind::mfma16
         : target() == "gfx942"  ? MatrixKind::mfma32
         : target() == "gfx1100" ? MatrixKind::wmma
                                 : NIF_NAME(MatrixKind::imma, MatrixKind::dot32);
}

struct FakeEvent {
  std::chrono::steady_clock::time_point time;
};

}  // namespace

// ---- The GPU, and whose turn it is ---------------------------------------------------------------------

NIF_FAKE int NIF_NAME(cuInit, hipInit)(unsigned flags) { return flags == 0 ? kOk : kInvalidValue; }
NIF_FAKE int NIF_NAME(cuDriverGetVersion, hipRuntimeGetVersion)(int* number) {
  return *number = version(), kOk;
}

#ifdef FAKE_HIP

// Two GPUs; at first the second one is current for each thread.
namespace {
thread_local int current = 1;
bool is_current() { return current == 0; }
}  // namespace

NIF_FAKE int hipGetDeviceCount(int* count) { return *count = has_gpu() ? 2 : 0, has_gpu() ? kOk : kNoDevice; }
NIF_FAKE int hipDeviceGetName(char* name, int length, int device) {
  return device < 2 ? (std::snprintf(name, size_t(length), "fake GPU"), kOk) : kNoDevice;
}
NIF_FAKE int hipDeviceGetPCIBusId(char* text, int length, int device) {
  return device < 2 ? (std::snprintf(text, size_t(length), "0001:a%d:1f.0", device), kOk) : kNoDevice;
}
NIF_FAKE int hipDeviceGetUuid(void* uuid, int device) {
  return device < 2 ? (std::memcpy(uuid, "a fake AMD card", 16), kOk) : kNoDevice;
}
NIF_FAKE int hipDeviceTotalMem(size_t* bytes, int device) {
  return device < 2 ? (*bytes = size_t{1} << 33, kOk) : kNoDevice;
}
NIF_FAKE int hipGetDevicePropertiesR0600(void* properties, int device) {
  if (device >= 2) return kNoDevice;
  std::strcpy(static_cast<char*>(properties), "fake GPU");
  std::strcpy(static_cast<char*>(properties) + 1160, (target() + ":sramecc+:xnack-").c_str());
  return kOk;
}
NIF_FAKE int hipDeviceGetAttribute(int* value, int attribute, int) {
  return attribute == 63 ? (*value = 2, kOk) : kInvalidValue;  // compute units
}
NIF_FAKE int hipGetDevice(int* device) { return *device = current, kOk; }
NIF_FAKE int hipSetDevice(int device) { return device < 2 ? (current = device, kOk) : kNoDevice; }
NIF_FAKE int hipStreamGetDevice(void* stream, int* device) {
  return is_stream(stream) ? (*device = 0, kOk) : kInvalidValue;
}
NIF_FAKE const char* hipGetErrorString(int) { return "fake error"; }

namespace {
struct PointerAttributes {
  int kind, device;
  void *device_pointer, *host_pointer;
  int managed;
  unsigned flags;
};
}  // namespace
/// As since ROCm 6: 0 is memory unknown to HIP, 2 is GPU memory.
NIF_FAKE int hipPointerGetAttributes(PointerAttributes* attributes, const void* pointer) {
  return *attributes = PointerAttributes{is_of_gpu(pointer) ? 2 : 0, 0, nullptr, nullptr, 0, 0}, kOk;
}

#else

namespace {
constexpr int kDevice = 7;  ///< the handle of GPU 0
int the_context;
thread_local int pushed = 0;
bool is_current() { return pushed > 0; }
}  // namespace

NIF_FAKE int cuDeviceGetCount(int* count) { return *count = has_gpu(), kOk; }
NIF_FAKE int cuDeviceGet(int* device, int ordinal) {
  return ordinal == 0 && has_gpu() ? (*device = kDevice, kOk) : kNoDevice;
}
NIF_FAKE int cuDeviceGetName(char* name, int length, int device) {
  return device == kDevice ? (std::snprintf(name, size_t(length), "fake GPU"), kOk) : kNoDevice;
}
NIF_FAKE int cuDeviceGetPCIBusId(char* text, int length, int device) {
  return device == kDevice ? (std::snprintf(text, size_t(length), "10000:C1:00.0"), kOk) : kNoDevice;
}
NIF_FAKE int cuDeviceGetUuid_v2(void* uuid, int device) {
  return device == kDevice ? (std::memcpy(uuid, "fake NVIDIA one", 16), kOk) : kNoDevice;
}
/// Only Windows has LUIDs.
NIF_FAKE int cuDeviceGetLuid(char*, unsigned*, int) { return kNotSupported; }
NIF_FAKE int cuDeviceTotalMem_v2(size_t* bytes, int device) {
  return device == kDevice ? (*bytes = size_t{1} << 33, kOk) : kNoDevice;
}
NIF_FAKE int cuDeviceGetAttribute(int* value, int attribute, int device) {
  if (device != kDevice) return kInvalidValue;
  if (attribute == 16) return *value = 2, kOk;  // multiprocessors
  if (attribute != 75 && attribute != 76) return kInvalidValue;
  const int capability = std::stoi(target().substr(3));
  *value = attribute == 75 ? capability / 10 : capability % 10;
  return kOk;
}
NIF_FAKE int cuGetErrorString(int, const char** text) { return *text = "fake error", kOk; }

NIF_FAKE int cuDevicePrimaryCtxRetain(void** context, int device) {
  return device == kDevice ? (*context = &the_context, kOk) : kNoDevice;
}
NIF_FAKE int cuDevicePrimaryCtxRelease_v2(int device) { return device == kDevice ? kOk : kNoDevice; }
NIF_FAKE int cuCtxPushCurrent_v2(void* context) {
  return context == &the_context ? (++pushed, kOk) : kInvalidContext;
}
NIF_FAKE int cuCtxPopCurrent_v2(void** context) {
  if (pushed == 0) std::abort();
  return --pushed, *context = &the_context, kOk;
}
NIF_FAKE int cuStreamGetCtx(void* stream, void** context) {
  return is_stream(stream) ? (*context = &the_context, kOk) : kInvalidValue;
}
NIF_FAKE int cuPointerGetAttribute(void* value, int attribute, unsigned long long address) {
  if (!is_of_gpu(reinterpret_cast<void*>(address))) return kInvalidValue;
  switch (attribute) {
    case 2:  // CU_POINTER_ATTRIBUTE_MEMORY_TYPE: CU_MEMORYTYPE_DEVICE
      return *static_cast<unsigned*>(value) = 2, kOk;
    case 8:  // CU_POINTER_ATTRIBUTE_IS_MANAGED
      return *static_cast<unsigned*>(value) = 0, kOk;
    case 9:  // CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL
      return *static_cast<int*>(value) = 0, kOk;
    default:
      return kInvalidValue;
  }
}

#endif

// ---- What both libraries have, by their names -----------------------------------------------------------

/// Code is an ELF file for the vendor's machines, or, for NVIDIA's, text.
NIF_FAKE int NIF_NAME(cuModuleLoadData, hipModuleLoadData)(void** module, const void* image) {
  if (!is_current()) return kInvalidContext;
  const auto* bytes = static_cast<const unsigned char*>(image);
  const bool elf = std::memcmp(bytes, "\177ELF", 4) == 0;
  constexpr int kMachine = NIF_NAME(190, 224);
  if (elf && (bytes[18] | bytes[19] << 8) != kMachine) return kNoBinary;
  if (!elf && std::strstr(static_cast<const char*>(image), ".target sm_") == nullptr) return kNoBinary;
  if (setting("FAKE_WANTS", "elf") != (elf ? "elf" : "ptx")) std::abort();
  return *module = const_cast<void*>(image), kOk;
}
NIF_FAKE int NIF_NAME(cuModuleUnload, hipModuleUnload)(void*) { return is_current() ? kOk : kInvalidContext; }
NIF_FAKE int NIF_NAME(cuModuleGetFunction, hipModuleGetFunction)(void** function, void* module,
                                                                 const char* name) {
  if (!is_current() || module == nullptr) return kInvalidContext;
  const nif::test::EmulatedKernel* kernel = nif::test::find_emulated_kernel(name, matrix_kind());
  return kernel ? (*function = const_cast<nif::test::EmulatedKernel*>(kernel), kOk) : kNotFound;
}
NIF_FAKE int NIF_NAME(cuLaunchKernel, hipModuleLaunchKernel)(void* function, unsigned x, unsigned y,
                                                             unsigned z, unsigned threads, unsigned threads_y,
                                                             unsigned threads_z, unsigned shared,
                                                             void* stream, void** arguments, void** extra) {
  if (!is_current() || x == 0 || y != 1 || z != 1 || threads_y != 1 || threads_z != 1 || extra ||
      !is_stream(stream) || shared > 48 * 1024)
    return kInvalidValue;
  const auto& kernel = *static_cast<const nif::test::EmulatedKernel*>(function);
  const bool pack = kernel.name == "nif_pack_bits", whole = kernel.name.starts_with("nif_scene_");
  if (pack) {
    const auto& work = *static_cast<const gpu::PackWork*>(arguments[0]);
    if (!is_of_gpu(work.visible) || !is_of_gpu(work.bits)) std::abort();
  } else {
    const auto* one = static_cast<const gpu::SceneWork*>(arguments[0]);
    const auto* piped = static_cast<const gpu::PipelineWork*>(arguments[0]);
    check_arrays(whole ? one->scene : piped->scene, whole ? one->query : piped->query);
  }
  const gpu::EmulatedGrid grid{
      .blocks = x, .threads = threads, .shared_bytes = shared, .wave = nif::test::wave_of(matrix_kind())};
  gpu::emulate(grid, kernel.bind(arguments[0]));
  return kOk;
}

NIF_FAKE int NIF_NAME(cuMemAlloc_v2, hipMalloc)(void** address, size_t bytes) {
  if (!is_current() || bytes == 0) return kInvalidValue;
  auto* piece = static_cast<char*>(std::aligned_alloc(256, (bytes + 255) / 256 * 256));
  if (!piece) return kOutOfMemory;
  const std::lock_guard lock(mutex);
  memory[piece] = bytes;
  return *address = piece, kOk;
}
NIF_FAKE int NIF_NAME(cuMemFree_v2, hipFree)(void* address) {
  const std::lock_guard lock(mutex);
  if (!is_current() || memory.erase(static_cast<char*>(address)) == 0) std::abort();
  return std::free(address), kOk;
}
NIF_FAKE int NIF_NAME(cuMemHostAlloc, hipHostMalloc)(void** piece, size_t bytes, unsigned flags) {
  if (!is_current() || flags != 0) return kInvalidValue;
  return *piece = std::malloc(bytes), kOk;
}
NIF_FAKE int NIF_NAME(cuMemFreeHost, hipHostFree)(void* piece) { return std::free(piece), kOk; }
NIF_FAKE int NIF_NAME(cuMemcpyHtoDAsync_v2, hipMemcpyHtoDAsync)(void* to, const void* from, size_t bytes,
                                                                void* stream) {
  if (!is_current() || !is_stream(stream) || !is_of_gpu(to, bytes)) return kInvalidValue;
  return std::memcpy(to, from, bytes), kOk;
}
NIF_FAKE int NIF_NAME(cuMemcpyDtoHAsync_v2, hipMemcpyDtoHAsync)(void* to, const void* from, size_t bytes,
                                                                void* stream) {
  if (!is_current() || !is_stream(stream) || !is_of_gpu(from, bytes)) return kInvalidValue;
  return std::memcpy(to, from, bytes), kOk;
}

NIF_FAKE int NIF_NAME(cuMemsetD8Async, hipMemsetD8Async)(void* to, unsigned char value, size_t bytes,
                                                         void* stream) {
  if (!is_current() || !is_stream(stream) || !is_of_gpu(to, bytes)) return kInvalidValue;
  return std::memset(to, value, bytes), kOk;
}

NIF_FAKE int NIF_NAME(cuStreamWaitEvent, hipStreamWaitEvent)(void* stream, void*, unsigned flags) {
  return is_stream(stream) && flags == 0 ? kOk : kInvalidValue;
}
NIF_FAKE int NIF_NAME(cuStreamCreate, hipStreamCreateWithFlags)(void** stream, unsigned flags) {
  return is_current() && flags == 1 ? (*stream = &the_stream, kOk) : kInvalidValue;
}
NIF_FAKE int NIF_NAME(cuStreamDestroy_v2, hipStreamDestroy)(void*) { return kOk; }
NIF_FAKE int NIF_NAME(cuStreamSynchronize, hipStreamSynchronize)(void* stream) {
  return is_stream(stream) ? kOk : kInvalidValue;
}
NIF_FAKE int NIF_NAME(cuEventCreate, hipEventCreateWithFlags)(void** event, unsigned flags) {
  return is_current() && (flags == 0 || flags == 2) ? (*event = new FakeEvent, kOk) : kInvalidValue;
}
NIF_FAKE int NIF_NAME(cuEventDestroy_v2, hipEventDestroy)(void* event) {
  return delete static_cast<FakeEvent*>(event), kOk;
}
NIF_FAKE int NIF_NAME(cuEventRecord, hipEventRecord)(void* event, void* stream) {
  static_cast<FakeEvent*>(event)->time = std::chrono::steady_clock::now();
  return is_stream(stream) ? kOk : kInvalidValue;
}
NIF_FAKE int NIF_NAME(cuEventQuery, hipEventQuery)(void*) { return kOk; }
NIF_FAKE int NIF_NAME(cuEventSynchronize, hipEventSynchronize)(void*) { return kOk; }
NIF_FAKE int NIF_NAME(cuEventElapsedTime, hipEventElapsedTime)(float* milliseconds, void* from, void* to) {
  const auto elapsed = static_cast<FakeEvent*>(to)->time - static_cast<FakeEvent*>(from)->time;
  return *milliseconds = std::chrono::duration<float, std::milli>(elapsed).count(), kOk;
}
