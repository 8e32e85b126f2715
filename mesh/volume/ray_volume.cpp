// A level set traced by OpenVDB, and voxel bits traversed by DDA, which skips empty leaves. Both use a flat
// tree, because OpenVDB's usual one takes more memory than such small volumes.
#include "mesh/volume/ray_volume.hpp"

#include <openvdb/math/DDA.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/RayIntersector.h>

#include <algorithm>
#include <cmath>

#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"
#include "mesh/volume/level_set.hpp"

namespace nif::volume {
namespace {

using Ray = openvdb::math::Ray<double>;
using kernels::Segment;

/// OpenVDB's usual trees have an upper level whose first node takes 0.26 MB, more than these volumes.
template <class Value>
using FlatGrid = openvdb::Grid<typename openvdb::tree::Tree3<Value, 4, 3>::Type>;

/// The mesh moved so that all coordinates are above 0. Otherwise voxels lie on both sides of the origin,
/// where nodes of the tree begin. `shift` is the translation.
mesh::Mesh moved(const mesh::Mesh& mesh, double voxel, openvdb::Vec3d& shift) {
  mesh::Mesh copy;
  copy.name = mesh.name;
  copy.triangles = mesh.triangles;
  copy.positions = mesh.positions;
  const mesh::Box box = mesh::bounds(mesh.positions, mesh.triangles);
  for (int axis = 0; axis < 3; ++axis) {
    shift[axis] = (kBand + 2) * voxel - double(box.min[size_t(axis)]);
    for (mesh::Float3& position : copy.positions)
      position[size_t(axis)] = float(position[size_t(axis)] + shift[axis]);
  }
  return copy;
}

/// The common part of both volumes: a grid over a mesh that was moved.
template <class Value>
class GridVolume : public RayVolume {
 public:
  using Grid = FlatGrid<Value>;
  GridVolume(double voxel, const openvdb::Vec3d& shift) : voxel_(voxel), shift_(shift) {
    initialize_openvdb();
  }
  uint64_t bytes() const override { return grid_->memUsage(); }

 protected:
  /// To be called once the grid is complete.
  void close() {
    box_ = grid_->evalActiveVoxelBoundingBox();
    box_.expand(1);
  }
  /// The part of a segment within the box, in voxels, with t unchanged. Returns false if there is none.
  bool clip(const Segment& segment, double skip, Ray& out) const {
    const openvdb::Vec3d origin(segment.origin[0], segment.origin[1], segment.origin[2]),
        direction(segment.direction[0], segment.direction[1], segment.direction[2]);
    const double start = segment.tmin + skip * voxel_ / direction.length();
    const double end = std::isfinite(segment.tmax) ? double(segment.tmax) : 1e30;
    if (!(start < end)) return false;
    out = Ray((origin + shift_) / voxel_, direction / voxel_, start, end);
    return out.clip(box_);
  }

  double voxel_;
  openvdb::Vec3d shift_;
  openvdb::CoordBBox box_;
  typename Grid::Ptr grid_;
};

class DistanceVolume : public GridVolume<float> {
 public:
  DistanceVolume(const mesh::Mesh& mesh, double voxel, const openvdb::Vec3d& shift)
      : GridVolume(voxel, shift) {
    const openvdb::FloatGrid::Ptr distances = level_set(mesh, {voxel, 0});
    require_inside(*distances, mesh.name);
    grid_ = Grid::create(distances->background());
    grid_->setGridClass(openvdb::GRID_LEVEL_SET);
    grid_->setTransform(openvdb::math::Transform::createLinearTransform(voxel));  // for its tracer
    for (auto leaf = distances->tree().cbeginLeaf(); leaf; ++leaf)
      grid_->tree().addLeaf(new Grid::TreeType::LeafNodeType(*leaf));
    close();
  }

