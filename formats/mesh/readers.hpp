// The readers of each format, and the checks that all of them share. Internal to formats/mesh.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

Scene read_ply(const Input& input);
Scene read_stl(const Input& input);
Scene read_obj(const Input& input);
Scene read_off(const Input& input);
Scene read_draco(const Input& input);

/// Appends the files of external buffers, in the order of the file, to `external`.
Scene read_gltf(const Input& input, std::vector<ExternalFile>& external);

/// True where the bytes can only be an STL file, text or binary.
bool looks_like_stl(std::string_view bytes);

struct DracoData {
  std::string_view bytes;
  std::string where;  ///< begins the reason of a refusal
  int position_id =
      -1;  ///< unique id of the attribute to read; -1 for the one that is marked as the position
  bool normalized = false;  ///< integer components stand for fractions
};

/// Decodes a Draco mesh and appends it to `mesh`.
void append_draco(const Input& input, const DracoData& data, Mesh& mesh);

/// A scene of meshes that each stand once, untransformed. Meshes without triangles are left out.
Scene scene_of(std::vector<Mesh> meshes);

/// Makes names valid UTF-8, then throws unless every index is in range, every used vertex finite and there is
/// a triangle at all.
void check(const Input& input, Scene& scene);

/// Adds the faces of a file to a mesh as triangles, within the limits.
class FaceSink {
 public:
  FaceSink(const Input& input, Mesh& mesh) : input_(input), mesh_(mesh) {}

  /// A polygon becomes a fan around its first corner. That covers a convex polygon exactly; a concave one
  /// gets the right boundary and the right enclosed volume, but some of its triangles overlap outside the
  /// outline.
  void polygon(std::span<const uint32_t> corners);

  /// Adds a note to the scene where faces of fewer than three corners were left out.
  void report(Scene& scene) const;

 private:
  const Input& input_;
  Mesh& mesh_;
  uint64_t skipped_ = 0;
};

/// Throws too_large where `count` more triangles exceed the limit.
void check_triangle_limit(const Input& input, uint64_t count);

}  // namespace nif::mesh::detail
