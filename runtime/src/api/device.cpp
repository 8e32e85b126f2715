// Creates devices: reads the configuration, and uses the caller's allocator.
#include "api/device.hpp"

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <iterator>
#include <thread>

#include "api/error.hpp"
#include "api/structure.hpp"

namespace nif::runtime {
namespace {

constexpr uint32_t kMaxThreads = 1024, kMaxGpus = 1024;
constexpr std::initializer_list<const char*> kBackends = {"cpu", "gpu", "cuda", "hip"};

uint32_t machine_threads() { return std::clamp(std::thread::hardware_concurrency(), 1u, kMaxThreads); }

uint32_t parse_number(std::string_view key, std::string_view value, uint32_t most) {
  uint32_t number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size() || number > most)
    refuse_argument("configuration: " + std::string(key) + "=" + std::string(value) +
                    " is not a number from 0 to " + std::to_string(most));
  return number;
}

/// 0 stands for the number of threads that the machine has.
uint32_t parse_count(std::string_view key, std::string_view value) {
  const uint32_t count = parse_number(key, value, kMaxThreads);
  return count != 0 ? count : machine_threads();
}

Isa parse_isa(std::string_view value) {
  if (value == "auto") return best_isa();
  for (const Isa isa : {Isa::scalar, Isa::sse4, Isa::avx2, Isa::avx512, Isa::neon, Isa::wasm}) {
    if (value != name_of(isa)) continue;
    if (available(isa)) return isa;
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "configuration: isa=" + std::string(value) +
                                               " is not available in this build or on this machine");
  }
  refuse_argument("configuration: unknown value isa=" + std::string(value));
}

/// Returns the index of the value in `names`.
size_t parse_name(std::string_view key, std::string_view value, std::initializer_list<const char*> names) {
  const auto at = std::find(names.begin(), names.end(), value);
  if (at == names.end())
    refuse_argument("configuration: unknown value " + std::string(key) + "=" + std::string(value));
  return size_t(at - names.begin());
}

/// Refuses keys that have no effect without a GPU backend, or in combination.
void check_backend(const Configuration& configuration, bool for_gpu) {
  if (for_gpu && std::string_view(configuration.backend) == "cpu")
    refuse_argument("configuration: device=, module=, pipeline= and precision= need backend=gpu");
  if (configuration.gpu.half && configuration.gpu.way == GpuWay::one_kernel)
    refuse_argument(
        "configuration: precision=half needs the pipeline, so it cannot be used with pipeline=off");
}

}  // namespace

void* CallbackMemory::do_allocate(size_t bytes, size_t alignment) {
  void* memory = callbacks_.allocate(callbacks_.user, std::max<size_t>(bytes, 1), alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void CallbackMemory::do_deallocate(void* memory, size_t bytes, size_t alignment) {
  callbacks_.deallocate(callbacks_.user, memory, std::max<size_t>(bytes, 1), alignment);
}

Configuration parse_configuration(std::string_view text) {
  Configuration configuration;
  configuration.queries = machine_threads();
  bool for_gpu = false;  // set if some key is
  while (!text.empty()) {
    const std::string_view item = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), item.size() + 1));
    const size_t equals = std::min(item.find('='), item.size());
    const std::string_view key = item.substr(0, equals);
    const std::string_view value = item.substr(std::min(item.size(), equals + 1));
    if (key == "threads")
      configuration.threads = parse_count(key, value);
    else if (key == "queries")
      configuration.queries = parse_count(key, value);
    else if (key == "isa")
      configuration.kernels.isa = parse_isa(value);
    else if (key == "memory")
      configuration.kernels.least_memory = parse_name(key, value, {"auto", "least"}) == 1;
    else if (key == "shaders")
      configuration.shaders = parse_name(key, value, {"off", "on"}) == 1;
    else if (key == "backend")
      configuration.backend = kBackends.begin()[parse_name(key, value, kBackends)];
    else if (key == "device")
      configuration.gpu_number = parse_number(key, value, kMaxGpus), for_gpu = true;
    else if (key == "module")
      configuration.module = value, for_gpu = for_gpu || !value.empty();
    else if (key == "pipeline")
      configuration.gpu.way = GpuWay(parse_name(key, value, {"auto", "off", "on"})), for_gpu = true;
    else if (key == "precision")
      configuration.gpu.half = uint32_t(parse_name(key, value, {"single", "half"})), for_gpu = true;
    else
      refuse_argument("configuration: '" + std::string(item) + "' is unknown");
  }
  check_backend(configuration, for_gpu);
  configuration.queries = std::max(configuration.queries, configuration.threads);
  return configuration;
}

void open_gpu(const Configuration& configuration, std::optional<Gpu>& gpu) {
  const std::string backend = configuration.backend;
  if (backend == "cpu") return;
  try {
    gpu.emplace(configuration.module, backend, configuration.gpu_number, configuration.gpu);
  } catch (const Failure& failure) {
    throw Failure(failure.code(), "configuration: backend=" + backend + ": " + failure.what());
  }
}

NifDeviceObject* new_device(const char* configuration, const NifDeviceCallbacks* callbacks) {
  const NifDeviceCallbacks own = callbacks ? read_structure(callbacks, "callbacks") : NifDeviceCallbacks{};
  if ((own.allocate == nullptr) != (own.deallocate == nullptr))
    refuse_argument("callbacks: set both allocate and deallocate, or neither");
  const Configuration settings = parse_configuration(configuration ? configuration : "");
  CallbackMemory memory(own);
  auto* device =
      create<NifDeviceObject>(own.allocate ? &memory : std::pmr::new_delete_resource(), settings, own);
  device->log(NIF_LOG_INFO, [&] {
    const std::string threads =
        std::to_string(settings.threads) + " threads, isa=" + name_of(settings.kernels.isa);
    return device->gpu ? "device: " + std::string(device->gpu->description().name) + " (" +
                             device->gpu->description().backend + ", " + device->gpu->description().target +
                             "), " + threads
                       : "device: CPU, " + threads;
  });
  return device;
}

void release(NifDeviceObject* device) {
  if (device == nullptr || !device->drop()) return;
  CallbackMemory memory(device->own_callbacks);
  destroy(device->own_callbacks.allocate ? &memory : std::pmr::new_delete_resource(), device);
}

}  // namespace nif::runtime
