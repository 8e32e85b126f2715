// The readers of each format, and the checks that all of them share. Internal to formats/mesh.
#pragma once

#include <functional>
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

/// Adds meshes to a scene that each stand once, untransformed. Meshes without triangles are left out.
Scene scene_of(std::vector<Mesh> meshes, Scene scene = {});

/// Makes names valid UTF-8, then throws unless every index is in range, every used vertex finite and there is
/// a triangle at all.
void check(const Input& input, Scene& scene);

/// Names come from files in any encoding and go into JSON and onto terminals: without control characters.
std::string clean_name(std::string_view name);

/// Throws too_large.
[[noreturn]] void fail_triangle_limit(const Input& input);

/// Throws too_large where so many triangles exceed the limit.
inline void check_triangle_limit(const Input& input, uint64_t count) {
  if (count > input.limits.max_triangles) fail_triangle_limit(input);
}

/// Adds the faces of a file to a mesh as triangles, within the limits.
class FaceSink {
 public:
  FaceSink(const Input& input, Mesh& mesh) : input_(input), mesh_(mesh) {}

  /// A polygon becomes a fan around its first corner, which covers a convex one. Its corners may be vertices
  /// that come later.
  void polygon(std::span<const uint32_t> corners) {
    if (corners.size() != 3) return fan(corners);
    check_triangle_limit(input_, mesh_.triangles.size() + 1);
    mesh_.triangles.push_back({corners[0], corners[1], corners[2]});
  }

  /// Once all positions are known: cuts polygons that are not convex into triangles that cover them, in
  /// place. Adds notes to the scene of faces that were left out or are not what a polygon is. `name_of` has
  /// the name of the object that a triangle is of.
  void settle(Scene& scene, const std::function<std::string_view(uint64_t triangle)>& name_of);

 private:
  /// Polygons of as many corners whose triangles follow each other.
  struct Run {
    uint64_t first_triangle;
    uint32_t corners, count;
  };
  void fan(std::span<const uint32_t> corners);
  void remember(size_t corners);

  const Input& input_;
  Mesh& mesh_;
  uint64_t skipped_ = 0;
  std::vector<Run> runs_;  // those of four corners and more
};

}  // namespace nif::mesh::detail
