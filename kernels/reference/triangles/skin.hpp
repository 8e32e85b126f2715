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

/// Columns of a joint's matrix, the last of which is the translation; the fourth row is 0.
struct alignas(64) JointMatrix {
  float columns[4][4];
};

/// The vertices of a skin in the order in which kernels move them: those with equally many joints follow each other, and
/// joints with the weight 0 are left out, except a vertex's first.
struct SkinOrder {
  uint32_t vertex_count[kMostInfluences + 1];  ///< by number of joints
  // Of one vertex after the other.
  const float* weights;
  const uint16_t* joints;
};

/// Moves vertices by joints. `from`: x, y, z, 1. `to`, which may be `from`: x, y, z, 0.
inline void skin_vertices(const SkinOrder& order, const JointMatrix* matrices, const float (*from)[4],
                          float (*to)[4]) {
  const float* weights = order.weights;
  const uint16_t* joints = order.joints;
  for (uint32_t influences = 1; influences <= kMostInfluences; ++influences)
    for (uint32_t v = 0; v < order.vertex_count[influences]; ++v, ++from, ++to) {
      float at[4];
      for (int row = 0; row < 4; ++row) {
        float mean[4];
        for (int column = 0; column < 4; ++column) {
          mean[column] = matrices[joints[0]].columns[column][row] * weights[0];
          for (uint32_t k = 1; k < influences; ++k)
            mean[column] += matrices[joints[k]].columns[column][row] * weights[k];
        }
        at[row] = ((mean[0] * from[0][0] + mean[1] * from[0][1]) + mean[2] * from[0][2]) + mean[3];
      }
      for (int row = 0; row < 4; ++row) to[0][row] = at[row];
      weights += influences;
      joints += influences;
    }
}

}  // namespace nif::kernels
