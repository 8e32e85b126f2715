// The frames of a clip: an asset posed as its glTF is at moments of an animation, and the mesh that it then is.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "formats/mesh/poser.hpp"
#include "tools/common/measured_asset.hpp"

namespace nif::tools {

/// For --clip: every clip of the file.
inline constexpr std::string_view kAllClips = "all";

/// Poses instances of a scene from `first` on, which must be committed afterwards. `outer` is applied after their
/// transforms. What a clip hides by a scale of 0 is disabled.
void pose_instances(NifScene scene, uint32_t first, std::span<const mesh::PosedInstance> instances,
                    const mesh::Transform& outer = mesh::kIdentity);

/// Moments of one clip, evenly from its first key to its last, or of all clips in turn; and the instances at each.
class ClipFrames {
 public:
  /// `clip`: as Moment::clip, or kAllClips. The asset must outlive it. Throws Error(usage) if there is no such clip.
  ClipFrames(const MeasuredAsset& asset, const std::string& clip, uint32_t frames);

  size_t count() const { return moments_.size(); }
  std::string name(size_t frame) const;

  /// The instances of the asset, in their order.
  using Pose = std::vector<mesh::PosedInstance>;
  Pose at(size_t frame) const;
  /// All that blocks light at that moment, in the world: with the positions that nifPoseInstance gives vertices, rounded once
  /// more where an instance has a transform.
  mesh::Mesh mesh(const Pose& pose) const;

 private:
  const MeasuredAsset& asset_;
  mesh::Poser poser_;
  std::vector<mesh::Moment> moments_;
};

}  // namespace nif::tools
