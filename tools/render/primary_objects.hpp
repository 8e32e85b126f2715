// Objects whose camera rays are answered by fields for primary rays instead of their triangles.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "formats/mesh/transform.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "tools/render/scene.hpp"
#include "tools/render/surface_point.hpp"

namespace nif::render {

/// Any number of threads may ask it. Each ray asks every instance, so it is for few of them.
class PrimaryObjects {
 public:
  /// Adds all instances of the object's asset; `place` is what messages call the object. Throws as the
  /// reading of an asset, and Error(malformed_scene) where an instance's object has no such field.
  void add(const ObjectDescription& object, const std::string& place);

  bool empty() const { return instances_.empty(); }

  /// The first hit nearer than `farthest`, along a direction of unit length. As the fields have it: the
  /// normal may turn away from the ray.
  std::optional<SurfacePoint> trace(const Double3& origin, const Double3& direction, double farthest) const;

 private:
  struct Asset {
    explicit Asset(const std::string& path)
        : memory(format::FileMemory::load(path, format::FileMemory::Mode::read)),
          view(format::read_asset(memory.bytes(), path)) {}
    const format::FileMemory memory;
    const format::AssetView view;
  };
  struct Instance {
    const kernels::PrimaryField* field;
    mesh::ToObject to_object;
    std::array<Double3, 3> normals;  ///< rows: object to world, for normals, which keep their side
    SurfaceKind kind;
  };
  std::vector<std::unique_ptr<const Asset>> assets_;  // what fields point into
  std::vector<Instance> instances_;
};

}  // namespace nif::render
