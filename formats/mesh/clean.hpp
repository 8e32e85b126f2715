// Prepares a mesh for geometric algorithms: merges equal positions, removes triangles without area, duplicates, and
// those that block nothing.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

struct CleanReport {
  uint64_t degenerate = 0;  ///< triangles without area, including slivers
  uint64_t clear = 0;       ///< triangles that block nothing: TriangleAlpha::clear
  /// Triangles that another one with the same corners and facing already covers: one without holes, or with the same.
  uint64_t duplicate = 0;
  uint64_t welded_positions = 0;  ///< used positions that were equal to an earlier one
};

struct CleanMesh {
  std::vector<Float3> positions;    ///< used ones, each once, in the order of the mesh; -0 became +0
  std::vector<Triangle> triangles;  ///< with an area, each once, in the order of the mesh; a triangle and its
                                    ///< opposite-facing twin are both kept
  std::vector<Triangle> slivers;    ///< three distinct but exactly collinear vertices, each once. They hide
                                    ///< nothing, but a test for closure must count their edges: without them,
                                    ///< the edges of their neighbours look open.
  std::vector<uint32_t> sliver_numbers;  ///< numbers of the slivers in the mesh, ascending
  std::vector<uint32_t> dropped;         ///< triangles of the mesh that are not in `triangles`, ascending
  AlphaMaps alpha_maps;                  ///< those of the mesh
  std::vector<TriangleHoles> holes;      ///< [triangles]; empty: none has holes. Slivers have none
  CleanReport report;
};

/// For each triangle of the clean mesh, its number in the mesh: ascending.
std::vector<uint32_t> source_triangles(const CleanMesh& clean);

/// Removes the triangles of a scene that block nothing, meshes that have no others, and their instances.
void drop_clear(Scene& scene);

/// Welding compares bits and collinearity is decided exactly, so the result depends only on the mesh. `mesh`
/// must have passed the checks of read(). Throws Error(all_degenerate) if no triangle has an area and blocks
/// something.
CleanMesh clean(const Mesh& mesh);

/// The same for callers that accept any mesh: if no triangle has an area, the result has none. Without
/// `welded`, equal positions stay separate, as in the mesh.
CleanMesh clean_or_nothing(const Mesh& mesh, bool welded = true);

}  // namespace nif::mesh
