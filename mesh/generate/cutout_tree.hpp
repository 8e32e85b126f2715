// Trees as games draw them: limbs as tubes, and twigs with leaves as quads that show a picture with alpha.
#pragma once

#include <cstdint>
#include <string_view>

#include "formats/mesh/mesh_scene.hpp"
#include "formats/mesh/paint.hpp"
#include "mesh/generate/shape.hpp"
#include "mesh/generate/tree_limbs.hpp"
#include "mesh/generate/twig_picture.hpp"

namespace nif::generate {

/// A kind of tree.
struct TreeKind {
  std::string_view name;
  Habit habit;
  Foliage foliage;
  std::array<float, 3> bark;  ///< linear RGB
  double leafage;             ///< area of all quads: the square of this
  double longest;             ///< side of a quad, if there are few
  double rise;                ///< upward component of the direction of twigs
};

/// Oak, birch, poplar, willow and spruce. The first is what `tree` grows.
inline constexpr size_t kTreeKinds = 5;
const TreeKind& tree_kind(size_t kind);

/// A mesh with materials 0, bark, and 1, twigs, of a paint with add_materials(). At most request.triangles. Its surfaces
/// are not closed.
mesh::Mesh make_cutout_mesh(const TreeKind& kind, const Request& request);

/// Appends the materials of a kind, whose picture the seed varies.
void add_materials(const TreeKind& kind, uint64_t seed, mesh::Paint& paint);

/// A scene and its materials.
struct PaintedScene {
  mesh::Scene scene;
  mesh::Paint paint;
};

/// One tree. Throws Error(usage) if the number of triangles is out of range.
PaintedScene make_cutout_tree(const Request& request);

}  // namespace nif::generate
