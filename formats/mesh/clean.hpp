// Prepares a mesh for geometry: merges equal positions, removes triangles without area and duplicates.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/mesh/scene.hpp"

namespace nif::mesh {

struct CleanReport {
  uint64_t degenerate = 0;        ///< triangles without area, the slivers among them
  uint64_t duplicate = 0;         ///< triangles that another one, facing the same way, already covers
  uint64_t welded_positions = 0;  ///< used positions that equalled an earlier one
};

struct CleanMesh {
  std::vector<Float3> positions;    ///< used ones, each once, in the order of the mesh; -0 became +0
  std::vector<Triangle> triangles;  ///< with an area, each once, in the order of the mesh; a triangle and its
                                    ///< opposite-facing twin are both kept
  std::vector<Triangle> slivers;    ///< three distinct but exactly collinear vertices, each once. They hide
                                    ///< nothing, but a test for closure must count their edges: without them,
                                    ///< the edges of their neighbours look open.
  std::vector<uint32_t> sliver_numbers;  ///< which ones of the mesh the slivers are: ascending
  std::vector<uint32_t> dropped;         ///< triangles of the mesh that are not among `triangles`, ascending
  CleanReport report;
};

/// Of each triangle of the clean mesh, which one of the mesh it is: ascending.
std::vector<uint32_t> source_triangles(const CleanMesh& clean);

/// Welding compares bits and collinearity is decided exactly, so the result depends on nothing but the mesh.
/// `mesh` must have passed the checks of read(). Throws Error all_degenerate where no triangle has an area.
CleanMesh clean(const Mesh& mesh);

/// The same for those that take a mesh as it is: where no triangle has an area, the result has none. With
/// `welded` off, positions stay apart that are equal, as the mesh has them.
CleanMesh clean_or_nothing(const Mesh& mesh, bool welded = true);

}  // namespace nif::mesh
