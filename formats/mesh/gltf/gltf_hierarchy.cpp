// Node transforms are accumulated in double, so that deep hierarchies of CAD assemblies stay aligned; only
// the result is rounded to float.
#include "formats/mesh/gltf/gltf_hierarchy.hpp"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cmath>

#include "formats/base/rounding.hpp"
#include "formats/mesh/gltf/accessor.hpp"

namespace nif::mesh::detail {
namespace {

/// Returns the values, or `otherwise` if there are not kCount of them, as for a missing member.
template <size_t kCount>
std::array<double, kCount> numbers_or(const std::vector<double>& values,
                                      std::array<double, kCount> otherwise) {
  if (values.size() == kCount) std::copy_n(values.begin(), kCount, otherwise.begin());
  return otherwise;
}

/// Whether the node is hidden by KHR_node_visibility.
bool hides(const tinygltf::Node& node) {
  const auto found = node.extensions.find("KHR_node_visibility");
  if (found == node.extensions.end()) return false;
  const tinygltf::Value& visible = member_of(found->second, "visible");
  return visible.IsBool() && !visible.Get<bool>();
}

std::vector<int> roots(const Input& input, const tinygltf::Model& model) {
  if (!model.scenes.empty()) {
    const int scene = model.defaultScene < 0 ? 0 : model.defaultScene;
    if (static_cast<size_t>(scene) >= model.scenes.size()) {
      input.fail(Status::malformed_mesh,
                 fmt::format("uses scene {}, but there are only {}", scene, model.scenes.size()));
    }
    return model.scenes[static_cast<size_t>(scene)].nodes;
  }
  std::vector<bool> is_child(model.nodes.size());
  for (const tinygltf::Node& node : model.nodes) {
    for (const int child : node.children) {
      if (child >= 0 && static_cast<size_t>(child) < is_child.size())
        is_child[static_cast<size_t>(child)] = true;
    }
  }
  std::vector<int> out;
  for (size_t i = 0; i < is_child.size(); ++i) {
    if (!is_child[i]) out.push_back(static_cast<int>(i));
  }
  if (out.empty() && !model.nodes.empty())
    input.fail(Status::malformed_mesh, "has nodes that are all in a cycle");
  return out;
}

}  // namespace

Affine from_parts(const std::array<double, 3>& t, const std::array<double, 4>& q,
                  const std::array<double, 3>& s) {
  double x = 0, y = 0, z = 0, w = 1;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (length > 0) x = q[0] / length, y = q[1] / length, z = q[2] / length, w = q[3] / length;
  return {(1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y - z * w) * s[1],
          2 * (x * z + y * w) * s[2],       t[0],
          2 * (x * y + z * w) * s[0],       (1 - 2 * (x * x + z * z)) * s[1],
          2 * (y * z - x * w) * s[2],       t[1],
          2 * (x * z - y * w) * s[0],       2 * (y * z + x * w) * s[1],
          (1 - 2 * (x * x + y * y)) * s[2], t[2]};
}

std::optional<NodeParts> parts_of(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) return std::nullopt;
  return NodeParts{numbers_or<3>(node.translation, {0, 0, 0}), numbers_or<4>(node.rotation, {0, 0, 0, 1}),
                   numbers_or<3>(node.scale, {1, 1, 1})};
}

Affine local_transform(const tinygltf::Node& node) {
  if (const std::optional<NodeParts> parts = parts_of(node)) return parts->transform();
  Affine out{};
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 4; ++column) out[row * 4 + column] = node.matrix[column * 4 + row];
  }
  return out;
}

std::optional<Affine> inverse(const Affine& m) {
  const std::array<Double3, 3> rows{Double3{m[0], m[1], m[2]}, Double3{m[4], m[5], m[6]},
                                    Double3{m[8], m[9], m[10]}};
  const double whole = dot(rows[0], cross(rows[1], rows[2]));
  Affine out;
  for (size_t column = 0; column < 3; ++column) {
    const Double3 cofactors = cross(rows[(column + 1) % 3], rows[(column + 2) % 3]);
    for (size_t row = 0; row < 3; ++row) out[4 * row + column] = cofactors[row] / whole;
  }
  for (size_t row = 0; row < 3; ++row)
    out[4 * row + 3] = -(out[4 * row] * m[3] + out[4 * row + 1] * m[7] + out[4 * row + 2] * m[11]);
  for (const double x : out)
    if (!std::isfinite(x)) return std::nullopt;
  return out;
}

