// Quads grow on the two finest levels of limbs. Together they have about the same area, whatever their number.
#include "mesh/generate/cutout_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/base/memory.hpp"
#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "mesh/generate/axes.hpp"
#include "mesh/generate/tree_tubes.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kCardStream = 0x63617264;  // "card"
constexpr uint32_t kBark = 0, kTwig = 1;      // materials

constexpr double kAround = 0.41421356237309505;

constexpr std::array<TreeKind, kTreeKinds> kTrees{{
    {.name = "oak",
     .habit = {.around = kAround},
     .foliage = {.length = 0.2,
                 .width = 0.55,
                 .angle = 0.15,
                 .pairs = 5,
                 .twigs = 5,
                 .twig = 0.5,
                 .lobes = 0.3,
                 .dark = {38, 66, 22},
                 .light = {96, 132, 48}},
     .bark = {0.13f, 0.1f, 0.07f},
     .leafage = 24,
     .longest = 1.3,
     .rise = 0.1},
    {.name = "birch",
     .habit = {.height = 9.5,
               .base = 0.17,
               .tip = 0.03,
               .lean = 0.2,
               .children = {22, 8, 6, 5, 5},
               .lift = {0, 0.35, -0.2, -0.3, -0.3, -0.3},
               .steepest = -0.5,
               .lowest = 0.28,
               .around = kAround,
               .angle = {0.14, 0.05, 0},
               .length = {0.3, 0, 0.17}},
     .foliage = {.length = 0.14,
                 .width = 0.7,
                 .angle = 0.14,
                 .pairs = 7,
                 .twigs = 6,
                 .twig = 0.48,
                 .lobes = 0,
                 .dark = {58, 92, 30},
                 .light = {128, 160, 62}},
     .bark = {0.62f, 0.6f, 0.56f},
     .leafage = 19,
     .longest = 1.1,
     .rise = -0.25},
    {.name = "poplar",
     .habit = {.height = 13,
               .base = 0.24,
               .tip = 0.03,
               .lean = 0.1,
               .children = {40, 6, 6, 5, 5},
               .lift = {0, 1.1, 0.8, 0.5, 0.2, 0.2},
               .lowest = 0.08,
               .around = kAround,
               .angle = {0.09, 0.03, 0},
               .length = {0.24, 0, 0.12}},
     .foliage = {.length = 0.18,
                 .width = 0.85,
                 .angle = 0.16,
                 .pairs = 6,
                 .twigs = 5,
                 .twig = 0.46,
                 .lobes = 0,
                 .dark = {44, 80, 34},
                 .light = {104, 148, 64}},
     .bark = {0.2f, 0.18f, 0.14f},
     .leafage = 24,
     .longest = 1.2,
     .rise = 0.9},
    {.name = "willow",
     .habit = {.height = 5.2,
               .base = 0.34,
               .tip = 0.1,
               .lean = 0.35,
               .children = {14, 12, 7, 6, 5},
               .lift = {0, 0.1, -1.4, -1.6, -1.6, -1.6},
               .steepest = -0.95,
               .lowest = 0.4,
               .around = kAround,
               .angle = {0.19, 0.08, 0},
               .length = {0.62, 0, 0.2},
               .further = {0.6, 0.1, 0}},
     .foliage = {.length = 0.24,
                 .width = 0.16,
                 .angle = 0.07,
                 .pairs = 11,
                 .twigs = 4,
                 .twig = 0.48,
                 .lobes = 0,
                 .dark = {70, 96, 46},
                 .light = {146, 168, 92}},
     .bark = {0.16f, 0.13f, 0.1f},
     .leafage = 24,
     .longest = 1.3,
     .rise = -1.1},
    {.name = "spruce",
     .habit = {.height = 13.5,
               .base = 0.26,
               .tip = 0.02,
               .lean = 0.04,
               .children = {70, 7, 5, 4, 4},
               .lift = {0, -0.12, -0.1, -0.1, -0.1, -0.1},
               .steepest = -0.6,
               .lowest = 0.07,
               .around = kAround,
               .angle = {0.27, 0.06, 0},
               .length = {0.27, 0.235, 0}},
     .foliage = {.length = 0.1,
                 .width = 0.13,
                 .angle = 0.1,
                 .pairs = 34,
                 .twigs = 8,
                 .twig = 0.5,
                 .lobes = 0,
                 .dark = {22, 48, 30},
                 .light = {64, 96, 56}},
     .bark = {0.15f, 0.1f, 0.07f},
     .leafage = 26,
     .longest = 1.2,
     .rise = -0.2},
}};

/// A quad with a twig, from its base on a limb.
struct Card {
  Double3 base, rib, left;  ///< the latter are as long as its sides
  uint32_t twig;            ///< number in the picture
};

