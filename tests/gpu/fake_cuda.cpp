// A libcuda.so.1 for tests: as much of CUDA's driver interface as the GPU module calls, as cuda.h declares
// it, for one card whose kernels the emulator runs, at once. With it the module that is installed is run from
// end to end: which code it picks, and what it says to the driver. Where calls are not as CUDA wants them (no
// context, memory that is not the card's) they fail, or end the process.
//
// FAKE_CUDA_VERSION: of the driver (13000). FAKE_CUDA_CAPABILITY: of the card (90), 0: no card.
// FAKE_CUDA_WANTS: "elf" or "ptx", the form of code that must be loaded.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>

#include "tests/gpu/emulated_kernels.hpp"

#define NIF_FAKE extern "C" __attribute__((visibility("default")))

namespace {

namespace hip = nif::kernels::hip;
using Address = unsigned long long;

constexpr int kOk = 0, kInvalidValue = 1, kOutOfMemory = 2, kNoDevice = 100, kInvalidContext = 201,
              kNoBinary = 209, kNotFound = 500;

int number(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::atoi(text) : otherwise;
}
int capability() { return number("FAKE_CUDA_CAPABILITY", 90); }

int the_context, the_stream;
thread_local int pushed = 0;
std::mutex mutex;
std::map<Address, size_t> memory;

struct FakeEvent {
  std::chrono::steady_clock::time_point time;
};

bool is_of_card(Address at, size_t bytes = 1) {
  const std::lock_guard lock(mutex);
  auto piece = memory.upper_bound(at);
  if (piece == memory.begin()) return false;
  --piece;
  return at + bytes <= piece->first + piece->second;
}
bool is_stream(const void* stream) { return stream == nullptr || stream == &the_stream; }

}  // namespace

NIF_FAKE int cuInit(unsigned flags) { return flags == 0 ? kOk : kInvalidValue; }
NIF_FAKE int cuDriverGetVersion(int* version) { return *version = number("FAKE_CUDA_VERSION", 13000), kOk; }
NIF_FAKE int cuDeviceGetCount(int* count) { return *count = capability() != 0, kOk; }
NIF_FAKE int cuDeviceGet(int* device, int ordinal) {
  return ordinal == 0 && capability() != 0 ? (*device = 7, kOk) : kNoDevice;
}
NIF_FAKE int cuDeviceGetName(char* name, int length, int device) {
  return device == 7 ? (std::snprintf(name, size_t(length), "fake card"), kOk) : kNoDevice;
}
NIF_FAKE int cuDeviceTotalMem_v2(size_t* bytes, int device) {
  return device == 7 ? (*bytes = size_t{1} << 33, kOk) : kNoDevice;
}
NIF_FAKE int cuDeviceGetAttribute(int* value, int attribute, int device) {
  if (device != 7 || (attribute != 75 && attribute != 76)) return kInvalidValue;
  *value = attribute == 75 ? capability() / 10 : capability() % 10;
  return kOk;
}
NIF_FAKE int cuGetErrorString(int result, const char** text) {
  static thread_local std::string words;
  words = "fake error " + std::to_string(result);
  return *text = words.c_str(), kOk;
}

NIF_FAKE int cuDevicePrimaryCtxRetain(void** context, int device) {
  return device == 7 ? (*context = &the_context, kOk) : kNoDevice;
}
NIF_FAKE int cuDevicePrimaryCtxRelease_v2(int device) { return device == 7 ? kOk : kNoDevice; }
NIF_FAKE int cuCtxPushCurrent_v2(void* context) {
  return context == &the_context ? (++pushed, kOk) : kInvalidContext;
}
NIF_FAKE int cuCtxPopCurrent_v2(void** context) {
  if (pushed == 0) std::abort();
  return --pushed, *context = &the_context, kOk;
}

