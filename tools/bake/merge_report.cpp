// A merge's counts as JSON and as one English sentence. Each reason to stay apart (mesh::Stays) needs a
// key and a phrase here.
#include "tools/bake/merge_report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "bake/merge_metadata.hpp"
#include "formats/base/quantities.hpp"

namespace nif::tools {
namespace {

using nlohmann::ordered_json;

/// The phrase for a reason, to follow a count. `copies`: --merge was given.
std::string reason_of(mesh::Stays why, uint64_t count, const mesh::MergeOptions& options, bool copies) {
  const bool one = count == 1;
  switch (why) {
    case mesh::Stays::not_named:
      return one ? "is not named" : "are not named";
    case mesh::Stays::moves:
      return one ? "moves" : "move";
    case mesh::Stays::flattened:
      return one ? "is flattened by its transform" : "are flattened by their transforms";
    case mesh::Stays::too_far:
      return one ? "is too far from the origin for its size" : "are too far from the origin for their size";
    case mesh::Stays::deforms:
      return one ? "deforms" : "deform";
    case mesh::Stays::too_large:
      return fmt::format("{} {} triangles or more", one ? "has" : "have", options.object_triangles);
    case mesh::Stays::large_copy:
      return fmt::format("{} of {} triangles or more", one ? "shares its mesh" : "share their meshes",
                         options.part_triangles);
    case mesh::Stays::over_budget:
      if (!copies) return one ? "shares its mesh" : "share their meshes";
      if (options.added_triangles == 0)
        return one ? "shares its mesh, and --merge-triangles allows no copies"
                   : "share their meshes, and --merge-triangles allows no copies";
      return fmt::format("would exceed --merge-triangles {}", options.added_triangles.value_or(0));
    case mesh::Stays::alone:
      return one ? "has no neighbour to merge with" : "have no neighbour to merge with";
  }
  return "";
}

constexpr std::array<const char*, mesh::kStays> kStayNames{"not_named",  "moves",       "deforms",
                                                           "flattened",  "too_far",     "too_large",
                                                           "large_copy", "over_budget", "alone"};

uint64_t merged_parts(const mesh::Merging& merging) {
  uint64_t parts = 0;
  for (const mesh::MergedInstance& merged : merging.merged) parts += merged.parts.size();
  return parts;
}

}  // namespace

ordered_json to_json(const mesh::Merging& merging) {
  ordered_json described{{"instances", merging.instances},
                         {"merged", merged_parts(merging)},
                         {"objects", merging.merged.size()},
                         {"added_triangles", merging.added_triangles}};
  described["settings"] = bake::to_json(merging.options);
  for (size_t why = 0; why < mesh::kStays; ++why) described["stay"][kStayNames[why]] = merging.stay[why];
  return described;
}

std::string summary(const mesh::Merging& merging, bool copies) {
  const uint64_t parts = merged_parts(merging), stay = merging.instances - parts;
  std::string text =
      parts == 0
          ? "nothing was merged"
          : fmt::format("merged {} of {}, which do not move against each other, into {}", parts,
                        count_of(merging.instances, "instance"), count_of(merging.merged.size(), "object"));
  if (stay == 0) return text;
  std::vector<std::string> reasons;
  for (size_t why = 0; why < mesh::kStays; ++why)
    if (const uint64_t count = merging.stay[why])
      reasons.push_back(
          fmt::format("{} {}", count, reason_of(mesh::Stays(why), count, merging.options, copies)));
  return fmt::format("{}; {} {}: {}", text, stay, stay == 1 ? "stays" : "stay", fmt::join(reasons, ", "));
}

}  // namespace nif::tools
