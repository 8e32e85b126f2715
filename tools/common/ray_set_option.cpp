// Only parses names. Without --set the list is empty, and each subcommand takes its own default sets.
#include "tools/common/ray_set_option.hpp"

#include <fmt/format.h>

#include <optional>

#include "formats/base/status.hpp"

namespace nif::tools {

void add_set_option(Command command, std::vector<std::string>& names, const std::string& otherwise) {
  command.add_option(
      "--set", names,
      fmt::format("A ray set to measure (docs/ray-sets.md); may be repeated (default: {})", otherwise));
}

std::vector<bake::RaySet> parse_sets(const std::vector<std::string>& names) {
  std::vector<bake::RaySet> sets;
  for (const std::string& name : names) {
    const std::optional<bake::RaySet> set = bake::ray_set_named(name);
    if (!set) {
      throw Error(
          Status::usage,
          fmt::format(
              "--set '{}' is not one of outer-lines, inner-surface, inner-volume, segments, sun, camera",
              name));
    }
    sets.push_back(*set);
  }
  return sets;
}

}  // namespace nif::tools