/// A cubin is an ELF file for the card's architecture, or one before; PTX is text.
NIF_FAKE int cuModuleLoadData(void** module, const void* image) {
  if (pushed == 0) return kInvalidContext;
  const auto* bytes = static_cast<const unsigned char*>(image);
  const bool elf = std::memcmp(bytes, "\177ELF", 4) == 0;
  if (!elf && std::strstr(static_cast<const char*>(image), ".target sm_") == nullptr) return kNoBinary;
  const char* wanted = std::getenv("FAKE_CUDA_WANTS");
  if (wanted && (std::strcmp(wanted, "elf") == 0) != elf) std::abort();
  *module = const_cast<void*>(image);
  return kOk;
}
NIF_FAKE int cuModuleUnload(void*) { return pushed > 0 ? kOk : kInvalidContext; }
NIF_FAKE int cuModuleGetFunction(void** function, void* module, const char* name) {
  if (pushed == 0 || module == nullptr) return kInvalidContext;
  const nif::test::EmulatedKernel* kernel = nif::test::find_emulated_kernel(name);
  return kernel ? (*function = const_cast<nif::test::EmulatedKernel*>(kernel), kOk) : kNotFound;
}
NIF_FAKE int cuLaunchKernel(void* function, unsigned x, unsigned y, unsigned z, unsigned threads,
                            unsigned threads_y, unsigned threads_z, unsigned shared, void* stream,
                            void** arguments, void** extra) {
  if (pushed == 0 || y != 1 || z != 1 || threads_y != 1 || threads_z != 1 || extra || !is_stream(stream) ||
      shared > 48 * 1024 || x == 0)
    return kInvalidValue;
  const auto scene = *static_cast<const hip::SceneArrays*>(arguments[0]);
  const auto query = *static_cast<const hip::SceneQuery*>(arguments[1]);
  const auto check = [](const void* array) {
    if (array && !is_of_card(reinterpret_cast<Address>(array))) std::abort();
  };
  for (const void* array : {static_cast<const void*>(scene.nodes), static_cast<const void*>(scene.instances),
                            static_cast<const void*>(scene.objects)})
    check(array);
  for (const unsigned char* array : {query.origin[0], query.origin[1], query.origin[2], query.direction[0],
                                     query.direction[1], query.direction[2], query.tmin, query.tmax})
    check(array);
  for (const unsigned char* array :
       {query.visible, query.visible_bits, query.probability, query.certain, query.logit})
    check(array);
  const hip::EmulatedGrid grid{.blocks = x, .threads = threads, .shared_bytes = shared};
  hip::emulate(grid, [&](const hip::EmulatedThread& thread) {
    static_cast<const nif::test::EmulatedKernel*>(function)->run(thread, scene, query);
  });
  return kOk;
}

NIF_FAKE int cuMemAlloc_v2(Address* address, size_t bytes) {
  if (pushed == 0 || bytes == 0) return kInvalidValue;
  void* piece = std::aligned_alloc(256, (bytes + 255) / 256 * 256);
  if (!piece) return kOutOfMemory;
  const std::lock_guard lock(mutex);
  memory[*address = reinterpret_cast<Address>(piece)] = bytes;
  return kOk;
}
NIF_FAKE int cuMemFree_v2(Address address) {
  const std::lock_guard lock(mutex);
  if (pushed == 0 || memory.erase(address) == 0) std::abort();
  std::free(reinterpret_cast<void*>(address));
  return kOk;
}
NIF_FAKE int cuMemHostAlloc(void** piece, size_t bytes, unsigned flags) {
  if (pushed == 0 || flags != 0) return kInvalidValue;
  return *piece = std::malloc(bytes), kOk;
}
NIF_FAKE int cuMemFreeHost(void* piece) { return std::free(piece), kOk; }
NIF_FAKE int cuMemcpyHtoDAsync_v2(Address to, const void* from, size_t bytes, void* stream) {
  if (pushed == 0 || !is_stream(stream) || !is_of_card(to, bytes)) return kInvalidValue;
  return std::memcpy(reinterpret_cast<void*>(to), from, bytes), kOk;
}
NIF_FAKE int cuMemcpyDtoHAsync_v2(void* to, Address from, size_t bytes, void* stream) {
  if (pushed == 0 || !is_stream(stream) || !is_of_card(from, bytes)) return kInvalidValue;
  return std::memcpy(to, reinterpret_cast<const void*>(from), bytes), kOk;
}
NIF_FAKE int cuPointerGetAttribute(void* value, int attribute, Address address) {
  if (!is_of_card(address)) return kInvalidValue;
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

NIF_FAKE int cuStreamCreate(void** stream, unsigned flags) {
  return flags == 1 ? (*stream = &the_stream, kOk) : kInvalidValue;
}
NIF_FAKE int cuStreamDestroy_v2(void*) { return kOk; }
NIF_FAKE int cuStreamSynchronize(void* stream) { return is_stream(stream) ? kOk : kInvalidValue; }
NIF_FAKE int cuStreamGetCtx(void* stream, void** context) {
  return is_stream(stream) ? (*context = &the_context, kOk) : kInvalidValue;
}
NIF_FAKE int cuEventCreate(void** event, unsigned flags) {
  return flags == 0 || flags == 2 ? (*event = new FakeEvent, kOk) : kInvalidValue;
}
NIF_FAKE int cuEventDestroy_v2(void* event) { return delete static_cast<FakeEvent*>(event), kOk; }
NIF_FAKE int cuEventRecord(void* event, void* stream) {
  static_cast<FakeEvent*>(event)->time = std::chrono::steady_clock::now();
  return is_stream(stream) ? kOk : kInvalidValue;
}
NIF_FAKE int cuEventQuery(void*) { return kOk; }
NIF_FAKE int cuEventSynchronize(void*) { return kOk; }
NIF_FAKE int cuEventElapsedTime(float* milliseconds, void* from, void* to) {
  const auto elapsed = static_cast<FakeEvent*>(to)->time - static_cast<FakeEvent*>(from)->time;
  return *milliseconds = std::chrono::duration<float, std::milli>(elapsed).count(), kOk;
}
