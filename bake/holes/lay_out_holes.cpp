// Maps are in the order in which the mesh uses them, and patches in the order in which the object's triangles do: so the
// same mesh gives the same bytes.
#include "bake/holes/lay_out_holes.hpp"

#include <map>
#include <optional>
#include <tuple>

namespace nif::bake {
namespace {

static_assert(uint32_t(mesh::Wrap::repeat) == kernels::kAlphaRepeat &&
              uint32_t(mesh::Wrap::mirror) == kernels::kAlphaMirror &&
              uint32_t(mesh::Wrap::clamp) == kernels::kAlphaClamp);
static_assert(mesh::TriangleHoles::kFraction == kernels::kAlphaFraction &&
              mesh::AlphaMap::kTile == kernels::kAlphaTile &&
              mesh::AlphaMap::kMostSide == kernels::kMaxAlphaSide);

bool same_map(const format::AlphaMaps& all, size_t i, const kernels::AlphaMap& map,
              const format::AlphaMaps::Tiles& tiles) {
  const kernels::AlphaMap& other = all[i];
  return other.width == map.width && other.height == map.height && other.wrap[0] == map.wrap[0] &&
         other.wrap[1] == map.wrap[1] && (all.tiles(i) == tiles || *all.tiles(i) == *tiles);
}

/// The number of a map, which is added if it is not there.
uint32_t number_of(const kernels::AlphaMap& map, const format::AlphaMaps::Tiles& tiles,
                   format::AlphaMaps& all) {
  for (size_t i = 0; i < all.size(); ++i)
    if (same_map(all, i, map, tiles)) return uint32_t(i);
  all.add(map, tiles);
  return uint32_t(all.size() - 1);
}

uint32_t number_of(const std::shared_ptr<const mesh::AlphaMap>& map, format::AlphaMaps& all) {
  kernels::AlphaMap field;
  field.width = map->width;
  field.height = map->height;
  for (size_t a = 0; a < 2; ++a) field.wrap[a] = uint32_t(map->wrap[a]);
  return number_of(field, {map, &map->tiles}, all);
}

}  // namespace

format::HolesData lay_out_holes(const mesh::CleanMesh& mesh, std::span<const uint32_t> order,
                                format::AlphaMaps& maps) {
  std::vector<std::optional<uint32_t>> known(mesh.alpha_maps.size());
  using Key = std::tuple<uint32_t, uint32_t, std::array<std::array<int32_t, 2>, 3>>;
  std::map<Key, uint32_t> patches;
  format::HolesData holes;
  std::vector<uint32_t> numbers;
  numbers.reserve(order.size());
  for (const uint32_t triangle : order) {
    uint32_t& number = numbers.emplace_back(0);
    if (triangle >= mesh.holes.size() || !mesh.holes[triangle].any()) continue;
    const mesh::TriangleHoles& own = mesh.holes[triangle];
    std::optional<uint32_t>& map = known[own.map];
    if (!map) map = number_of(mesh.alpha_maps[own.map], maps);
    const auto [found, is_new] = patches.try_emplace({*map, own.shift, own.places}, uint32_t(patches.size()));
    if (is_new) {
      kernels::AlphaPatch& patch = holes.patches.emplace_back();
      patch.map = *map;
      patch.shift = own.shift;
      for (size_t k = 0; k < 3; ++k)
        for (size_t a = 0; a < 2; ++a) patch.places[k][a] = own.places[k][a];
    }
    number = found->second + 1;
  }
  holes.set_numbers(numbers);
  return holes;
}

void share_alpha_maps(format::HolesData& holes, const format::AlphaMaps& own, format::AlphaMaps& all) {
  std::vector<uint32_t> numbers;
  for (size_t i = 0; i < own.size(); ++i) numbers.push_back(number_of(own[i], own.tiles(i), all));
  for (kernels::AlphaPatch& patch : holes.patches) patch.map = numbers[patch.map];
}

}  // namespace nif::bake
