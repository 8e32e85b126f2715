// Bypasses the runtime: opens the file with the reader of formats/nif and looks up each object's field. `nif
// eval --hits` uses it to state distances in voxels.
#include "tools/common/voxel_size.hpp"

#include "bake/reference_answers.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"

namespace nif::tools {

std::vector<double> voxels_per_unit(const std::string& asset) {
  const format::FileMemory memory = format::FileMemory::load(asset, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(memory.bytes(), asset);
  std::vector<double> all;
  for (const format::ObjectView& object : view.objects)
    if (object.level == 0)
      all.push_back(object.unsupported ? 0 : bake::voxels_per_unit(format::field_of(object)));
  return all;
}

}  // namespace nif::tools
