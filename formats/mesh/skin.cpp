// Linear blend skinning in doubles: the plain code that others are compared with.
#include "formats/mesh/skin.hpp"

#include <algorithm>

#include "formats/base/vector.hpp"

namespace nif::mesh {
namespace {

Double3 morphed(const Float3& position, size_t vertex, const Skin& skin, std::span<const float> weights) {
  Double3 p = to_double(position);
  for (size_t t = 0; t < std::min(weights.size(), skin.targets.size()); ++t)
    for (size_t a = 0; a < 3; ++a) p[a] += double{weights[t]} * double{skin.targets[t][vertex][a]};
  return p;
}

Double3 blended(const Double3& p, size_t vertex, const Skin& skin, std::span<const JointMatrix> joints) {
  Double3 sum{};
  for (size_t k = 0; k < skin.influences; ++k) {
    const size_t at = vertex * skin.influences + k;
    const double weight = double{skin.weights[at]};
    if (weight == 0) continue;
    const JointMatrix& m = joints[skin.joints[at]];
    for (size_t row = 0; row < 3; ++row)
      sum[row] += weight * (double{m[4 * row]} * p[0] + double{m[4 * row + 1]} * p[1] +
                            double{m[4 * row + 2]} * p[2] + double{m[4 * row + 3]});
  }
  return sum;
}

}  // namespace

bool bend_alike(const Skin* a, const Skin* b) {
  if (a == b) return true;
  return a && b && a->influences == b->influences && a->joint_count == b->joint_count &&
         a->joints == b->joints && a->weights == b->weights && a->targets == b->targets;
}

std::vector<Float3> bent(const Mesh& mesh, std::span<const JointMatrix> joints,
                         std::span<const float> weights) {
  if (!mesh.skin) return mesh.positions;
  const Skin& skin = *mesh.skin;
  std::vector<Float3> positions;
  positions.reserve(mesh.positions.size());
  for (size_t v = 0; v < mesh.positions.size(); ++v) {
    const Double3 p = morphed(mesh.positions[v], v, skin, weights);
    const bool jointed = skin.influences > 0 && joints.size() >= skin.joint_count;
    positions.push_back(to_float(jointed ? blended(p, v, skin, joints) : p));
  }
  return positions;
}

}  // namespace nif::mesh
