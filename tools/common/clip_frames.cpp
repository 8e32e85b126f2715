// Poses instances by the runtime, and by docs/answers.md ("Posed vertices") for the ground truth, which shares no code with
// it.
#include "tools/common/clip_frames.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "formats/base/status.hpp"
#include "formats/mesh/skin.hpp"
#include "tools/common/naming.hpp"

namespace nif::tools {
namespace {

mesh::Poser poser_of(const MeasuredAsset& asset) {
  if (!asset.limits().skins)
    throw Error(Status::usage,
                asset.path() + ": its objects cannot bend; --clip needs one baked with --deforms");
  return {asset.mesh_file(), asset.scene(), asset.limits()};
}

/// As Moment::clip names it.
std::string number_of(const mesh::Clip& clip) { return std::to_string(clip.number); }

std::vector<mesh::Moment> moments_of(const mesh::Poser& poser, const std::string& file,
                                     const std::string& clip, uint32_t frames) {
  if (poser.clips().empty()) throw Error(Status::usage, file + ": has no clip");
  std::vector<mesh::Clip> chosen;
  for (const mesh::Clip& own : poser.clips()) {
    const bool named = clip == own.name || clip == number_of(own);
    if (clip == kAllClips || (named && chosen.empty())) chosen.push_back(own);
  }
  if (chosen.empty())
    throw Error(Status::usage,
                fmt::format("{}: has no clip '{}'; nif mesh info lists those that it has", file, clip));
  std::vector<mesh::Moment> moments;
  const size_t rounds = (frames + chosen.size() - 1) / chosen.size();
  for (size_t i = 0; i < frames; ++i) {
    const mesh::Clip& own = chosen[i % chosen.size()];
    const double share = rounds > 1 ? double(i / chosen.size()) / double(rounds - 1) : 0.5;
    moments.push_back({number_of(own), own.begin + share * (own.end - own.begin)});
  }
  return moments;
}

/// In single precision, operation by operation.
mesh::Float3 posed(const mesh::Skin& skin, const mesh::PosedInstance& pose, mesh::Float3 from,
                   size_t vertex) {
  for (size_t t = 0; t < pose.weights.size(); ++t)
    for (size_t a = 0; a < 3; ++a) from[a] += pose.weights[t] * skin.targets[t][vertex][a];
  if (skin.influences == 0) return from;
  mesh::Float3 to;
  for (size_t row = 0; row < 3; ++row) {
    float mean[4];
    for (size_t column = 0; column < 4; ++column) {
      const size_t first = vertex * skin.influences;
      mean[column] = pose.joints[skin.joints[first]][4 * row + column] * skin.weights[first];
      for (size_t k = first + 1; k < first + skin.influences; ++k)
        if (skin.weights[k] != 0)
          mean[column] += pose.joints[skin.joints[k]][4 * row + column] * skin.weights[k];
    }
    to[row] = ((mean[0] * from[0] + mean[1] * from[1]) + mean[2] * from[2]) + mean[3];
  }
  return to;
}

/// Whether rays can meet something with this transform.
bool has_inverse(const mesh::Affine& m) {
  const double determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                             m[2] * (m[4] * m[9] - m[5] * m[8]);
  return determinant > 1e-30 || determinant < -1e-30;
}

}  // namespace

void pose_instances(NifScene scene, uint32_t first, std::span<const mesh::PosedInstance> instances,
                    const mesh::Transform& outer) {
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const mesh::PosedInstance& own = instances[i];
    if (!own.joints.empty() || !own.weights.empty()) {
      auto pose = nifkit::sized<NifPose>();
      pose.joints = own.joints.empty() ? nullptr : own.joints[0].data();
      pose.joint_count = uint32_t(own.joints.size());
      pose.weights = own.weights.data();
      pose.target_count = uint32_t(own.weights.size());
      const NifError code = nifPoseInstance(scene, first + i, &pose);
      // The bake has noted why.
      if (code == NIF_ERROR_INVALID_OPERATION)
        throw Error(Status::usage, fmt::format("{}, so no clip can pose it", nifGetErrorMessage()));
      check(code);
    }
    if (!own.joints.empty()) continue;  // joints move it in the space of its instance
    const bool shown = has_inverse(own.transform);
    check(nifSetInstanceFlags(scene, first + i, shown ? 0 : NIF_INSTANCE_DISABLED));
    if (!shown) continue;
    mesh::Transform transform;
    std::copy(own.transform.begin(), own.transform.end(), transform.begin());
    transform = mesh::compose(outer, transform);
    check(nifSetInstanceTransform(scene, first + i, transform.data()));
  }
}

ClipFrames::ClipFrames(const MeasuredAsset& asset, const std::string& clip, uint32_t frames)
    : asset_(asset), poser_(poser_of(asset)), moments_(moments_of(poser_, asset.mesh_file(), clip, frames)) {}

std::string ClipFrames::name(size_t frame) const {
  const mesh::Moment& moment = moments_[frame];
  const auto clip = std::ranges::find_if(
      poser_.clips(), [&](const mesh::Clip& own) { return number_of(own) == moment.clip; });
  return fmt::format("{} at {:.3f} s", clip->name.empty() ? "clip " + moment.clip : clip->name, moment.time);
}

ClipFrames::Pose ClipFrames::at(size_t frame) const {
  std::vector<mesh::PosedInstance> all = poser_.at(moments_[frame]);
  Pose pose;
  for (const uint32_t i : asset_.prepared().instances) pose.push_back(std::move(all[i]));
  return pose;
}

mesh::Mesh ClipFrames::mesh(const Pose& pose) const {
  mesh::Mesh whole{"posed", {}, {}};
  for (size_t i = 0; i < pose.size(); ++i) {
    const mesh::PosedInstance& own = pose[i];
    if (own.joints.empty() && !has_inverse(own.transform)) continue;
    const mesh::Mesh& source =
        asset_.scene().meshes[asset_.scene().instances[asset_.prepared().instances[i]].mesh];
    const auto first = uint32_t(whole.positions.size());
    const bool placed = std::ranges::equal(own.transform, mesh::kIdentity);
    for (size_t v = 0; v < source.positions.size(); ++v) {
      const mesh::Float3 at =
          source.skin ? posed(*source.skin, own, source.positions[v], v) : source.positions[v];
      mesh::Float3& world = whole.positions.emplace_back(at);
      if (placed) continue;
      for (size_t row = 0; row < 3; ++row) {
        double sum = own.transform[4 * row + 3];
        for (size_t k = 0; k < 3; ++k) sum += own.transform[4 * row + k] * double(at[k]);
        world[row] = float(sum);
      }
    }
    for (const mesh::Triangle& triangle : source.triangles)
      whole.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  }
  return whole;
}

}  // namespace nif::tools
