// Where animations move nodes, and how they deform meshes, at a moment. Their JSON is read here, too.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "formats/mesh/clip.hpp"
#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh::detail {

/// The clips with their times. What cannot be read is left out, with a note.
std::vector<Clip> describe_clips(const Input& input, const GltfData& data, const std::vector<GltfClip>& clips,
                                 std::vector<Note>& notes);

/// A channel with its keys.
struct KeyedChannel {
  GltfChannel channel;
  std::shared_ptr<const std::vector<float>> times;   ///< ascending, at least one
  std::shared_ptr<const std::vector<float>> values;  ///< [keys][1, or 3 of a spline][width]
  size_t width = 0;
};

/// Reads the keys of clips, each accessor once.
class ClipKeys {
 public:
  ClipKeys(const Input& input, const GltfData& data) : input_(input), data_(data) {}

  using Numbers = std::shared_ptr<const std::vector<float>>;
  Numbers times(int accessor);

  /// Throws Error(malformed_mesh) if the clip cannot be read or moves nothing. `number`: of the clip.
  std::vector<KeyedChannel> channels(const GltfClip& clip, size_t number, const tinygltf::Model& model);

 private:
  Numbers values(int accessor, int components);
  Numbers read(int accessor, int components);

  const Input& input_;
  const GltfData& data_;
  std::map<int, Numbers> times_;
  std::map<std::pair<int, int>, Numbers> values_;
  uint64_t read_ = 0;
};

/// The number of a clip, by its name or number. Throws Error(usage) if there is no such clip.
size_t number_of(const Input& input, const std::vector<GltfClip>& clips, const std::string& name);

/// The value of a channel of a clip. Throws Error(malformed_mesh) if it is not finite.
std::vector<double> value_at(const Input& input, const GltfClip& clip, size_t number,
                             const KeyedChannel& keys, double time);

/// Moves the nodes of the model, and sets their weights. Throws Error(usage) if there is no such clip, and
/// Error(malformed_mesh) if it cannot be read.
void pose_nodes(const Input& input, const GltfData& data, const std::vector<GltfClip>& clips,
                const Moment& moment, tinygltf::Model& model);

}  // namespace nif::mesh::detail
