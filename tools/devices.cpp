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

constexpr const char* kSchema = "nifkit.devices/1";

struct Card {
  std::string name, target, driver, reason, backend, pci, uuid;
  uint64_t memory;
};

/// As other tools write it: the address of a PCI device, and the hexadecimal digits of a UUID.
std::string pci_of(const NifCardInfo& card) {
  return fmt::format("{:04x}:{:02x}:{:02x}.0", card.pci_domain, card.pci_bus, card.pci_device);
}
std::string uuid_of(const NifCardInfo& card) {
  std::string text;
  for (const size_t i : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}) {
    text += fmt::format("{:02x}", card.uuid[i]);
    if (i == 3 || i == 5 || i == 7 || i == 9) text += '-';
  }
  return text;
}

/// Empty if there are none; then the backend's reason says why.
std::vector<Card> find_cards() {
  std::vector<Card> cards;
  auto info = nifkit::sized<NifCardInfo>();
  while (nifGetCardInfo(uint32_t(cards.size()), &info) == NIF_OK)
    cards.push_back({info.name, info.target, info.driver, info.reason, info.backend, pci_of(info),
                     uuid_of(info), info.memory_bytes});
  return cards;
}

void print_text() {
  const NifDeviceInfo cpu = nifkit::Device().info();
  fmt::print("cpu  isa {}\n", cpu.isa);
  auto gpu = nifkit::sized<NifBackendInfo>();
  nifkit::check(nifGetBackendInfo(1, &gpu));
  const std::vector<Card> cards = find_cards();
  if (cards.empty()) fmt::print("gpu  not available: {}\n", gpu.reason);
  for (size_t i = 0; i < cards.size(); ++i) {
    const Card& card = cards[i];
    fmt::print("gpu  device={}: {}, {}, {}, {}, PCI {}", i, card.name, card.target,
               format_bytes(double(card.memory)), card.driver, card.pci);
    fmt::print("{}\n", card.reason.empty() ? "" : "; cannot be used: " + card.reason);
  }
}

void print_json() {
  using Json = nlohmann::ordered_json;
  Json backends = Json::array();
  auto info = nifkit::sized<NifBackendInfo>();
  for (uint32_t i = 0; nifGetBackendInfo(i, &info) == NIF_OK; ++i)
    backends.push_back({{"name", info.name}, {"available", info.available != 0}, {"reason", info.reason}});
  Json cards = Json::array();
  for (const Card& card : find_cards())
    cards.push_back({{"device", cards.size()},
                     {"backend", card.backend},
                     {"name", card.name},
                     {"pci", card.pci},
                     {"uuid", card.uuid},
                     {"target", card.target},
                     {"driver", card.driver},
                     {"memory", card.memory},
                     {"available", card.reason.empty()},
                     {"reason", card.reason}});
  const Json json{{"schema", kSchema},
                  {"isa", nifkit::Device().info().isa},
                  {"backends", std::move(backends)},
                  {"cards", std::move(cards)}};
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
