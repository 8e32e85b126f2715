#include "tools/common/asset_bytes.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tools/common/runtime_handles.hpp"

namespace nif::tools {

nlohmann::ordered_json bytes_json(const format::AssetView& view) {
  nlohmann::ordered_json bytes{{"file", view.bytes.size()}, {"resident", resident_bytes(view.bytes)}};
  for (const format::PartBytes& part : format::bytes_by_part(view)) bytes[part.name] = part.bytes;
  return bytes;
}

std::string bytes_line(const nlohmann::ordered_json& bytes,
                       const std::function<std::string(uint64_t)>& text) {
  std::string parts;
  for (const auto& [name, count] : bytes.items()) {
    if (name == "file" || name == "resident" || name == "primary") continue;
    parts += fmt::format("{}{} {}", parts.empty() ? "" : ", ", name, text(count.get<uint64_t>()));
  }
  return fmt::format("{} as a file, {} resident ({})", text(bytes["file"].get<uint64_t>()),
                     text(bytes["resident"].get<uint64_t>()), parts);
}

}  // namespace nif::tools
