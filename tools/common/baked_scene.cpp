#include "tools/common/baked_scene.hpp"

#include <nlohmann/json.hpp>

#include "bake/merging.hpp"
#include "formats/base/json_text.hpp"
#include "mesh/merge/merge.hpp"
#include "tools/common/naming.hpp"

namespace nif::tools {

mesh::ReadLimits limits_as_baked(std::string_view metadata) {
  mesh::ReadLimits limits;
  const nlohmann::json root = parse_untrusted<nlohmann::json>(metadata);
  const nlohmann::json::json_pointer at("/options/colors");
  if (root.is_object() && root.contains(at)) limits.colors = root.at(at) == true;
  return limits;
}

std::optional<mesh::Scene> merged_as_baked(const mesh::Scene& scene, std::string_view metadata,
                                           const std::string& asset, const std::string& mesh) {
  const std::optional<mesh::MergeOptions> options =
      naming(asset, [&] { return bake::merge_options_of(metadata); });
  if (!options) return std::nullopt;
  return naming(mesh, [&] { return mesh::merge(scene, *options); });
}

}  // namespace nif::tools
