// A transform is flat if its condition number is too large, by the bound that kernels use for instances.
// Vertices are transformed in doubles and rounded once. Triangles that rounding alone could produce are
// dropped.
#include "formats/mesh/flat_meshes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "formats/base/memory.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/readers.hpp"
#include "formats/mesh/skin.hpp"

namespace nif::mesh::detail {
namespace {

Double3 moved(const Affine& linear, const Float3& p) {
  Double3 out;
  for (size_t row = 0; row < 3; ++row)
    out[row] = linear[4 * row] * double{p[0]} + linear[4 * row + 1] * double{p[1]} +
               linear[4 * row + 2] * double{p[2]};
  return out;
}

/// The distance of a mesh's corners from its origin, and the longest side of their box.
struct Extent {
  double reach = 0, side = 0;
};

Extent extent_of(const Mesh& mesh, const Affine& linear) {
  Double3 low, high;
  low.fill(INFINITY);
  high.fill(-INFINITY);
  for (const Triangle& triangle : mesh.triangles)
    for (const uint32_t v : triangle) {
      const Double3 p = moved(linear, mesh.positions[v]);
      for (size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], p[a]);
        high[a] = std::max(high[a], p[a]);
      }
    }
  Extent extent;
  for (size_t a = 0; a < 3; ++a) {
    extent.reach = std::max({extent.reach, std::abs(low[a]), std::abs(high[a])});
    extent.side = std::max(extent.side, high[a] - low[a]);
  }
  return extent;
}

/// In addition to the triangles that were read: a small file may flatten one large mesh in many ways.
constexpr uint64_t kMostFlattened = uint64_t{1} << 25;

/// Whether the triangle's height above its longest side exceeds `least`.
bool is_higher(const Double3& a, const Double3& b, const Double3& c, double least) {
  const Double3 ab = b - a, ac = c - a, bc = c - b;
  const double longest = std::max({length(ab), length(ac), length(bc)});
  return length(cross(ab, ac)) > least * longest;
}

}  // namespace

bool is_flat(const Affine& place) {
  Transform rounded;
  for (size_t i = 0; i < rounded.size(); ++i) rounded[i] = static_cast<float>(place[i]);
  if (flattens(rounded)) return true;
  const std::array<Double3, 3> rows{Double3{place[0], place[1], place[2]},
                                    Double3{place[4], place[5], place[6]},
                                    Double3{place[8], place[9], place[10]}};
  const double whole = dot(rows[0], cross(rows[1], rows[2]));
  double norm = 0, inverse = 0;
  for (size_t a = 0; a < 3; ++a) {
    const Double3 cofactors = cross(rows[(a + 1) % 3], rows[(a + 2) % 3]) * (1 / whole);
    norm += dot(rows[a], rows[a]);
    inverse += dot(cofactors, cofactors);
  }
  // As in kernels::invert(). Written so that NaN counts as flat.
  return !(std::sqrt(norm) * std::sqrt(inverse) <= 4096.0 * 3);
}

FlatMeshes::FlatMeshes(const Input& input, Scene& scene) : input_(input), scene_(scene) {
  for (const Mesh& mesh : scene.meshes) read_ += mesh.triangles.size();
}

std::optional<uint32_t> FlatMeshes::add(uint32_t mesh, const Affine& place) {
  Affine linear = place;
  for (size_t i = 0; i < linear.size(); ++i) linear[i] = i % 4 == 3 ? 0 : linear[i] + 0.0;  // -0 is 0
  const auto [known, fresh] = known_.try_emplace({mesh, linear});
  if (fresh) known->second = make(mesh, linear);
  return known->second;
}

std::optional<uint32_t> FlatMeshes::make(uint32_t index, const Affine& linear) {
  const Mesh& mesh = scene_.meshes[index];
  const auto is_beyond = [&](const Triangle& t) { return std::ranges::max(t) >= mesh.positions.size(); };
  if (std::ranges::any_of(mesh.triangles, is_beyond)) return index;  // unchanged: check() refuses it
  if (std::ranges::all_of(linear, [](double x) { return x == 0; })) return std::nullopt;
  looked_at_ += std::max<uint64_t>(mesh.triangles.size(), mesh.positions.size() / 3);
  check_triangle_limit(input_, looked_at_);
  if (looked_at_ > read_ + kMostFlattened)
    input_.fail(
        Status::too_large,
        fmt::format("has more than {} triangles that transforms of nodes flatten, each in its own way",
                    kMostFlattened));
  const Extent extent = extent_of(mesh, linear);
  if (!(extent.side >= 1e-15 && extent.side <= 1e15 && extent.reach <= 1e30)) return std::nullopt;
  // Half a unit in the last place of a coordinate is 2^-25 of the reach; this is twice that, twice along each
  // edge.
  const double least = std::ldexp(extent.reach, -22);
  const bool any = std::ranges::any_of(mesh.triangles, [&](const Triangle& t) {
    return is_higher(moved(linear, mesh.positions[t[0]]), moved(linear, mesh.positions[t[1]]),
                     moved(linear, mesh.positions[t[2]]), least);
  });
  if (!any) return std::nullopt;
  require_memory(mesh.positions.size() * sizeof(Float3) + mesh.triangles.size() * sizeof(Triangle) +
                     mesh.holes.size() * sizeof(TriangleHoles) +
                     (mesh.skin ? mesh.skin->targets.size() : 0) * mesh.positions.size() * sizeof(Float3),
                 input_.file.string() + ": a mesh that its node flattens");
  Mesh flat = mesh;
  for (Float3& p : flat.positions) {
    const Double3 at = moved(linear, p);
    for (size_t a = 0; a < 3; ++a) p[a] = static_cast<float>(at[a]);
  }
  if (flat.skin) {  // only targets: what joints bend is never flat
    Skin skin = *flat.skin;
    for (std::vector<Float3>& target : skin.targets)
      for (Float3& move : target) move = to_float(moved(linear, move));
    flat.skin = std::make_shared<const Skin>(std::move(skin));
  }
  scene_.meshes.push_back(std::move(flat));
  return static_cast<uint32_t>(scene_.meshes.size() - 1);
}

}  // namespace nif::mesh::detail
