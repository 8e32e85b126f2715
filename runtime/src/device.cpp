// Devices: reading the configuration and using the caller's allocator.
#include "device.hpp"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <thread>

#include "error.hpp"
#include "structure.hpp"

namespace nif::runtime {
namespace {

constexpr uint32_t kMaxThreads = 1024;

uint32_t machine_threads() { return std::clamp(std::thread::hardware_concurrency(), 1u, kMaxThreads); }

/// 0 stands for as many as the machine has threads.
uint32_t parse_count(std::string_view key, std::string_view value) {
  uint32_t count = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), count);
  if (error != std::errc() || end != value.data() + value.size() || count > kMaxThreads)
    refuse_argument("configuration: " + std::string(key) + "=" + std::string(value) +
                    " is no number from 0 to " + std::to_string(kMaxThreads));
  return count != 0 ? count : machine_threads();
}

Isa parse_isa(std::string_view value) {
  if (value == "auto") return best_isa();
  for (const Isa isa : {Isa::scalar, Isa::sse4, Isa::avx2, Isa::avx512, Isa::neon}) {
    if (value != name_of(isa)) continue;
    if (available(isa)) return isa;
    throw Failure(NIF_ERROR_NOT_AVAILABLE, "configuration: isa=" + std::string(value) +
                                               " is not in this build, or not in this machine");
  }
  refuse_argument("configuration: there is no isa=" + std::string(value));
}

void parse_backend(std::string_view value) {
  if (value == "cpu") return;
  if (value != "hip") refuse_argument("configuration: there is no backend=" + std::string(value));
  throw Failure(NIF_ERROR_NOT_AVAILABLE, std::string("configuration: backend=hip: ") + why_no_hip());
}

}  // namespace

const char* why_no_hip() { return "this version has no GPU module"; }

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
      configuration.isa = parse_isa(value);
    else if (key == "backend")
      parse_backend(value);
    else
      refuse_argument("configuration: '" + std::string(item) + "' is not known");
  }
  configuration.queries = std::max(configuration.queries, configuration.threads);
  return configuration;
}

NifDeviceObject* new_device(const char* configuration, const NifDeviceCallbacks* callbacks) {
  const NifDeviceCallbacks own = callbacks ? read_structure(callbacks, "callbacks") : NifDeviceCallbacks{};
  if ((own.allocate == nullptr) != (own.deallocate == nullptr))
    refuse_argument("callbacks: allocate and deallocate belong together");
  const Configuration settings = parse_configuration(configuration ? configuration : "");
  CallbackMemory memory(own);
  return create<NifDeviceObject>(own.allocate ? &memory : std::pmr::new_delete_resource(), settings, own);
}

void release(NifDeviceObject* device) {
  if (device == nullptr || !device->drop()) return;
  CallbackMemory memory(device->own_callbacks);
  destroy(device->own_callbacks.allocate ? &memory : std::pmr::new_delete_resource(), device);
}

}  // namespace nif::runtime
