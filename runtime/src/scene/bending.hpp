// Instances that bend: they have vertices of their own, and the tree of their object with boxes around these.
//
// Such an instance has an object of its own in its scene, beside those of the assets, so that nothing that answers a ray
// has to know.
#pragma once

#include <memory_resource>
#include <span>
#include <vector>

#include "formats/nif/reader.hpp"
#include "kernels/reference/triangles/refit.hpp"
#include "kernels/reference/triangles/skin.hpp"
#include "nif/nif.h"
#include "scene/kernel.hpp"

struct NifAssetObject;
struct NifDeviceObject;

namespace nif::runtime {

struct GpuAsset;
struct GpuFetch;

/// A vertex: x, y, z, and what is not a coordinate.
struct alignas(16) Vertex {
  float at[4];
};

/// The vertices of an object's source that nifSetInstanceVertices takes; 0 if its instances do not bend.
uint64_t bending_vertices(const format::AssetView& asset, uint32_t object);

/// What the instances of an object share that bend, read from its asset.
///
/// Vertices of the source that triangles have are numbered anew, without gaps. Those that every pose moves alike are one
/// point: files have several vertices where the normal or the texture changes. A pose moves the points, which come first, in
/// the order in which kernels move them, and of equals that in which the tree has them.
class BendingObject {
 public:
  /// The asset must outlive it. Its object must have bending_vertices().
  BendingObject(const format::AssetView& asset, uint32_t object, std::pmr::memory_resource* memory);
  BendingObject(const BendingObject&) = delete;  // order_ points into it
  BendingObject& operator=(const BendingObject&) = delete;

  const kernels::TrianglesField& field() const { return *field_; }
  const kernels::SkinField* skin() const { return skin_; }  ///< null if there is none
  std::span<const uint32_t> sources() const {
    return sources_;
  }                                                       ///< of each vertex, its number in the source
  std::span<const Vertex> rest() const { return rest_; }  ///< where the points are at rest; the last is 1
  uint32_t last_source() const { return last_source_; }   ///< the highest of them
  const kernels::SkinOrder& skin_order() const { return order_; }  ///< of the points
  /// Of a vertex of the field; if `posed`, the point.
  uint32_t vertex_of(uint32_t stored, bool posed) const {
    return posed && !points_.empty() ? points_[vertices_[stored]] : vertices_[stored];
  }
  /// Of each triangle; if `posed`, points.
  const uint32_t (*corners(bool posed) const)[3] {
    return reinterpret_cast<const uint32_t(*)[3]>(
        (posed && !points_.empty() ? point_corners_ : corners_).data());
  }
  size_t bytes() const {
    return rest_.capacity() * sizeof(Vertex) + weights_.capacity() * sizeof(float) +
           joints_.capacity() * sizeof(uint16_t) +
           (sources_.capacity() + vertices_.capacity() + points_.capacity() + corners_.capacity() +
            point_corners_.capacity()) *
               sizeof(uint32_t);
  }

 private:
  void number_vertices(const kernels::SourceTriangles& numbers);
  uint32_t joints_of(uint32_t source) const;
  int compare_moves(uint32_t source, uint32_t other) const;

  const kernels::TrianglesField* field_;
  const kernels::SkinField* skin_;
  kernels::SkinOrder order_{};
  std::pmr::vector<uint32_t> sources_, vertices_;
  uint32_t last_source_ = 0;
  std::pmr::vector<uint32_t> points_;  ///< of each vertex; empty if each is a point
  std::pmr::vector<uint32_t> corners_, point_corners_;
  std::pmr::vector<Vertex> rest_;
  std::pmr::vector<float> weights_;
  std::pmr::vector<uint16_t> joints_;
};

class BentObject {
 public:
  /// At rest. `shared` must outlive it. `like`: another one with the same first four arguments, which makes this faster;
  /// or null. `nodes`: keeps nodes and vertices as in a file up to date, for a GPU.
  BentObject(const BendingObject& shared, const KernelChoice& choice, bool nodes, SharedCopies& copies,
             const BentObject* like, std::pmr::memory_resource* memory);

  const BendingObject& shared() const { return *shared_; }
  const kernels::ObjectKernel* kernel() const { return kernel_.get(); }
  /// Its extent and its root are those of the last refit().
  const kernels::TrianglesField& field() const { return field_; }

  /// These change nothing if they throw Failure; they take effect by refit().
  void set_vertices(const float* positions, uint64_t stride);
  void pose(const NifPose& pose);  ///< in memory that the CPU can read
  void rest();
  /// A pose in memory of the GPU: fetch() begins to copy it, receive() waits and does what pose() does. Until then it is
  /// expected(), unless one of the above comes later. If fetch() throws before it has begun, nothing changes; if
  /// receive() throws, the pose is no longer expected.
  void fetch(NifDeviceObject& device, const NifPose& pose);
  void receive(NifDeviceObject& device);
  bool expected() const { return expected_.struct_size != 0; }

  /// Moves vertices and boxes, if anything has changed. Allocates nothing. Those of several objects may run at the same time.
  void refit();
  bool changed() const { return changed_; }    ///< since the last refit()
  bool refitted() const { return refitted_; }  ///< since the last forget_refit()
  void forget_refit() { refitted_ = false; }
  size_t bytes() const;

  GpuAsset* on_gpu = nullptr;                     ///< the runtime's GPU frees it
  bool current_on_gpu = false;                    ///< copied since the last refit()
  GpuFetch* fetched() const { return fetched_; }  ///< likewise

 private:
  /// Throws Failure unless the pose is one of this object, whatever its values.
  void check(const NifPose& pose) const;
  void pose_by_skin(const NifPose& pose);
  void move_by_skin();
  kernels::VertexBox box_of_positions() const;

  const BendingObject* shared_;
  std::pmr::vector<Vertex> positions_;             ///< as BendingObject::sources(), or only the points
  std::pmr::vector<kernels::JointMatrix> joints_;  ///< of the last pose
  std::pmr::vector<float> weights_;                ///< of its morph targets
  uint32_t target_count_ = 0;                      ///< that it has: all or none
  std::pmr::vector<kernels::BvhNode> nodes_;
  std::pmr::vector<float> vertices_;
  std::pmr::vector<kernels::VertexBox> boxes_;  ///< with nodes and vertices
  kernels::BvhNode root_{};                     ///< without them
  kernels::TrianglesField field_;
  KernelPointer kernel_;
  bool changed_ = true, refitted_ = false;
  bool posed_ = true;   ///< `positions_` has points, or will have
  bool poses_ = false;  ///< the last pose has not moved them yet
  GpuFetch* fetched_ = nullptr;
  NifPose expected_{};          ///< that is being copied there; struct_size 0: none
  uint64_t fetched_bytes_ = 0;  ///< most that were copied
};

}  // namespace nif::runtime
