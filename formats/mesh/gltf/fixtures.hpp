// Cameras and lights of glTF (KHR_lights_punctual). A faulty one is left out with a note. It never prevents
// the meshes of a file from being read.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// A camera or a light that a node carries, or why it is none: the rest of a sentence that begins with the
/// file.
struct GltfFixture {
  size_t node = 0;
  std::variant<Camera, Light, std::string> what;  ///< not yet placed
};

/// Of all nodes of a document, shown or not, in their order. Throws nothing but bad_alloc, whatever the
/// document holds.
std::vector<GltfFixture> read_fixtures(const nlohmann::json& root);

/// Adds cameras and lights of the nodes that are shown to a scene, and notes.
class FixturePlacer {
 public:
  /// `fixtures` in the order of their nodes. The arguments must outlive the placer.
  FixturePlacer(const Input& input, std::span<const GltfFixture> fixtures, Scene& scene)
      : input_(input), fixtures_(fixtures), scene_(scene) {}

  /// A node of the scene; `world` is none where it is placed beyond what float reaches. Lights that are
  /// hidden are left out; cameras stay, as KHR_node_visibility has it.
  void visit(size_t node, const std::optional<Transform>& world, bool hidden);
  /// To be called once, at the end: says how many notes were too many to be given.
  void report();

 private:
  void note(const std::string& sentence);

  const Input& input_;
  std::span<const GltfFixture> fixtures_;
  Scene& scene_;
  uint64_t notes_ = 0;
};

}  // namespace nif::mesh::detail
