// Running sums over the instances tell to which one a vertex or triangle belongs. So any range of the merged
// mesh can be made when a writer requests it; only flatten() has all of it in memory.
#include "formats/mesh/flat_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/base/memory.hpp"
#include "formats/base/rounding.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/hole_collector.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh {
namespace {

/// Calls `fill(instance, first, count)` for each instance's part of a range, in order.
template <class Fill>
void cut(const std::vector<uint64_t>& firsts, uint64_t first, uint64_t count, Fill fill) {
  size_t instance = size_t(std::upper_bound(firsts.begin(), firsts.end(), first) - firsts.begin()) - 1;
  while (count > 0) {
    const uint64_t part = std::min(count, firsts[instance + 1] - first);
    fill(instance, first - firsts[instance], part);
    first += part, count -= part;
    ++instance;
  }
}

}  // namespace

FlatScene::FlatScene(std::span<const Mesh> meshes, std::span<const Instance> instances)
    : meshes_(meshes), instances_(instances), first_vertex_{0}, first_triangle_{0} {
  for (const Instance& instance : instances) {
    const Mesh& mesh = meshes[instance.mesh];
    first_vertex_.push_back(first_vertex_.back() + mesh.positions.size());
    first_triangle_.push_back(first_triangle_.back() + mesh.triangles.size());
    mirrored_.push_back(determinant(instance.transform) < 0);
  }
  if (first_vertex_.back() > std::numeric_limits<uint32_t>::max())
    throw Error(Status::too_large, "its instances have " + std::to_string(first_vertex_.back()) +
                                       " vertices together, more than 32-bit indices can address");
}

void FlatScene::vertices(uint64_t first, std::span<Float3> out) const {
  cut(first_vertex_, first, out.size(),
      [&, at = out.begin()](size_t i, uint64_t from, uint64_t count) mutable {
        const Instance& instance = instances_[i];
        const auto begin = meshes_[instance.mesh].positions.begin() + std::ptrdiff_t(from),
                   end = begin + std::ptrdiff_t(count);
        at = unplaced(instance) ? std::copy(begin, end, at)
                                : std::transform(begin, end, at, [&](const Float3& p) {
                                    return to_float(placed(instance, p));
                                  });
      });
}

void FlatScene::exact(uint64_t first, std::span<Double3> out) const {
  cut(first_vertex_, first, out.size(),
      [&, at = out.begin()](size_t i, uint64_t from, uint64_t count) mutable {
        const Instance& instance = instances_[i];
        const auto begin = meshes_[instance.mesh].positions.begin() + std::ptrdiff_t(from);
        const bool known_as_floats = unplaced(instance), is_far = far(i);
        at = std::transform(begin, begin + std::ptrdiff_t(count), at, [&](const Float3& p) {
          if (known_as_floats) return to_double(p);
          Double3 exact = placed(instance, p);
          if (!is_far) return to_double(to_float(exact));
          for (size_t a = 0; a < 3; ++a) exact[a] = shortest_near(exact[a], (*offsets_[i])[a]);
          return exact;
        });
      });
}

void FlatScene::find_far() {
  offsets_.clear();
  for (const Instance& instance : instances_)
    offsets_.push_back(far_offset(meshes_[instance.mesh], instance));
}

bool FlatScene::needs_doubles() const {
  for (size_t i = 0; i < instances_.size(); ++i)
    if (far(i) && !unplaced(instances_[i])) return true;
  return false;
}

double FlatScene::rounding() const {
  double most = 0;
  for (size_t i = 0; i < instances_.size(); ++i) {
    if (!far(i)) continue;
    for (const Float3& p : meshes_[instances_[i].mesh].positions) {
      for (const double axis : placed(instances_[i], p)) most = std::max(most, std::abs(lost_to_float(axis)));
    }
  }
  return most;
}

void FlatScene::triangles(uint64_t first, std::span<Triangle> out) const {
  cut(first_triangle_, first, out.size(),
      [&, at = out.begin()](size_t i, uint64_t from, uint64_t count) mutable {
        const auto begin = meshes_[instances_[i].mesh].triangles.begin() + std::ptrdiff_t(from);
        at = std::transform(begin, begin + std::ptrdiff_t(count), at, [&](Triangle t) {
          for (uint32_t& v : t) v += uint32_t(first_vertex_[i]);
          if (mirrored_[i]) std::swap(t[1], t[2]);
          return t;
        });
      });
}

Appearance FlatScene::look() const {
  bool colors = false, coordinates = false, materials = false;
  for (const Instance& instance : instances_) {
    const Appearance& look = meshes_[instance.mesh].look;
    colors = colors || !look.colors.empty();
    coordinates = coordinates || !look.coordinates.empty();
    materials = materials || !look.materials.empty();
  }
  Appearance all;
  const auto append = [](auto& to, const auto& from, uint64_t end, const auto& otherwise) {
    to.insert(to.end(), from.begin(), from.end());
    to.resize(end, otherwise);
  };
  for (size_t i = 0; i < instances_.size(); ++i) {
    const Appearance& look = meshes_[instances_[i].mesh].look;
    if (colors) append(all.colors, look.colors, first_vertex_[i + 1], Float3{1, 1, 1});
    if (coordinates) append(all.coordinates, look.coordinates, first_vertex_[i + 1], std::array{0.0f, 0.0f});
    if (materials) append(all.materials, look.materials, first_triangle_[i + 1], uint32_t{0});
  }
  return all;
}

std::vector<TriangleAlpha> FlatScene::alpha() const {
  std::vector<TriangleAlpha> all;
  if (std::ranges::all_of(instances_, [&](const Instance& i) { return meshes_[i.mesh].alpha.empty(); }))
    return all;
  for (size_t i = 0; i < instances_.size(); ++i) {
    const std::vector<TriangleAlpha>& alpha = meshes_[instances_[i].mesh].alpha;
    all.insert(all.end(), alpha.begin(), alpha.end());
    all.resize(first_triangle_[i + 1], TriangleAlpha::solid);
  }
  return all;
}

void FlatScene::give_holes(Mesh& flat) const {
  detail::HoleCollector holes;
  for (size_t i = 0; i < instances_.size(); ++i) {
    const Mesh& mesh = meshes_[instances_[i].mesh];
    holes.add_all(first_triangle_[i], mesh.alpha_maps, mesh.holes, mirrored_[i]);
  }
  holes.finish(flat);
}

bool FlatScene::has_holes() const {
  return std::ranges::any_of(instances_, [&](const Instance& i) { return !meshes_[i.mesh].holes.empty(); });
}

Mesh flatten(const FlatScene& flat, const std::string& name) {
  // A file may place one mesh a million times.
  const size_t of_triangle = sizeof(Triangle) + (flat.has_holes() ? sizeof(TriangleHoles) : 0);
  require_memory(flat.vertex_count() * sizeof(Float3) + flat.triangle_count() * of_triangle,
                 "all instances as one mesh");
  Mesh mesh{name, std::vector<Float3>(flat.vertex_count()), std::vector<Triangle>(flat.triangle_count())};
  flat.vertices(0, mesh.positions);
  flat.triangles(0, mesh.triangles);
  mesh.look = flat.look();
  mesh.alpha = flat.alpha();
  flat.give_holes(mesh);
  return mesh;
}

}  // namespace nif::mesh
