#include "tools/common/voxel_size.hpp"

#include <variant>

#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"

namespace nif::tools {
namespace {

template <class Field>
double voxels_per_unit_of(const Field& field) {
  if constexpr (requires { field.voxels_per_unit; })
    return double(field.voxels_per_unit);
  else if constexpr (requires { field.proof; })
    return voxels_per_unit_of(field.proof);
  else
    return 0;
}

}  // namespace

std::vector<double> voxels_per_unit(const std::string& asset) {
  const format::FileMemory memory = format::FileMemory::load(asset, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(memory.bytes(), asset);
  std::vector<double> all;
  for (const format::ObjectView& object : view.objects)
    all.push_back(
        std::visit([](const auto& field) { return voxels_per_unit_of(field); }, format::field_of(object)));
  return all;
}

}  // namespace nif::tools
