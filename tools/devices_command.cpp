// `nif devices`: lists the devices of this machine that can answer queries, and what others lack.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "formats/base/quantities.hpp"
#include "nif/nif.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/options.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.devices/2";

struct Gpu {
  std::string name, target, driver, reason, backend, pci, uuid;
  uint64_t memory;
};

/// As other tools write it: the address of a PCI device, and the hexadecimal digits of a UUID.
std::string pci_of(const NifGpuInfo& gpu) {
  return fmt::format("{:04x}:{:02x}:{:02x}.0", gpu.pci_domain, gpu.pci_bus, gpu.pci_device);
}
std::string uuid_of(const NifGpuInfo& gpu) {
  std::string text;
  for (const size_t i : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}) {
    text += fmt::format("{:02x}", gpu.uuid[i]);
    if (i == 3 || i == 5 || i == 7 || i == 9) text += '-';
  }
  return text;
}

/// Empty if there are none; then the backend's reason says why.
std::vector<Gpu> find_gpus() {
  std::vector<Gpu> gpus;
  auto info = nifkit::sized<NifGpuInfo>();
  while (nifGetGpuInfo(uint32_t(gpus.size()), &info) == NIF_OK)
    gpus.push_back({info.name, info.target, info.driver, info.reason, info.backend, pci_of(info),
                    uuid_of(info), info.memory_bytes});
  return gpus;
}

void print_text() {
  const NifDeviceInfo cpu = nifkit::Device().info();
  fmt::print("cpu  isa {}\n", cpu.isa);
  auto gpu = nifkit::sized<NifBackendInfo>();
  nifkit::check(nifGetBackendInfo(1, &gpu));
  const std::vector<Gpu> gpus = find_gpus();
  if (gpus.empty()) fmt::print("gpu  not available: {}\n", gpu.reason);
  for (size_t i = 0; i < gpus.size(); ++i) {
    const Gpu& gpu = gpus[i];
    fmt::print("gpu  device={}: {}, {}, {}, {}, PCI {}", i, gpu.name, gpu.target,
               format_bytes(double(gpu.memory)), gpu.driver, gpu.pci);
    fmt::print("{}\n", gpu.reason.empty() ? "" : "; cannot be used: " + gpu.reason);
  }
}

void print_json() {
  using Json = nlohmann::ordered_json;
  Json backends = Json::array();
  auto info = nifkit::sized<NifBackendInfo>();
  for (uint32_t i = 0; nifGetBackendInfo(i, &info) == NIF_OK; ++i)
    backends.push_back({{"name", info.name}, {"available", info.available != 0}, {"reason", info.reason}});
  Json gpus = Json::array();
  for (const Gpu& gpu : find_gpus())
    gpus.push_back({{"device", gpus.size()},
                    {"backend", gpu.backend},
                    {"name", gpu.name},
                    {"pci", gpu.pci},
                    {"uuid", gpu.uuid},
                    {"target", gpu.target},
                    {"driver", gpu.driver},
                    {"memory", gpu.memory},
                    {"available", gpu.reason.empty()},
                    {"reason", gpu.reason}});
  const Json json{{"schema", kSchema},
                  {"isa", nifkit::Device().info().isa},
                  {"backends", std::move(backends)},
                  {"gpus", std::move(gpus)}};
  write_json(json);
}

}  // namespace

void add_devices(Command app) {
  const Command command =
      app.add_subcommand("devices", "List what can answer queries on this machine: the CPU and GPUs");
  auto json = std::make_shared<bool>(false);
  add_json_option(command, *json, kSchema);
  command.footer(
      "To use a GPU, configure the runtime with \"backend=gpu,device=N\" (docs/runtime.md). If no GPU can be "
      "used, the\n"
      "line says what is missing: the GPU module (libnif_gpu.so, or the file that NIF_GPU_MODULE names), a "
      "driver, a\n"
      "GPU, or code for the GPU.\n"
      "Examples:\n"
      "  nif devices\n"
      "  nif devices --json");
  command.callback([json] { *json ? print_json() : print_text(); });
}

}  // namespace nif::tools
