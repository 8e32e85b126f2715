// Describes in text which bake a checkpoint belongs to: the program, the mesh and the options. A resumed bake
// compares these texts, so they must name every option that can change the bytes of an asset.
#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "bake/checkpoint.hpp"
#include "bake/options.hpp"
#include "bake/spherical/describe_spherical.hpp"
#include "formats/nif/crc32c.hpp"

namespace nif::bake {
namespace {

/// Increase this if what a trainer stores changes.
constexpr uint32_t kCheckpointVersion = 1;

template <class T>
std::string shown(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : "-";
}

uint32_t checksum_of(const mesh::Scene& scene) {
  uint32_t sum = 0;
  const auto add = [&](const auto& values) { sum = format::crc32c(std::as_bytes(std::span(values)), sum); };
  std::map<const mesh::AlphaMap*, size_t> maps;  // meshes share them
  for (const mesh::Mesh& mesh : scene.meshes) {
    const std::array counts{mesh.positions.size(), mesh.triangles.size()};
    add(counts), add(mesh.positions), add(mesh.triangles), add(mesh.alpha), add(mesh.holes);
    for (const auto& map : mesh.alpha_maps) {
      const auto [known, fresh] = maps.try_emplace(map.get(), maps.size());
      add(std::array{known->second});
      if (fresh) add(std::array{map->width, map->height}), add(map->wrap), add(map->tiles);
    }
  }
  for (const mesh::Instance& instance : scene.instances)
    add(std::array{instance.mesh}), add(instance.transform), add(instance.remainder);
  return sum;
}

}  // namespace

BakeKey key_of(const mesh::Scene& scene, const BakeOptions& options, std::string_view inputs) {
  const SphericalBakeOptions& spherical = options.spherical;
  std::string text = fmt::format(
      "encoding {} preset {} seed {} strict {} uncoded {} source-triangles {} deforms {} colors {} max-bytes "
      "{} "
      "max-error "
      "{} open-rays {} effort {} rays {} scale {} resolution {}",
      options.encoding, name_of(options.preset), options.seed, options.strict, options.uncoded,
      options.source_triangles, options.deforms, options.colors, shown(options.max_bytes),
      shown(options.max_error), options.open_rays, shown(options.effort), options.evaluation_rays,
      options.scale, shown(options.resolution));
  if (options.prefer) text += fmt::format(" prefer {}", name_of(*options.prefer));
  if (options.error_limit)
    text +=
        fmt::format(" error_limit {} {}", name_of(options.error_limit->mistake), options.error_limit->rate);
  if (options.mix)
    for (const double share : *options.mix) text += fmt::format(" mix {}", share);
  for (const std::string& name : scene.choice.only) text += fmt::format(" only '{}'", name);
  for (const std::string& name : scene.choice.except) text += fmt::format(" except '{}'", name);
  text += " spherical " + to_json(spherical).dump();
  if (spherical.given)
    text += fmt::format(" given {} {} {}", spherical.given->name, spherical.given->rounds,
                        bool(spherical.given->draw_primary));
  return {fmt::format("{} {}", NIF_VERSION_STRING, kCheckpointVersion),
          fmt::format("{:016x} {:08x}", scene.source_hash, checksum_of(scene)),
          fmt::format("{} {}", text, inputs)};
}

}  // namespace nif::bake
