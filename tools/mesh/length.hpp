// Parses lengths for the verbs of `nif mesh`, and measures the extent of a mesh, because a length may be
// relative to it.
#pragma once

#include <string>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::tools {

/// The longest side of the bounds of a mesh's triangles; 0 if it has none.
double longest_side(const mesh::Mesh& mesh);
/// The diagonal of these bounds.
double diagonal(const mesh::Mesh& mesh);

/// A length as text: "0.01", in units of the mesh, or "0.1%", of the diagonal of its bounds. Throws
/// Error(usage) that names `option` if it is neither, or not above 0.
class Length {
 public:
  Length(const std::string& text, const std::string& option);
  double of(const mesh::Mesh& mesh) const { return relative_ ? value_ * diagonal(mesh) : value_; }

 private:
  double value_ = 0;
  bool relative_ = false;
};

}  // namespace nif::tools
