// Counts of triangles with holes, and of what they show. Bytes are listed for every part alike (bake/describe.cpp).
#include "bake/holes/describe_holes.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/base/quantities.hpp"

namespace nif::bake {
namespace {

uint64_t triangles_with_holes(const kernels::HolesField& field) {
  uint64_t count = 0;
  for (uint32_t i = 0; i < field.numbers.count; ++i) count += kernels::patch_of(field, i) != nullptr;
  return count;
}

}  // namespace

void describe(const format::HolesView& view, nlohmann::ordered_json& json, nlohmann::ordered_json&) {
  json["triangles_with_holes"] = triangles_with_holes(view.field);
  json["patches"] = view.field.patch_count;
}

std::string summary(const format::HolesView& view) {
  const uint64_t count = triangles_with_holes(view.field);
  return fmt::format("{} with holes", count_of(count, "triangle"));
}

}  // namespace nif::bake
