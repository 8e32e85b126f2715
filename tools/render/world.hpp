// A scene ready for rays: Embree with its meshes, and the runtime with its assets.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/oracle/oracle.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/transform.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/asset_scene.hpp"
#include "tools/render/primary_objects.hpp"
#include "tools/render/scene.hpp"
#include "tools/render/scene_meshes.hpp"
#include "tools/render/surface_point.hpp"

struct RTCDeviceTy;
struct RTCGeometryTy;
struct RTCSceneTy;

namespace nif::render {

/// Immutable once made; any number of threads may ask it. Answers do not depend on the number of threads.
class World {
 public:
  /// Takes the meshes of a scene's objects ([object], none null), each let go once it is built, and reads
  /// their assets. `configuration` is the runtime's, of a device. Throws as the loading of assets, and
  /// Error(mesh_mismatch) where an asset's bounds are not those of its mesh.
  World(const SceneDescription& scene, ObjectMeshes meshes, const std::string& configuration,
        tools::Progress& progress);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Of the objects, without the ground.
  const mesh::Box& box() const { return box_; }
  uint64_t triangles() const { return triangles_; }
  /// What Embree holds for everything: its BVHs, and the vertices and indices that they point to.
  uint64_t embree_bytes() const { return uint64_t(embree_bytes_); }

  /// The first hit by Embree over everything, along a direction of unit length.
  std::optional<SurfacePoint> trace(const Double3& origin, const Double3& direction) const;
  /// The same by the fields of those objects whose camera rays they answer, of which there must be some, and
  /// by Embree over the rest.
  std::optional<SurfacePoint> trace_by_fields(const Double3& origin, const Double3& direction) const;
  /// Whether there are such objects.
  bool has_primaries() const { return !primaries_.empty(); }

  /// visible[i] = 1 or 0, by Embree over everything.
  void ask_embree(std::span<const Segment> rays, uint8_t* visible) const;
  /// The same over what no asset answers for.
  void ask_embree_beside_assets(std::span<const Segment> rays, uint8_t* visible) const;

  /// By assets alone, and by Embree over what has none: the first hit of each ray, whose directions have unit
  /// length. `hits` is as long as `rays`.
  void trace_by_assets(std::span<const Segment> rays, std::span<std::optional<SurfacePoint>> hits) const;

  const AssetScene& assets() const { return assets_; }
  bool has_assets() const { return !assets_.empty(); }
  /// Whether the ray starts within the AABB of a mesh that an asset answers for.
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
  struct Part {  // by Embree's geometry in everything_
    SurfaceKind kind;
    mesh::Transform normals;  // object to world, for normals; of instances only
  };
  /// Who answers for a mesh beside Embree.
  struct Answered {
    bool by_asset = false;    ///< shadow rays
    bool by_primary = false;  ///< camera rays
  };

  void add_mesh(const mesh::Mesh& mesh, std::span<const mesh::Transform> places,
                const ObjectDescription& object);
  void add_triangles(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles,
                     Answered answered);
  RTCGeometryTy* make_geometry(std::span<const mesh::Float3> positions,
                               std::span<const mesh::Triangle> triangles);
  /// Takes the geometry over.
  void attach(RTCGeometryTy* geometry, Answered answered);
  std::optional<SurfacePoint> trace(RTCSceneTy* scene, const Double3& origin, const Double3& direction) const;
  void add_ground(const SceneDescription& scene);
  /// Adds an object's asset, and returns the scene of its mesh file, as it was baked from it.
  std::shared_ptr<const mesh::Scene> add_asset(const ObjectDescription& object,
                                               std::shared_ptr<const mesh::Scene> meshes);

  std::atomic<int64_t> embree_bytes_{0};  // before device_, which says what it frees
  std::string error_;
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::vector<EmbreePointer> children_;  // scenes that instances place
  EmbreePointer everything_, beside_assets_;
  EmbreePointer beside_primaries_;  // null where fields answer no camera rays
  std::vector<Part> parts_;
  std::vector<AssetBox> asset_boxes_;
  PrimaryObjects primaries_;
  mesh::Box box_;
  double reach_ = 0;  // of the ground, from the origin
  uint64_t triangles_ = 0;
  AssetScene assets_;
};

}  // namespace nif::render
