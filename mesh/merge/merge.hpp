// Merges the static instances of a scene into few meshes, by space, so that thousands of small meshes become
// tens of objects. Copies of a mesh take memory again, so a budget says how many there may be.
#pragma once

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Meshes with so many triangles or more stay: for them, reading copies costs more than an instance less
/// saves.
inline constexpr uint64_t kPartTriangles = 500;
/// The most of a merged mesh. 452,000 triangles of 5,000 meshes answered faster in 4 objects than in 16, and
/// much the same in 1. But objects of 200,000 or more are learned by default (bake/choice.hpp).
inline constexpr uint64_t kObjectTriangles = 150'000;
/// What merging may add where nobody says: so much if that is enough for all that could merge, else nothing.
/// Some of many copies are in the way of those that stay, and all of them are too much for caches.
inline constexpr uint64_t kAddedTriangles = 1'000'000;

/// The scene with fewer instances and the same triangles at the same places. Positions are rounded once, to
/// single precision (FlatScene); mirrored instances have their triangles turned. Instances that stay keep
/// their order and come first. The merged ones follow, each with a mesh of its own, at the identity. Meshes
/// that nothing places any more go. Nodes stay as they are. `merging` of the result says what became of each
/// instance.
///
/// An instance merges if it is named, does not move, is small, has room in the budget and a neighbour. Meshes
/// with few triangles come first, each with all of its instances: those save most for what they add. One that
/// does not fit any more stays whole. What merges is then cut in two along the longest axis, by the centres
/// of boxes and by triangles, until each part has at most so many triangles as a merged mesh may have. Equal
/// meshes count as one.
///
/// `scene` is as read() gives it and not merged yet. The result depends on no number of threads. Throws
/// Error(too_large) where there is not enough memory.
Scene merge(Scene scene, const MergeOptions& options);

}  // namespace nif::mesh
