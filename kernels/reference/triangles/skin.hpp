// How joints and morph targets move the vertices of an object (docs/answers.md, "Posed vertices").
#pragma once

#include <cstdint>

namespace nif::kernels {

inline constexpr uint32_t kMostInfluences = 8;
inline constexpr uint32_t kMostJoints = 1u << 16;

/// Of the vertices of an object's source.
struct SkinField {
  uint32_t vertex_count = 0;
  uint32_t joint_count = 0;   ///< 0: there are only morph targets
  uint32_t influences = 0;    ///< of each vertex: 0 without joints, else 4 or kMostInfluences
  uint32_t target_count = 0;  ///< morph targets
  /// [vertex_count][influences], from 0 to 1; those of a vertex add up to 1, by kWeightSlack.
  const float* weights = nullptr;
  const float (*targets)[3] = nullptr;  ///< [target_count][vertex_count]: how far each moves a vertex
  const uint16_t* joints = nullptr;     ///< [vertex_count][influences]
};

/// The weights of a vertex may add up to this much more or less than 1.
inline constexpr float kWeightSlack = 0x1p-10f;

}  // namespace nif::kernels