  void ask(std::span<const Segment> rays, double skip, uint8_t* visible) const override {
    const openvdb::tools::LevelSetRayIntersector<Grid> tracer(*grid_);
    Ray ray;
    for (size_t i = 0; i < rays.size(); ++i)
      visible[i] = !clip(rays[i], skip, ray) || !tracer.intersectsIS(normalised(ray));
  }

 private:
  /// Half of the voxels near a solid are inside it; near a sheet hardly any are, and only by errors of the
  /// sign.
  static void require_inside(const openvdb::FloatGrid& distances, const std::string& name) {
    uint64_t inside = 0, all = 0;
    for (auto value = distances.cbeginValueOn(); value; ++value, ++all) inside += *value < 0;
    if (inside * 10 >= all) return;
    throw Error(
        Status::all_degenerate,
        "mesh '" + name + "' is open: of the voxels near it, less than a tenth are inside of anything");
  }
  /// The tracer needs directions of unit length.
  static Ray normalised(const Ray& ray) {
    const double length = ray.dir().length();
    return Ray(ray.eye(), ray.dir() / length, ray.t0() * length, ray.t1() * length);
  }
};

class VoxelVolume : public GridVolume<openvdb::ValueMask> {
 public:
  VoxelVolume(const mesh::Mesh& mesh, double voxel, const openvdb::Vec3d& shift) : GridVolume(voxel, shift) {
    grid_ = Grid::create();
    const openvdb::FloatGrid::Ptr near = distances(mesh, voxel, 1);
    Grid::Accessor accessor = grid_->getAccessor();
    for (auto value = near->cbeginValueOn(); value; ++value)
      if (*value <= 0.5 * voxel) accessor.setValueOn(value.getCoord());
    close();
  }

  void ask(std::span<const Segment> rays, double skip, uint8_t* visible) const override {
    const Grid::ConstAccessor accessor = grid_->getConstAccessor();
    Ray ray;
    for (size_t i = 0; i < rays.size(); ++i) visible[i] = !clip(rays[i], skip, ray) || !meets(accessor, ray);
  }

 private:
  using Leaf = Grid::TreeType::LeafNodeType;

  /// Skips leaves without voxels.
  static bool meets(const Grid::ConstAccessor& accessor, const Ray& ray) {
    // Voxels are centred on their coordinates; OpenVDB's DDA steps between cells whose corners are there.
    const Ray shifted(ray.eye() + openvdb::Vec3d(0.5), ray.dir(), ray.t0(), ray.t1());
    openvdb::math::DDA<Ray, Leaf::LOG2DIM> leaves(shifted);
    do {
      const double from = leaves.time(), to = std::max(from, leaves.next());
      const Leaf* leaf = accessor.probeConstLeaf(leaves.voxel());
      if (!leaf) continue;
      const openvdb::Coord first = leaf->origin();
      openvdb::math::DDA<Ray, 0> voxels(shifted, from, to);
      do {
        // Rounding may put the first or the last voxel just outside the leaf.
        const openvdb::Coord voxel = openvdb::Coord::maxComponent(
            first, openvdb::Coord::minComponent(voxels.voxel(), first.offsetBy(Leaf::DIM - 1)));
        if (leaf->isValueOn(voxel)) return true;
      } while (voxels.step());
    } while (leaves.step());
    return false;
  }
};

template <class Volume>
std::unique_ptr<RayVolume> make(const mesh::Mesh& mesh, double voxel) {
  openvdb::Vec3d shift;
  const mesh::Mesh copy = moved(mesh, voxel, shift);
  return std::make_unique<Volume>(copy, voxel, shift);
}

}  // namespace

std::unique_ptr<RayVolume> distance_volume(const mesh::Mesh& mesh, double voxel) {
  return make<DistanceVolume>(mesh, voxel);
}

std::unique_ptr<RayVolume> voxel_volume(const mesh::Mesh& mesh, double voxel) {
  return make<VoxelVolume>(mesh, voxel);
}

}  // namespace nif::volume
