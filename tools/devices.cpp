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
  std::string name, target, driver, reason;
  uint64_t memory;
};

/// Empty if there are none; then the backend's reason says why.
std::vector<Card> find_cards() {
  std::vector<Card> cards;
  auto info = nifkit::sized<NifCardInfo>();
  while (nifGetCardInfo(uint32_t(cards.size()), &info) == NIF_OK)
    cards.push_back({info.name, info.target, info.driver, info.reason, info.memory_bytes});
  return cards;
}

void print_text() {
  const NifDeviceInfo cpu = nifkit::Device().info();
  fmt::print("cpu  isa {}\n", cpu.isa);
  auto hip = nifkit::sized<NifBackendInfo>();
  nifkit::check(nifGetBackendInfo(1, &hip));
  const std::vector<Card> cards = find_cards();
  if (cards.empty()) fmt::print("hip  not available: {}\n", hip.reason);
  for (size_t i = 0; i < cards.size(); ++i) {
    const Card& card = cards[i];
    fmt::print("hip  device={}: {}, {}, {}, {}", i, card.name, card.target, format_bytes(double(card.memory)),
               card.driver);
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
                     {"name", card.name},
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
      "line says what is missing: the GPU module (libnif_hip.so, or the file that NIF_HIP_MODULE names), a "
      "driver, a\n"
      "GPU, or code for the GPU.\n"
      "Examples:\n"
      "  nif devices\n"
      "  nif devices --json");
  command.callback([json] { *json ? print_json() : print_text(); });
}

}  // namespace nif::tools