Card card(const TreeKind& kind, const LimbTubes& limbs, uint64_t seed, uint64_t number, uint64_t count) {
  Random random(seed, kCardStream, number);
  // The first ones hide the end of the trunk.
  constexpr uint64_t kTop = 4;
  const bool top = number < kTop;
  const double part = (double(number) + random.uniform()) / double(count);
  const Limb& limb = top ? limbs.trunk() : limbs.leafy(part);
  const double t = top ? 1 - 0.015 * double(number) : random.uniform(0.2, 1);
  const Double3 along = limb.tangent(t), around = random.direction();
  Double3 rib =
      along * (top ? 1.8 : 0.7) + (around - along * dot(around, along)) * 0.9 + Double3{0, kind.rise, 0};
  rib = rib * (1 / std::fmax(length(rib), 0.05));
  // The upper side faces roughly upwards.
  Double3 left = cross(Double3{0, 1, 0} + random.direction() * 0.8, rib);
  const double flat = length(left);
  left = flat > 0.05 ? left * (1 / flat) : perpendicular(unit(rib));
  const double side =
      std::fmin(kind.longest, kind.leafage / std::sqrt(double(count))) * random.uniform(0.75, 1.2);
  // If no finer limbs carry twigs, they are spread around.
  const double reach = top ? 0 : 0.12 * limb.length * random.uniform();
  return {limb.at(t) + (around - along * (0.7 * dot(around, along))) * reach, rib * side, left * side,
          random.below(kTwigs * kTwigs)};
}

void add_card(const Card& card, mesh::Mesh& mesh) {
  const auto first = uint32_t(mesh.positions.size());
  for (const Double3& corner :
       {card.base + card.left * 0.5, card.base - card.left * 0.5, card.base + card.rib - card.left * 0.5,
        card.base + card.rib + card.left * 0.5})
    mesh.positions.push_back(to_float(corner));
  const float side = 1.0f / kTwigs, x = side * float(card.twig % kTwigs),
              y = side * float(card.twig / kTwigs);
  for (const auto& [right, down] : {std::pair{0, 1}, {1, 1}, {1, 0}, {0, 0}})
    mesh.look.coordinates.push_back({x + side * float(right), y + side * float(down)});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

}  // namespace

const TreeKind& tree_kind(size_t kind) { return kTrees[kind]; }

mesh::Mesh make_cutout_mesh(const TreeKind& kind, const Request& request) {
  const LimbTubes limbs(kind.habit, request.seed, request.triangles / 5);
  const uint64_t cards = (request.triangles - limbs.triangle_count()) / 2,
                 vertices = limbs.vertex_count() + 4 * cards, triangles = limbs.triangle_count() + 2 * cards;
  require_memory(vertices * (sizeof(mesh::Float3) + 2 * sizeof(float)) +
                     triangles * (sizeof(mesh::Triangle) + sizeof(uint32_t)),
                 "the tree");
  mesh::Mesh mesh;
  mesh.name = kind.name;
  mesh.positions.reserve(vertices);
  mesh.triangles.reserve(triangles);
  mesh.look.coordinates.reserve(vertices);
  for (uint64_t i = 0; i < limbs.vertex_count(); ++i) mesh.positions.push_back(to_float(limbs.vertex(i)));
  for (uint64_t i = 0; i < limbs.triangle_count(); ++i) mesh.triangles.push_back(limbs.triangle(i));
  mesh.look.coordinates.resize(limbs.vertex_count());
  mesh.look.materials.assign(triangles, kTwig);
  std::fill_n(mesh.look.materials.begin(), limbs.triangle_count(), kBark);
  for (uint64_t i = 0; i < cards; ++i) add_card(card(kind, limbs, request.seed, i, cards), mesh);
  return mesh;
}

void add_materials(const TreeKind& kind, uint64_t seed, mesh::Paint& paint) {
  paint.materials.push_back({fmt::format("{}-bark", kind.name), kind.bark});
  paint.materials.push_back(
      {fmt::format("{}-twigs", kind.name), {1, 1, 1}, uint32_t(paint.pictures.size()), true});
  paint.pictures.push_back(draw_twigs(kind.foliage, seed));
}

PaintedScene make_cutout_tree(const Request& request) {
  if (request.triangles < kFewestTriangles || request.triangles > kMostTriangles)
    throw Error(Status::usage, fmt::format("{} triangles: a tree can have {} to {}", request.triangles,
                                           kFewestTriangles, kMostTriangles));
  PaintedScene made;
  add_materials(kTrees[0], request.seed, made.paint);
  made.scene.meshes.push_back(make_cutout_mesh(kTrees[0], request));
  made.scene.meshes[0].name = "tree";
  made.scene.instances.push_back({"tree", 0});
  return made;
}

}  // namespace nif::generate
