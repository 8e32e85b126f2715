// If the file places the trees, the asset does so, too. Otherwise the whole asset is placed as often as there are copies.
#include "asset_trees.hpp"

#include <filesystem>
#include <stdexcept>

AssetTrees::AssetTrees(const Trees& trees, const std::string& path, const std::string& config)
    : device_(config), asset_(nifkit::Asset::load(device_, path)), scene_(device_) {
  bytes_of_file_ = std::filesystem::file_size(path);
  if (trees.planted) {
    for (const Placed& placed : trees.placed) scene_.add_asset(asset_, placed.transform);
  } else {
    scene_.add_asset(asset_);
  }
  scene_.commit();
  const uint32_t placed = scene_.info().instance_count, wanted = uint32_t(trees.placed.size());
  if (placed % wanted != 0 || (placed != wanted && !trees.planted))
    throw std::runtime_error(path + ": it was not baked from this file, whose instances differ");
  instances_ = placed / wanted;
}

double AssetTrees::find_hits(std::span<const NifRay> rays, Hits& hits) {
  hits.resize(rays.size());
  auto found = nifkit::sized<NifHits>();
  found.t = hits.t.data(), found.normal = hits.normal.data()->data(), found.instance = hits.placed.data();
  const NifRays asked = nifMakeRays(rays.data(), rays.size());
  const double start = thread_seconds();
  nifkit::check(nifIntersect(scene_.get(), &asked, &found));
  const double seconds = thread_seconds() - start;
  for (uint32_t& instance : hits.placed)
    if (instance != NIF_NONE) instance /= instances_;
  return seconds;
}

double AssetTrees::find_visible(std::span<const NifRay> rays, std::vector<uint8_t>& visible) {
  visible.resize(rays.size());
  auto answers = nifkit::sized<NifAnswers>();
  answers.visible = visible.data();
  const NifRays asked = nifMakeRays(rays.data(), rays.size());
  const double start = thread_seconds();
  nifkit::check(nifQuery(scene_.get(), &asked, &answers));
  return thread_seconds() - start;
}
