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
#include "nif/nif.h"
#include "scene/kernel.hpp"

struct NifAssetObject;

namespace nif::runtime {

struct GpuAsset;

/// A vertex: x, y, z and 0.
struct alignas(16) Vertex {
  float at[4];
};

/// The vertices of an object's source that nifSetInstanceVertices takes; 0 if its instances do not bend.
uint64_t bending_vertices(const format::AssetView& asset, uint32_t object);

/// What the instances of an object share that bend, read from its asset.
class BendingObject {
 public:
  /// The asset must outlive it. Its object must have bending_vertices().
  BendingObject(const format::AssetView& asset, uint32_t object, std::pmr::memory_resource* memory);

  const kernels::TrianglesField& field() const { return *field_; }
  const kernels::SkinField* skin() const { return skin_; }  ///< null if there is none
  // Vertices of the source that triangles have are numbered without gaps, in their order.
  std::span<const uint32_t> sources() const { return sources_; }           ///< their numbers in the source
  std::span<const Vertex> rest() const { return rest_; }                   ///< where they are at rest
  uint32_t vertex_of(uint32_t stored) const { return vertices_[stored]; }  ///< of a vertex of the field
  const uint32_t (*corners() const)[3] { return reinterpret_cast<const uint32_t(*)[3]>(corners_.data()); }
  size_t bytes() const {
    return rest_.capacity() * sizeof(Vertex) +
           (sources_.capacity() + vertices_.capacity() + corners_.capacity()) * sizeof(uint32_t);
  }

 private:
  const kernels::TrianglesField* field_;
  const kernels::SkinField* skin_;
  std::pmr::vector<uint32_t> sources_, vertices_, corners_;
  std::pmr::vector<Vertex> rest_;
};

class BentObject {
 public:
  /// At rest. `shared` must outlive it. `nodes`: keeps nodes and vertices as in a file up to date, for a GPU.
  BentObject(const BendingObject& shared, const KernelChoice& choice, bool nodes, SharedCopies& copies,
             std::pmr::memory_resource* memory);

  const BendingObject& shared() const { return *shared_; }
  const kernels::ObjectKernel* kernel() const { return kernel_.get(); }
  /// Its extent and its root are those of the last refit().
  const kernels::TrianglesField& field() const { return field_; }

  /// These change nothing if they throw Failure; they take effect by refit().
  void set_vertices(const float* positions, uint64_t stride);
  void pose(const NifPose& pose);
  void rest();

  /// Returns false if nothing has changed since the last one. Allocates nothing.
  bool refit();
  size_t bytes() const;

  GpuAsset* on_gpu = nullptr;  ///< the runtime's GPU frees it

 private:
  void move_by_skin(const NifPose& pose);

  const BendingObject* shared_;
  std::pmr::vector<Vertex> positions_;  ///< as BendingObject::rest()
  std::pmr::vector<Vertex> joints_;     ///< [joint][column of its matrix]
  std::pmr::vector<kernels::BvhNode> nodes_;
  std::pmr::vector<float> vertices_;
  std::pmr::vector<kernels::VertexBox> boxes_;  ///< with nodes and vertices
  kernels::BvhNode root_{};                     ///< without them
  kernels::TrianglesField field_;
  KernelPointer kernel_;
  bool changed_ = true;
};

}  // namespace nif::runtime
