// A game's own animation: joints, and what a clip does with them. It knows nothing of assets.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "affine.hpp"
#include "gltf.hpp"

/// A node: what moves it relative to its parent.
struct Bone {
  Float3 translation{0, 0, 0};
  std::array<float, 4> rotation{0, 0, 0, 1};
  Float3 scale{1, 1, 1};

  Transform transform() const;
};

class Rig {
 public:
  /// Of one clip of the file. Throws std::exception if there is none with this name.
  Rig(const Gltf& file, const std::string& clip);

  size_t node_count() const { return parents_.size(); }
  double seconds() const { return end_; }
  /// All nodes at rest, to the space of the file.
  const std::vector<Transform>& at_rest() const { return at_rest_; }
  /// The same at a moment of the clip, which repeats. world: [node_count()]. Allocates nothing.
  void evaluate(double time, std::span<Bone> bones, std::span<Transform> world) const;

 private:
  /// What moves one node: three translations or scales, or four parts of a rotation, at each time.
  struct Channel {
    enum class Target { translation, rotation, scale } target;
    size_t node;
    bool steps;  ///< from one value to the next
    std::vector<float> times, values;
  };
  void place(std::span<const Bone> bones, std::span<Transform> world) const;

  std::vector<Bone> rest_;
  std::vector<size_t> order_;  ///< parents first
  std::vector<int> parents_;   ///< -1: none
  std::vector<Channel> channels_;
  std::vector<Transform> at_rest_;
  double end_ = 0;
};
