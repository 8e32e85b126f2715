// Characters that walk in a circle: what a game does with assets in each frame. Joints come from the game's own animation,
// feet stand where a ray down to the ground ends, and one commit makes all of it visible to rays.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "affine.hpp"
#include "look.hpp"
#include "rig.hpp"

/// Rays with this mask meet only the place in which the characters walk.
inline constexpr uint32_t kGroundMask = 1, kCharacterMask = 2;

struct CrowdOptions {
  std::string character, character_mesh, place, clip;
  std::vector<std::string>
      hidden;  ///< names of instances of the character, without what it does not carry now
  uint32_t count = 12;
  float x = 0, z = 0, radius = 6, speed = 1.45f;  ///< of the circle, in metres; metres a second
};

/// Seconds of this thread.
struct FrameTimes {
  double animate = 0;  ///< the game's own part: joints from the clip
  double ground = 0;   ///< a ray for each character
  double pose = 0;     ///< matrices and transforms to the scene
  double commit = 0;
};

class Crowd {
 public:
  /// Throws nifkit::Error and std::exception.
  Crowd(const nifkit::Device& device, const CrowdOptions& options);

  /// Moves all characters to a moment, and commits.
  FrameTimes move(double seconds);

  const nifkit::Scene& scene() const { return scene_; }
  /// How far off its surface rays should start, by instance of the scene.
  float bias(uint32_t instance) const { return biases_.at(instance); }
  /// Colour of a hit, linear. from_asset: what the hit says, for the place.
  Float3 colour(uint32_t instance, uint32_t triangle, float u, float v, const Float3& from_asset) const;

  // What the characters take, in bytes.
  uint64_t asset_bytes() const { return asset_.info().resident_bytes; }
  uint64_t place_bytes() const { return place_.info().resident_bytes; }
  uint64_t scene_bytes_at_rest() const { return scene_bytes_at_rest_; }
  /// What a frame passes to the scene: matrices of joints, and transforms.
  uint64_t bytes_of_a_frame() const;
  uint32_t bending_triangles() const { return bending_triangles_; }
  uint32_t triangles() const { return triangles_; }  ///< of a character, with what it carries
  size_t joint_count() const { return matrices_.size(); }

 private:
  /// An instance of the character's file.
  struct Part {
    int node = -1;  ///< that moves it; -1: none
    Transform in_file = kIdentity, from_rest = kIdentity;
    bool bends = false;
  };
  struct Member {
    float angle, radius, height;
    double phase;  ///< in seconds of the clip
    uint32_t first;
    Transform place;
  };
  void read_parts(const Gltf& file, const CrowdOptions& options);
  void set_biases(const nifkit::Asset& asset, uint32_t first, uint32_t count);
  float ground_below(float x, float y, float z) const;

  Rig rig_;
  nifkit::Asset place_, asset_;
  nifkit::Scene scene_;
  std::vector<Part> parts_;
  std::vector<bool> hidden_;
  std::vector<uint32_t> joints_;  ///< nodes
  std::vector<Transform> inverse_binds_, matrices_;
  std::vector<Bone> bones_;
  std::vector<Transform> world_;
  std::vector<Look> look_;  ///< one
  std::vector<Member> members_;
  std::vector<float> biases_;
  float x_, z_, speed_;
  uint32_t first_character_ = 0, bending_triangles_ = 0, triangles_ = 0;
  uint64_t scene_bytes_at_rest_ = 0;
};

/// Seconds of processor time of this thread: what other programs take on a busy machine does not count.
double thread_seconds();
