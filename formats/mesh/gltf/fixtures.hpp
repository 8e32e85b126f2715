// Reads cameras and lights of glTF (KHR_lights_punctual). A faulty one is left out with a note. It never
// prevents the meshes of a file from being read.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// A camera or a light of a node, or the reason why it is invalid: the rest of a sentence that begins with
/// the file.
struct GltfFixture {
  size_t node = 0;
  std::variant<Camera, Light, std::string> what;  ///< not yet placed
};

/// Those of all nodes of a document, shown or not, in their order. Throws only bad_alloc, whatever the
/// document contains.
std::vector<GltfFixture> read_fixtures(const nlohmann::json& root);

/// Adds cameras and lights of visible nodes to a scene, and notes.
class FixturePlacer {
 public:
  /// `fixtures` must be in the order of their nodes. The arguments must outlive the placer.
  FixturePlacer(const Input& input, std::span<const GltfFixture> fixtures, Scene& scene)
      : input_(input), fixtures_(fixtures), scene_(scene) {}

  /// Visits a node of the scene; `world` is empty if its transform exceeds the range of float. Hidden lights
  /// are left out; cameras stay, as KHR_node_visibility specifies.
  void visit(size_t node, const std::optional<Transform>& world, bool hidden);
  /// To be called once, at the end: reports how many notes were dropped because there were too many.
  void report();

 private:
  void note(const std::string& sentence);

  const Input& input_;
  std::span<const GltfFixture> fixtures_;
  Scene& scene_;
  uint64_t notes_ = 0;
};

}  // namespace nif::mesh::detail
