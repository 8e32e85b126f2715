// Groups meshes by their counts and a hash (XXH3), then compares them in full, so that two different meshes
// with the same hash stay apart. Zeros of both signs must have the same hash, because they compare as equal.
#include "formats/mesh/alike.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <tuple>

#include "formats/mesh/skin.hpp"

namespace nif::mesh {
namespace {

/// Equal for lists that `==` calls equal: -0 is 0.
template <size_t kCount>
uint64_t hash_of(std::span<const std::array<float, kCount>> list, uint64_t seed) {
  std::array<std::array<float, kCount>, 1024> part;
  while (!list.empty()) {
    const size_t count = std::min(list.size(), part.size());
    for (size_t i = 0; i < count; ++i)
      for (size_t k = 0; k < kCount; ++k) part[i][k] = list[i][k] + 0.0f;
    seed = XXH3_64bits_withSeed(part.data(), count * sizeof(part[0]), seed);
    list = list.subspan(count);
  }
  return seed;
}

uint64_t hash_of(const Mesh& mesh, bool looks) {
  uint64_t hash = hash_of<3>(mesh.positions, 0);
  hash = XXH3_64bits_withSeed(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle), hash);
  hash = XXH3_64bits_withSeed(mesh.alpha.data(), mesh.alpha.size() * sizeof(TriangleAlpha), hash);
  hash = XXH3_64bits_withSeed(mesh.holes.data(), mesh.holes.size() * sizeof(TriangleHoles), hash);
  if (!looks) return hash;
  const Appearance& look = mesh.look;
  hash = hash_of<2>(look.coordinates, hash_of<3>(look.colors, hash));
  return XXH3_64bits_withSeed(look.materials.data(), look.materials.size() * sizeof(look.materials[0]), hash);
}

/// Maps that meshes share are not looked into.
bool holes_alike(const Mesh& a, const Mesh& b) {
  return a.holes == b.holes &&
         std::ranges::equal(a.alpha_maps, b.alpha_maps, [](const auto& one, const auto& other) {
           return one == other || *one == *other;
         });
}

}  // namespace

std::vector<uint32_t> first_alike(std::span<const Mesh> meshes, bool looks) {
  if (meshes.size() == 1) return {0};
  std::map<std::tuple<size_t, size_t, uint64_t>, std::vector<uint32_t>> alike;  // one mesh of each content
  std::vector<uint32_t> firsts;
  for (uint32_t m = 0; m < meshes.size(); ++m) {
    const Mesh& mesh = meshes[m];
    std::vector<uint32_t>& candidates =
        alike[{mesh.positions.size(), mesh.triangles.size(), hash_of(mesh, looks)}];
    const auto found = std::ranges::find_if(candidates, [&](uint32_t other) {
      return mesh.positions == meshes[other].positions && mesh.triangles == meshes[other].triangles &&
             mesh.alpha == meshes[other].alpha && holes_alike(mesh, meshes[other]) &&
             bend_alike(mesh.skin.get(), meshes[other].skin.get()) &&
             (!looks || mesh.look == meshes[other].look);
    });
    firsts.push_back(found == candidates.end() ? m : *found);
    if (found == candidates.end()) candidates.push_back(m);
  }
  return firsts;
}

}  // namespace nif::mesh
