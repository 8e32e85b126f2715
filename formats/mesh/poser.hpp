// Where the instances of a scene are, and how they bend, at any moment of an animation.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "formats/mesh/read.hpp"
#include "formats/mesh/skin.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh {

/// An instance of a scene at a moment.
struct PosedInstance {
  /// From the space of its mesh to the world. Of a mesh with joints, it is always that of the scene, because joints move the mesh
  /// in the space of its instance. Others may have no inverse for a while, where a clip hides them by a scale of 0.
  Affine transform{};
  /// [Skin::joint_count], computed in double and rounded once; empty if the mesh has no joints.
  std::vector<JointMatrix> joints;
  std::vector<float> weights;  ///< [target]; empty if the mesh has none
};

/// Evaluates the clips of a glTF for a scene that was read from it with ReadLimits::skins. It reads the file once, and does not
/// need it any more.
class Poser {
 public:
  /// `scene` may have been changed since it was read, as by merge() or drop_clear(), as long as its instances keep their nodes, and
  /// meshes their skins. `limits` are those of read(); `file` is not standard input. Other formats than glTF have no clips.
  ///
  /// Throws as read() does; Error(usage) without ReadLimits::skins, and Error(mesh_mismatch) if the scene is from another file.
  Poser(const std::filesystem::path& file, const Scene& scene, const ReadLimits& limits);
  /// The same for a file whose uncompressed bytes are in memory. They are not needed any more, either.
  Poser(const std::filesystem::path& file, std::string_view bytes, const Scene& scene,
        const ReadLimits& limits);
  Poser(Poser&&) noexcept;
  Poser& operator=(Poser&&) noexcept;
  ~Poser();

  /// The clips whose times can be read.
  const std::vector<Clip>& clips() const;

  /// One for each instance of the scene, in its order. What the clip does not move is as the file has it. A merged instance moves
  /// with its first part. An instance that a transform without an inverse has flattened only moves as far as the origin of its
  /// node.
  ///
  /// Thread-safe. Throws Error(usage) if there is no such clip, and Error(malformed_mesh) if it cannot be read or places something
  /// at infinity.
  std::vector<PosedInstance> at(const Moment& moment) const;

  /// The same as the scene was read: as the file has it, or at ReadLimits::moment.
  std::vector<PosedInstance> rest() const;

 private:
  class Work;
  std::unique_ptr<const Work> work_;
};

}  // namespace nif::mesh
