// Orders children. From the leaves up, it estimates how likely a line through a box meets a triangle
// (Cauchy's formula), and the cost of finding out. Leaves stay first; then come inner children that block
// much at little cost.
#include "bake/triangles/order.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bake/triangles/binary_tree.hpp"
#include "formats/mesh/box.hpp"

namespace nif::bake {
namespace {

using Branch = format::BvhBranch;

double area_of(const mesh::Float3& p, const mesh::Float3& q, const mesh::Float3& r) {
  std::array<double, 3> u, v;
  for (size_t a = 0; a < 3; ++a) {
    u[a] = double(q[a]) - double(p[a]);
    v[a] = double(r[a]) - double(p[a]);
  }
  const double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
  return std::sqrt(x * x + y * y + z * z) / 2;
}

/// For lines that meet a branch's box, with all positions and directions equally likely.
struct Estimate {
  mesh::Box box = mesh::bounds(std::span<const mesh::Float3>(), {});  ///< around nothing
  double blocked = 0;                                                 ///< the share that meets a triangle
  double cost = 1;  ///< nodes and leaves that they visit, on average
};

/// At most 1, even if a box is flat or so small that its surface is 0.
double share(double part, double whole) { return part < whole ? part / whole : 1; }

class Sorter {
 public:
  Sorter(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles)
      : positions_(positions), triangles_(triangles) {}

  Estimate sort(Branch& branch) const { return branch.child_count > 0 ? sort_node(branch) : look_at(branch); }

 private:
  Estimate look_at(const Branch& leaf) const {
    Estimate result;
    double area = 0;
    for (uint32_t i = 0; i < leaf.triangle_count; ++i) {
      const mesh::Triangle& t = triangles_[leaf.triangles[i]];
      result.box.add(positions_, t);
      area += area_of(positions_[t[0]], positions_[t[1]], positions_[t[2]]);
    }
    // A line that meets the box meets 2 area / surface triangles on average (Cauchy).
    result.blocked = share(area, half_surface(result.box));
    return result;
  }

  Estimate sort_node(Branch& node) const {
    struct Child {
      Branch* branch;
      Estimate estimate;
    };
    std::array<Child, kernels::kBvhWidth> children;
    const auto begin = children.begin(), end = begin + node.child_count;
    Estimate result;
    for (uint32_t i = 0; i < node.child_count; ++i) {
      children[i] = {node.children[i], sort(*node.children[i])};
      result.box.add(children[i].estimate.box);
    }
    const auto inner =
        std::stable_partition(begin, end, [](const Child& c) { return c.branch->child_count == 0; });
    std::stable_sort(inner, end, [](const Child& a, const Child& b) {
      return a.estimate.blocked * b.estimate.cost > b.estimate.blocked * a.estimate.cost;
    });
    double passed = 1;
    for (uint32_t i = 0; i < node.child_count; ++i) {
      const Estimate& child = children[i].estimate;
      const double met = share(half_surface(child.box), half_surface(result.box));
      node.children[i] = children[i].branch;
      result.cost += passed * met * child.cost;
      passed *= 1 - met * child.blocked;
    }
    result.blocked = 1 - passed;
    return result;
  }

  std::span<const mesh::Float3> positions_;
  std::span<const mesh::Triangle> triangles_;
};

}  // namespace

void order_children(format::BvhBranch& root, std::span<const mesh::Float3> positions,
                    std::span<const mesh::Triangle> triangles) {
  Sorter(positions, triangles).sort(root);
}

}  // namespace nif::bake
