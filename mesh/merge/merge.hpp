// Merges instances that never move against each other into a few meshes: what is placed once, and small
// copies, by space, so that thousands of small meshes become tens of objects. Copies of a mesh take memory
// again, so there is a budget for them.
#pragma once

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// Meshes with at least this many triangles are not copied: for them, reading copies costs more than having
/// one instance less saves.
inline constexpr uint64_t kPartTriangles = 500;
/// Limit for a merged mesh. 452,000 triangles of 5,000 meshes were answered faster in 4 objects than in 16,
/// and about as fast in 1. But objects of 200,000 or more are learned by default (bake/choice.hpp).
inline constexpr uint64_t kObjectTriangles = 150'000;
/// Default budget for added triangles: this many if that is enough for everything that could merge, otherwise
/// none. Merging only some of many copies slows down the instances that stay, and merging all of them is too
/// much for the caches.
inline constexpr uint64_t kAddedTriangles = 1'000'000;
/// With MergeOptions::few_copies, merging may add one triangle for so many that merge without copies.
inline constexpr uint64_t kTrianglesForAdded = 10;

/// Returns the scene with fewer instances and the same triangles in the same places. Positions are rounded
/// once, to single precision (FlatScene); the triangles of mirrored instances are flipped. Instances that
/// stay keep their order and come first. The merged ones follow, each with its own mesh: at the identity, or
/// if a node moves them all, in the place and at the node of the first that this node moves and that could
/// merge. Meshes that are no longer used are removed. Nodes do not change. `merging` of the result records
/// what became of each instance.
///
/// An instance merges if its name matches, it does not deform, its mesh is placed once or is small and fits
/// the budget, and something near does not move against it. Meshes with few triangles come first, each with
/// all of its instances: they save most for what they add. A mesh that no longer fits keeps all of its
/// instances. The instances that merge are then cut in two along the longest axis, by the centres of their
/// boxes and by triangles, until each part is within the limit for a merged mesh. Equal meshes count as one.
///
/// With MergeOptions::skins, meshes of one skin that are in the same place, each placed once, become one mesh with the joints and
/// weights of all, at the node and in the place of the first. So Poser takes the merged scene as it is: a merged instance has
/// the joints of any of its parts, and a rigid one that moves is where its first part has taken it. With MergeOptions::carried,
/// what a joint of the skin carries is a part, too: what is below the joint's node, without a node between that moves by
/// itself. The joint alone moves it, with weight 1. Copies of small meshes count towards no budget.
///
/// `scene` must come from read() and must not be merged yet. The result does not depend on the number of
/// threads. Throws Error(too_large) if there is not enough memory.
Scene merge(Scene scene, const MergeOptions& options);

/// What merges if nothing is asked for: what is placed once, and what is small if its copies add little to that.
MergeOptions few_copies();

}  // namespace nif::mesh
