// Loads the asset into the runtime for the list of parts and resident bytes, and reads the flat list of file
// bytes with the reader. The text for people leaves out some entries; the JSON has all.
#include "tools/common/asset_bytes.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tools/common/runtime_handles.hpp"

namespace nif::tools {

nlohmann::ordered_json parts_json(std::span<const NifPartInfo> parts) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const NifPartInfo& part : parts)
    json[part.name] = {{"file", part.file_bytes}, {"resident", part.resident_bytes}};
  return json;
}

nlohmann::ordered_json bytes_json(const format::AssetView& view) {
  const std::vector<NifPartInfo> parts = parts_of(view.bytes);
  uint64_t resident = 0;
  for (const NifPartInfo& part : parts) resident += part.resident_bytes;
  nlohmann::ordered_json bytes{{"file", view.bytes.size()}, {"resident", resident}};
  for (const format::PartBytes& part : format::bytes_by_part(view)) bytes[part.name] = part.bytes;
  bytes["parts"] = parts_json(parts);
  return bytes;
}

std::string bytes_line(const nlohmann::ordered_json& bytes,
                       const std::function<std::string(uint64_t)>& text) {
  std::string parts;
  for (const auto& [name, count] : bytes.items()) {
    if (name == "file" || name == "resident" || name == "primary" || name == "source_triangles" ||
        name == "numbers" || name == "colors" || name == "skin" || name == "parts")
      continue;
    parts += fmt::format("{}{} {}", parts.empty() ? "" : ", ", name, text(count.get<uint64_t>()));
  }
  return fmt::format("{} as a file ({}), {} resident", text(bytes["file"].get<uint64_t>()), parts,
                     text(bytes["resident"].get<uint64_t>()));
}

}  // namespace nif::tools
