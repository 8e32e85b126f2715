// Objects whose camera rays are answered by fields for primary rays instead of their triangles.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "formats/mesh/transform.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "tools/render/picture_scene.hpp"
#include "tools/render/surface_point.hpp"

namespace nif::render {

/// Any number of threads may query it. Each ray queries every instance, so it is for a few instances.
class PrimaryObjects {
 public:
  /// Adds all instances of the object's asset; `place` is the name of the object in messages. Throws as
  /// reading an asset does, and Error(malformed_scene) if an instance's object has no such field.
  void add(const ObjectDescription& object, const std::string& place);

  bool empty() const { return instances_.empty(); }

  /// The first hit nearer than `farthest`, along a direction of unit length, as the fields report it: the
  /// normal may point away from the ray's origin.
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
  std::vector<std::unique_ptr<const Asset>> assets_;  // the memory that fields point into
  std::vector<Instance> instances_;
};

}  // namespace nif::render
