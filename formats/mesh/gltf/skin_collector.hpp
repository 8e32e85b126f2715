// Collects how a mesh bends, primitive by primitive: with ReadLimits::skins, nothing is moved while a file is read.
#pragma once

#include <memory>
#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/skin.hpp"
#include "formats/mesh/skin.hpp"

namespace nif::mesh::detail {

class SkinCollector {
 public:
  static constexpr size_t kMostInfluences = 8;

  /// `joints`: the number of joints of skin `number`; 0: there are only morph targets.
  SkinCollector(const GltfData& data, uint32_t number, size_t joints, size_t targets);

  bool has_joints() const { return joint_count_ > 0; }
  size_t targets() const { return skin_.targets.size(); }

  /// Adds vertices after those that are already there, with what moves them. If that cannot be read, the first joint does.
  void add_joints(size_t vertices, const GltfInfluences& influences);
  /// Sets how far a target moves the vertices that were added last; where nobody sets it, it does not move them.
  void set_target(size_t target, const std::vector<Float3>& moves);

  /// Null if nothing bends the mesh.
  std::shared_ptr<const Skin> finish(std::vector<float> rest_weights);

  bool unreadable() const { return unreadable_; }  ///< the first joint moves what others should move
  uint64_t without_weights() const {
    return loose_;
  }                                             ///< vertices that the first joint moves for that reason
  uint64_t with_many() const { return many_; }  ///< vertices with more than kMostInfluences

 private:
  struct Influences;

  /// Returns false if something is invalid.
  bool add_set(std::pair<int, int> accessors, std::vector<Influences>& vertices) const;
  void append(const Influences& vertex);

  const GltfData& data_;
  size_t joint_count_;
  Skin skin_;  // with kMostInfluences, until it is finished
  size_t vertices_ = 0;
  size_t most_ = 0;  // influences of any vertex
  bool unreadable_ = false;
  uint64_t loose_ = 0, many_ = 0;
};

}  // namespace nif::mesh::detail
