// Handles OpenVDB's peculiarities: it winds faces the other way; a shell is an unsigned distance, shifted;
// and a file contains a random UUID, which is set to zero so that the bytes repeat.
#include "mesh/volume/volume.hpp"

#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/ValueTransformer.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <cmath>
#include <sstream>

#include "formats/base/status.hpp"
#include "mesh/volume/level_set.hpp"

// OpenVDB's library has instances of these trees and grids. Without these lines, GCC 12 compiles all of their
// code again, which takes half a minute. Their inline functions are not in the library; clang, and GCC
// without optimisation, would look for them there.
#if defined(__OPTIMIZE__) && !defined(__clang__)
extern template class openvdb::tree::Tree<openvdb::BoolTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;
extern template class openvdb::Grid<openvdb::BoolTree>;
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::Int32Tree>;
#endif

namespace nif::volume {
namespace {

/// The interface that OpenVDB requires of a mesh.
struct Adapter {
  const mesh::Mesh& mesh;
  double scale;

  size_t polygonCount() const { return mesh.triangles.size(); }
  size_t pointCount() const { return mesh.positions.size(); }
  size_t vertexCount(size_t) const { return 3; }
  void getIndexSpacePoint(size_t polygon, size_t corner, openvdb::Vec3d& out) const {
    const mesh::Float3& p = mesh.positions[mesh.triangles[polygon][corner]];
    out = openvdb::Vec3d(p[0], p[1], p[2]) * scale;
  }
};

bool has_inside(const openvdb::FloatGrid& grid) {
  for (auto value = grid.cbeginValueAll(); value; ++value)
    if (*value < 0) return true;
  return false;
}

/// A .vdb begins with eight bytes of identifier, three 32-bit numbers and a flag; then come 36 characters of
/// a random UUID.
constexpr size_t kUuid = 8 + 3 * 4 + 1, kUuidLength = 36;

std::string encode(const openvdb::GridBase::Ptr& grid) {
  std::ostringstream out(std::ios_base::binary);
  openvdb::io::Stream(out).write(openvdb::GridCPtrVec{grid});
  std::string bytes = std::move(out).str();
  if (bytes.size() < kUuid + kUuidLength) throw Error(Status::internal, "OpenVDB wrote no file");
  for (size_t i = 0; i < kUuidLength; ++i)
    if (bytes[kUuid + i] != '-') bytes[kUuid + i] = '0';
  return bytes;
}

template <class Grid>
mesh::Mesh surface_of(const Grid& grid, double adaptivity) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0, adaptivity);
  mesh::Mesh out;
  out.positions.reserve(points.size());
  for (const openvdb::Vec3s& p : points) out.positions.push_back({p[0], p[1], p[2]});
  out.triangles.reserve(triangles.size() + 2 * quads.size());
  // OpenVDB winds faces clockwise as seen from outside.
  for (const openvdb::Vec3I& t : triangles) out.triangles.push_back({t[2], t[1], t[0]});
  for (const openvdb::Vec4I& q : quads) {
    out.triangles.push_back({q[2], q[1], q[0]});
    out.triangles.push_back({q[3], q[2], q[0]});
  }
  return out;
}

}  // namespace

void initialize_openvdb() {
  static const bool once = [] {
    openvdb::initialize();
    return true;
  }();
  (void)once;
}

openvdb::FloatGrid::Ptr distances(const mesh::Mesh& mesh, double voxel, double band) {
  initialize_openvdb();
  return openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      Adapter{mesh, 1 / voxel}, *openvdb::math::Transform::createLinearTransform(voxel), float(band), 0,
      openvdb::tools::UNSIGNED_DISTANCE_FIELD);
}

openvdb::FloatGrid::Ptr level_set(const mesh::Mesh& mesh, const Sampling& sampling) {
  initialize_openvdb();
  openvdb::FloatGrid::Ptr grid;
  if (sampling.thickness > 0) {
    const double half = sampling.thickness / 2;
    grid = distances(mesh, sampling.voxel, half / sampling.voxel + kBand);
    openvdb::tools::foreach (grid->beginValueAll(),
                             [half](const auto& value) { value.setValue(*value - float(half)); });
    openvdb::tools::changeBackground(grid->tree(), grid->background() - float(half));
  } else {
    grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        Adapter{mesh, 1 / sampling.voxel}, *openvdb::math::Transform::createLinearTransform(sampling.voxel),
        kBand, kBand);
  }
  if (!has_inside(*grid))
    throw Error(
        Status::all_degenerate,
        "mesh '" + mesh.name +
            "' encloses nothing at this voxel size; fill its holes (nif mesh repair --fill-holes), or give "
            "it a --thickness");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

uint64_t memory_estimate(double area, const Sampling& sampling) {
  // Measured: the dragon at 1024 voxels takes 0.31 kB for each voxel that its surface would fill if it were
  // flat.
  const double layers = 1 + sampling.thickness / sampling.voxel / (2 * kBand);
  const double bytes = area / (sampling.voxel * sampling.voxel) * 500 * layers;
  return bytes < 1e18 ? uint64_t(bytes) : uint64_t(1e18);
}

mesh::Mesh remesh(const mesh::Mesh& mesh, const Sampling& sampling, double adaptivity) {
  mesh::Mesh out = surface_of(*level_set(mesh, sampling), adaptivity);
  out.name = mesh.name;
  return out;
}

VolumeFile make_vdb(const mesh::Mesh& mesh, const Sampling& sampling, Kind kind, const Double3& offset) {
  openvdb::GridBase::Ptr grid = level_set(mesh, sampling);
  if (kind == Kind::occupancy) {
    grid = openvdb::tools::sdfInteriorMask(*openvdb::gridPtrCast<openvdb::FloatGrid>(grid));
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  }
  if (offset != Double3{}) grid->transform().postTranslate({offset[0], offset[1], offset[2]});
  grid->setName(mesh.name);
  VolumeFile file;
  file.voxels = grid->activeVoxelCount();
  const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  for (int axis = 0; axis < 3; ++axis) file.size[size_t(axis)] = uint32_t(box.dim()[axis]);
  file.bytes = encode(grid);
  return file;
}

LevelSets read_vdb(const std::string& path) {
  initialize_openvdb();
  LevelSets found;
  try {
    openvdb::io::File file(path);
    file.open(false);
    const openvdb::GridPtrVecPtr grids = file.getGrids();
    for (const openvdb::GridBase::Ptr& grid : *grids) {
      const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
      const auto doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid);
      if (grid->getGridClass() != openvdb::GRID_LEVEL_SET || !(floats || doubles)) {
        found.notes.push_back(path + ": left out grid '" + grid->getName() + "', which is not a level set");
        continue;
      }
      found.meshes.push_back(floats ? surface_of(*floats, 0) : surface_of(*doubles, 0));
      found.meshes.back().name = grid->getName();
    }
  } catch (const openvdb::Exception& error) {
    throw Error(Status::malformed_mesh, path + ": OpenVDB cannot read it (" + error.what() + ")");
  }
  return found;
}

}  // namespace nif::volume
