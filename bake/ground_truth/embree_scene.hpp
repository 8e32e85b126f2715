// A triangle mesh, or instances of several, in an Embree scene. The ground truth and the baseline to beat
// share it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bake/ground_truth/embree_object.hpp"
#include "bake/ground_truth/holes_filter.hpp"
#include "formats/mesh/mesh_scene.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace nif::bake {

/// How Embree builds its BVH: `robust` is what ground truth uses, the others are what renderers use. `high`
/// is the standard form with spatial splits, slower to build. `refitted` is the standard form of a mesh that moves: later
/// commits only give boxes new sizes.
enum class EmbreeBuild { robust, standard, compact, high, refitted };

/// Version of the loaded library, "3.13.5".
std::string embree_version();

/// Call it if rtcNewDevice() made none: throws std::bad_alloc, or Error(internal) if memory was not the
/// cause.
[[noreturn]] void throw_no_device();

/// An object in its place.
struct Placed {
  uint32_t object;
  mesh::Transform transform;
};

/// Any number of threads may query it while none changes it.
class EmbreeScene {
 public:
  /// Copies what it needs. Throws Error(out_of_memory) or Error(internal) with Embree's own message.
  EmbreeScene(const EmbreeObject& object, EmbreeBuild build, HoleTest test = HoleTest::fast);
  /// Instances: each object gets a scene, and one scene above them has all instances. `build` applies to all
  /// of these scenes.
  EmbreeScene(std::span<const EmbreeObject> objects, std::span<const Placed> instances, EmbreeBuild build,
              HoleTest test = HoleTest::fast);
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  RTCSceneTy* handle() const { return scene_.get(); }

  /// Gives an instance another transform, which takes effect with commit().
  void move(uint32_t instance, const mesh::Transform& transform);
  /// Gives the vertices of a scene of one mesh new positions, as many as before, which take effect with commit().
  void move_vertices(std::span<const mesh::Float3> positions);
  /// Rebuilds the hierarchy over the instances, or the mesh's own, on the threads of the calling task arena.
  void commit();

  /// Bytes that Embree holds for the scene, by its own memory monitor: the BVH, and copied vertices and
  /// indices, separately. The latter include what a filter holds of holes.
  struct Memory {
    int64_t bvh;
    int64_t buffers;
  };
  Memory memory() const { return {bytes_ - buffers_, buffers_ + filter_bytes_}; }

 private:
  struct Release {
    void operator()(RTCDeviceTy* device) const;
    void operator()(RTCSceneTy* scene) const;
  };
  using ScenePointer = std::unique_ptr<RTCSceneTy, Release>;

  void make_device();
  ScenePointer make_scene(EmbreeBuild build);
  /// Adds a mesh to a scene and commits that.
  void add_triangles(RTCSceneTy* scene, const EmbreeObject& object, EmbreeBuild build, HoleTest test);
  void commit_alone(RTCSceneTy* scene, const std::string& what);

  std::atomic<int64_t> bytes_{0};
  int64_t buffers_ = 0, filter_bytes_ = 0;
  std::string error_;
  std::vector<std::unique_ptr<HolesFilter>> filters_;  ///< [object], null if it has no holes
  // Embree's handles come last, so that they are destroyed first: Embree still reports what it frees.
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::vector<ScenePointer> objects_;  ///< the objects of the instances
  ScenePointer scene_;
};

}  // namespace nif::bake
