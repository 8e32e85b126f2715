// Makes a scene ready for rays: Embree with its meshes, and the runtime with its assets.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/ground_truth/embree_truth.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/transform.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/asset_scene.hpp"
#include "tools/render/picture_scene.hpp"
#include "tools/render/primary_objects.hpp"
#include "tools/render/scene_meshes.hpp"
#include "tools/render/surface_point.hpp"

struct RTCDeviceTy;
struct RTCGeometryTy;
struct RTCSceneTy;

namespace nif::render {

/// Immutable once built; any number of threads may query it. Answers do not depend on the number of threads.
class World {
 public:
  /// Takes over the meshes of a scene's objects ([object], none null), frees each once it is built, and reads
  /// their assets. `configuration` is that of the runtime's device. Throws as loading an asset does, and
  /// Error(mesh_mismatch) if an asset's bounds are not those of its mesh.
  World(const SceneDescription& scene, ObjectMeshes meshes, const std::string& configuration,
        tools::Progress& progress);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Bounds of the objects, without the ground.
  const mesh::Box& box() const { return box_; }
  uint64_t triangles() const { return triangles_; }
  /// Bytes that Embree holds: its BVHs, and the vertices and indices that they refer to.
  uint64_t embree_bytes() const { return uint64_t(embree_bytes_); }

  /// The first hit by Embree in the whole scene, along a direction of unit length.
  std::optional<SurfacePoint> trace(const Double3& origin, const Double3& direction) const;
  /// The same, with fields for primary rays for the objects that have them, of which there must be some, and
  /// Embree for the rest.
  std::optional<SurfacePoint> trace_by_fields(const Double3& origin, const Double3& direction) const;
  /// Whether there are objects with fields for primary rays.
  bool has_primaries() const { return !primaries_.empty(); }

  /// visible[i] = 1 or 0, by Embree in the whole scene.
  void ask_embree(std::span<const Segment> rays, uint8_t* visible) const;
  /// The same for the objects that have no asset.
  void ask_embree_beside_assets(std::span<const Segment> rays, uint8_t* visible) const;

  /// The first hit of each ray, by assets, and by Embree for objects without one. Directions have unit
  /// length. `hits` has the size of `rays`.
  void trace_by_assets(std::span<const Segment> rays, std::span<std::optional<SurfacePoint>> hits) const;

  const AssetScene& assets() const { return assets_; }
  bool has_assets() const { return !assets_.empty(); }
  /// Whether the ray starts within the AABB of a mesh that has an asset.
  bool starts_in_asset(const Segment& ray) const;

 private:
  struct Release {
    void operator()(RTCDeviceTy* device) const;
    void operator()(RTCSceneTy* scene) const;
  };
  /// The AABB of an asset's instance.
  struct AssetBox {
    mesh::Box box;  ///< object space
    mesh::ToObject to_object;
  };
  using EmbreePointer = std::unique_ptr<RTCSceneTy, Release>;
  struct Part {  // indexed by Embree's geometry in everything_
    SurfaceKind kind;
    mesh::Transform normals;  // object to world, for normals; only for instances
  };
  /// What answers for a mesh besides Embree.
  struct Answered {
    bool by_asset = false;    ///< shadow rays
    bool by_primary = false;  ///< camera rays
  };

  void add_mesh(const mesh::Mesh& mesh, std::span<const mesh::Transform> places,
                const ObjectDescription& object);
  void add_triangles(const bake::EmbreeObject& object, Answered answered);
  RTCGeometryTy* make_geometry(const bake::EmbreeObject& object);
  /// Takes ownership of the geometry.
  void attach(RTCGeometryTy* geometry, Answered answered);
  std::optional<SurfacePoint> trace(RTCSceneTy* scene, const Double3& origin, const Double3& direction) const;
  void add_ground(const SceneDescription& scene);
  /// Adds an object's asset, and returns the scene of its mesh file as the asset was baked from it.
  std::shared_ptr<const mesh::Scene> add_asset(const ObjectDescription& object,
                                               std::shared_ptr<const mesh::Scene> meshes);
  std::shared_ptr<const mesh::Scene> pose_asset(const ObjectDescription& object,
                                                const AssetScene::Added& added, const mesh::Scene& meshes);

  std::atomic<int64_t> embree_bytes_{0};  // before device_, whose destructor reports the memory that it frees
  std::string error_;
  std::vector<std::unique_ptr<bake::HolesFilter>> filters_;  // before device_, whose geometries use them;
                                                             // null for those without holes
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::vector<EmbreePointer> children_;  // scenes that instances refer to
  EmbreePointer everything_, beside_assets_;
  EmbreePointer beside_primaries_;  // null if no fields answer camera rays
  std::vector<Part> parts_;
  std::vector<AssetBox> asset_boxes_;
  PrimaryObjects primaries_;
  mesh::Box box_;
  double reach_ = 0;  // of the ground, from the origin
  uint64_t triangles_ = 0;
  AssetScene assets_;
};

}  // namespace nif::render
