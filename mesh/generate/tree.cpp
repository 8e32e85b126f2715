// `tree`: limbs as tapered tubes, with at most a fifth of the triangles, and leaves of four triangles each:
// two halves that are folded along the rib, and two below them that close the leaf.
#include <algorithm>
#include <cmath>

#include "formats/base/random.hpp"
#include "mesh/generate/axes.hpp"
#include "mesh/generate/computed.hpp"
#include "mesh/generate/shapes.hpp"
#include "mesh/generate/tree_tubes.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kLeafStream = 0x6c656166;  // "leaf"
constexpr double kLongestLeaf = 0.6;

class Tree {
 public:
  explicit Tree(const Request& request)
      : seed_(request.seed), limbs_(Habit(), request.seed, request.triangles / 5) {
    leaves_ = (request.triangles - limbs_.triangle_count()) / 4;
    // Leaves cover the same total area, whatever their number.
    leaf_ = std::min(kLongestLeaf, 26 / std::sqrt(double(leaves_)));
  }

  uint64_t vertex_count() const { return limbs_.vertex_count() + 4 * leaves_; }
  uint64_t triangle_count() const { return limbs_.triangle_count() + 4 * leaves_; }

  Double3 vertex(uint64_t index) const {
    if (index < limbs_.vertex_count()) return limbs_.vertex(index);
    index -= limbs_.vertex_count();
    return leaf_vertex(index / 4, index % 4);
  }

  mesh::Triangle triangle(uint64_t index) const {
    if (index < limbs_.triangle_count()) return limbs_.triangle(index);
    index -= limbs_.triangle_count();
    const auto rib = uint32_t(limbs_.vertex_count() + index / 4 * 4);
    const uint32_t end = rib + 1, left = rib + 2, right = rib + 3;
    constexpr size_t kHalves = 2;
    if (index % 4 < kHalves)
      return index % 4 == 0 ? mesh::Triangle{rib, end, left} : mesh::Triangle{rib, right, end};
    return index % 4 == kHalves ? mesh::Triangle{rib, left, right} : mesh::Triangle{end, right, left};
  }

 private:
  /// Base and end of the rib, left and right.
  Double3 leaf_vertex(uint64_t leaf, uint64_t corner) const {
    Random random(seed_, kLeafStream, leaf);
    const Limb& limb = limbs_.leafy((double(leaf) + random.uniform()) / double(leaves_));
    const double t = random.uniform(0.15, 1);
    const Double3 along = limb.tangent(t), stem = limb.at(t);
    // Around the limb, farther away if no finer limbs carry leaves.
    const double reach = 0.3 * leaf_ + 0.22 * limb.length * random.uniform();
    const Double3 away = random.direction();
    const Double3 base = stem + (away - along * (0.7 * dot(away, along))) * reach;
    Double3 rib = along * 0.5 + away + Double3{0, -0.15, 0} + random.direction() * 0.5;
    rib = rib * (1 / std::fmax(length(rib), 0.05));
    if (corner == 0) return base;
    const double size = leaf_ * random.uniform(0.7, 1.15);
    if (corner == 1) return base + rib * size;
    // The upper side faces roughly upwards.
    const Double3 up = Double3{0, 1, 0} + random.direction() * 0.6;
    Double3 left = cross(up, rib);
    const double flat = length(left);
    left = flat > 0.05 ? left * (1 / flat) : perpendicular(unit(rib));
    const Double3 above = cross(rib, left);
    return base + (rib * 0.42 + left * (corner == 2 ? 0.26 : -0.26) - above * 0.08) * size;
  }

  uint64_t seed_;
  LimbTubes limbs_;
  uint64_t leaves_ = 0;
  double leaf_ = 0;  ///< length
};

}  // namespace

std::unique_ptr<mesh::MeshSource> make_tree(const Request& request) { return computed(Tree(request)); }

}  // namespace nif::generate
