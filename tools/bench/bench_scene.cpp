// Reads the scene with the code of `nif render`. Objects with the same mesh and asset are loaded once.
// Instances that are flattened by their transform are left out, as in pictures.
#include "tools/bench/bench_scene.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "formats/base/status.hpp"
#include "formats/mesh/transform.hpp"
#include "tools/render/scene_file.hpp"

namespace nif::tools {
namespace {

render::SceneDescription read_objects(const std::string& path, const std::string& asset) {
  render::SceneDescription scene = render::read_scene(path);
  if (render::is_gltf(path)) {
    if (asset.empty())
      throw Error(Status::usage,
                  path + ": a glTF names no asset; add --asset with the one that was baked from it");
    scene.objects.front().nif = asset;
  } else if (!asset.empty()) {
    throw Error(Status::usage, fmt::format("--asset {}: {} names its assets itself", asset, path));
  }
  for (size_t i = 0; i < scene.objects.size(); ++i)
    if (!scene.objects[i].nif)
      throw Error(Status::malformed_scene,
                  fmt::format("{}: object {} ({}) has no asset: nif bench needs 'nif' in each object", path,
                              i + 1, scene.objects[i].mesh));
  return scene;
}

}  // namespace

BenchScene::BenchScene(const std::string& path, const std::string& asset, const std::string& configuration,
                       Progress& progress)
    : path_(path), configuration_(configuration) {
  const render::SceneDescription description = read_objects(path, asset);
  struct Known {
    size_t asset;
    uint32_t first_object;
  };
  std::map<std::pair<std::string, std::string>, Known> known;  // by the paths of mesh and asset
  for (const render::ObjectDescription& object : description.objects) {
    const auto [found, fresh] =
        known.try_emplace({object.mesh, *object.nif}, Known{assets_.size(), uint32_t(objects_.size())});
    if (fresh) {
      assets_.push_back(std::make_unique<MeasuredAsset>(*object.nif, object.mesh, configuration_, progress));
      for (uint32_t i = 0; i < assets_.back()->objects().size(); ++i) {
        objects_.push_back(&assets_.back()->objects()[i]);
        sources_.push_back({found->second.asset, i});
      }
    }
    for (bake::Placed& placed : assets_[found->second.asset]->instances()) {
      const mesh::Transform whole = mesh::compose(object.transform, placed.transform);
      if (mesh::determinant(whole) == 0) continue;  // as nif render does
      instances_.push_back({found->second.first_object + placed.object, whole});
    }
  }
  if (instances_.empty())
    throw Error(Status::malformed_scene,
                path +
                    ": places nothing, or no instance that its transform does not flatten; give nif bench an "
                    "asset and its mesh (--mesh) instead of a scene");
}

uint64_t BenchScene::triangles() const {
  uint64_t sum = 0;
  for (const bake::Prepared* object : objects_) sum += object->surface.triangles.size();
  return sum;
}

uint64_t BenchScene::placed_triangles() const {
  uint64_t sum = 0;
  for (const bake::Placed& placed : instances_) sum += objects_[placed.object]->surface.triangles.size();
  return sum;
}

Scene BenchScene::scene(uint32_t threads) const {
  Device device;
  check(nifNewDevice(fmt::format("{},threads={}", configuration_, threads).c_str(), nullptr, &device.handle));
  std::vector<Asset> loaded(assets_.size());
  for (size_t i = 0; i < assets_.size(); ++i)
    check(nifLoadAssetFile(device.handle, assets_[i]->path().c_str(), NIF_LOAD_COPY, &loaded[i].handle));
  Scene scene;
  check(nifNewScene(device.handle, &scene.handle));
  for (const bake::Placed& placed : instances_) {
    const Source& source = sources_[placed.object];
    const NifError error = nifAddInstance(scene.handle, loaded[source.asset].handle, source.object,
                                          placed.transform.data(), nullptr);
    if (error == NIF_ERROR_SINGULAR_TRANSFORM || error == NIF_ERROR_INVALID_ARGUMENT)
      throw Error(Status::malformed_scene, fmt::format("{}: {}", path_, nifGetErrorMessage()));
    check(error);
  }
  check(nifCommitScene(scene.handle));
  return scene;
}

}  // namespace nif::tools