void GltfNaming::place(GltfPlacement placement, const Named& node,
                       std::vector<GltfPlacement>& placements) const {
  const Named named = node | meshes[placement.mesh];
  placement.by_material = !chooser.takes(named);
  if (!named.except) placements.push_back(placement);
}

Affine multiply(const Affine& a, const Affine& b) {
  Affine out{};
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? a[row * 4 + 3] : 0;
      for (size_t k = 0; k < 3; ++k) sum += a[row * 4 + k] * b[k * 4 + column];
      out[row * 4 + column] = sum;
    }
  }
  return out;
}

std::optional<Transform> to_transform(const Affine& world) {
  Transform out{};
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<float>(world[i]);
    if (!std::isfinite(out[i])) return std::nullopt;
  }
  return out;
}

Double3 remainder_of(const Affine& world) {
  Double3 out;
  for (size_t a = 0; a < 3; ++a) out[a] = lost_to_float(world[4 * a + 3]);
  return out;
}

GltfNaming name_things(const Input& input, const tinygltf::Model& model,
                       const std::vector<GltfSurface>& materials) {
  GltfNaming naming(input);
  for (const tinygltf::Mesh& mesh : model.meshes) naming.meshes.push_back(naming.chooser.look_up(mesh.name));
  for (const GltfSurface& material : materials)
    naming.materials.push_back(naming.chooser.look_up(material.name));
  return naming;
}

GltfHierarchy flatten(const Input& input, const tinygltf::Model& model, GltfNaming& naming,
                      const std::function<void(size_t node, const Affine& world, bool hidden)>& visit_node) {
  struct Visit {
    int node;
    size_t parent;
    Affine place;  // of the parent
    bool hidden;   // the parent is hidden
    Named named;   // by the names of the parent and of all its ancestors
  };
  // An explicit stack, because the file determines the depth of its hierarchy.
  std::vector<Visit> stack;
  const std::vector<int> first = roots(input, model);
  for (auto root = first.rbegin(); root != first.rend(); ++root)
    stack.push_back({*root, GltfHierarchy::kNone, kUnmoved, false, {}});

  GltfHierarchy out;
  out.parents.assign(model.nodes.size(), GltfHierarchy::kNone);
  out.in_scene.resize(model.meshes.size());
  std::vector<bool> visited(model.nodes.size());
  while (!stack.empty()) {
    const Visit visit = stack.back();
    stack.pop_back();
    if (visit.node < 0 || static_cast<size_t>(visit.node) >= model.nodes.size()) {
      input.fail(Status::malformed_mesh,
                 fmt::format("uses node {}, but there are only {}", visit.node, model.nodes.size()));
    }
    const size_t index = static_cast<size_t>(visit.node);
    // A node that is visited twice has two parents or is in a cycle. Both are forbidden, and unfolding them
    // may never end.
    if (visited[index])
      input.fail(Status::malformed_mesh, fmt::format("node {} has two parents or is in a cycle", index));
    visited[index] = true;
    out.parents[index] = visit.parent;
    const tinygltf::Node& node = model.nodes[index];
    const Affine world = multiply(visit.place, local_transform(node));
    const bool hidden = visit.hidden || hides(node);
    const Named named = visit.named | naming.chooser.look_up(node.name);
    if (node.mesh >= 0) {
      if (static_cast<size_t>(node.mesh) >= model.meshes.size()) {
        input.fail(Status::malformed_mesh, fmt::format("node {} uses mesh {}, but there are only {}", index,
                                                       node.mesh, model.meshes.size()));
      }
      if (!to_transform(world))
        input.fail(Status::malformed_mesh, fmt::format("node {} is placed at infinity", index));
      const auto mesh = static_cast<size_t>(node.mesh);
      out.in_scene[mesh] = true;
      if (hidden)
        ++out.hidden;
      else
        naming.place({.node = index, .mesh = mesh, .skin = node.skin, .place = world}, named, out.placements);
    }
    visit_node(index, world, hidden);
    for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
      stack.push_back({*child, index, world, hidden, named});
  }
  return out;
}

}  // namespace nif::mesh::detail
