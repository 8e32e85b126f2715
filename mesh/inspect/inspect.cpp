// Sorts the sides of all triangles by edge, so that the triangles of an edge are adjacent. Two union-find
// structures do the rest: one of triangles for components, one of corners for the fans around vertices.
#include "mesh/inspect/inspect.hpp"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "formats/base/disjoint_sets.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/clean.hpp"
#include "formats/mesh/sides.hpp"

namespace nif::inspect {
namespace {

using mesh::Float3;
using mesh::Side;
using mesh::Triangle;

/// Number of triangles with the same corners as an earlier one. Those that also face the same way are already
/// removed.
uint64_t count_opposite(std::vector<Triangle> triangles) {
  for (Triangle& t : triangles) std::sort(t.begin(), t.end());
  tbb::parallel_sort(triangles.begin(), triangles.end());
  uint64_t count = 0;
  for (size_t i = 1; i < triangles.size(); ++i) count += triangles[i] == triangles[i - 1];
  return count;
}

/// The connectivity of the mesh after cleaning.
class Net {
 public:
  explicit Net(const mesh::CleanMesh& mesh)
      : mesh_(mesh),
        count_(mesh.triangles.size() + mesh.slivers.size()),
        sides_(mesh::sorted_sides(mesh.triangles, mesh.slivers)),
        pieces_(count_),
        fans_(count_ * 3) {
    for (size_t begin = 0; begin < sides_.size();) {
      const size_t end = mesh::end_of_edge(sides_, begin);
      for (size_t i = begin + 1; i < end; ++i) join(sides_[begin], sides_[i]);
      begin = end;
    }
  }

  void describe(Inspection& out) {
    number_components(out);
    count_edges(out);
    count_fans(out);
    count_loops(out);
    measure(out);
  }

 private:
  const Triangle& triangle(size_t t) const {
    return t < mesh_.triangles.size() ? mesh_.triangles[t] : mesh_.slivers[t - mesh_.triangles.size()];
  }
  /// Corners have consecutive numbers, three per triangle.
  static uint32_t from(const Side& side) { return side.triangle * 3 + side.corner; }
  static uint32_t to(const Side& side) { return side.triangle * 3 + (side.corner + 1) % 3; }

  /// Joins two triangles at an edge: into one component, and into one fan around each of the edge's ends.
  void join(const Side& a, const Side& b) {
    pieces_.unite(a.triangle, b.triangle);
    const bool same = a.sign == b.sign;
    fans_.unite(from(a), same ? from(b) : to(b));
    fans_.unite(to(a), same ? to(b) : from(b));
  }

  Component& component_of(Inspection& out, uint32_t triangle) {
    return out.components[component_[pieces_.find(triangle)]];
  }

  void number_components(Inspection& out) {
    component_.resize(count_);
    for (uint32_t t = 0; t < count_; ++t) {
      if (pieces_.find(t) == t) {
        component_[t] = uint32_t(out.components.size());
        out.components.emplace_back();
      }
      Component& component = component_of(out, t);
      ++component.triangles;
      ++component.euler;
    }
  }

  void count_edges(Inspection& out) {
    for (size_t begin = 0; begin < sides_.size();) {
      const size_t end = mesh::end_of_edge(sides_, begin), sides = end - begin;
      Component& component = component_of(out, sides_[begin].triangle);
      ++out.edges;
      --component.euler;
      component.boundary_edges += sides == 1;
      component.non_manifold_edges += sides > 2;
      component.inconsistent_edges += sides == 2 && sides_[begin].sign == sides_[begin + 1].sign;
      begin = end;
    }
    for (const Component& component : out.components) {
      out.boundary_edges += component.boundary_edges;
      out.non_manifold_edges += component.non_manifold_edges;
      out.inconsistent_edges += component.inconsistent_edges;
    }
  }

  void count_fans(Inspection& out) {
    std::vector<uint8_t> fans(mesh_.positions.size());  // 2 means two or more
    for (uint32_t t = 0; t < count_; ++t)
      for (uint32_t corner = 0; corner < 3; ++corner) {
        if (fans_.find(t * 3 + corner) != t * 3 + corner) continue;
        ++component_of(out, t).euler;
        uint8_t& count = fans[triangle(t)[corner]];
        count = std::min<uint8_t>(count + 1, 2);
      }
    out.non_manifold_vertices = uint64_t(std::count(fans.begin(), fans.end(), 2));
  }

  /// A boundary edge is followed by the one in the same fan at its end.
  void count_loops(Inspection& out) {
    struct End {
      uint32_t fan, edge;
    };
    std::vector<End> ends;
    uint32_t edges = 0;
    for (size_t begin = 0; begin < sides_.size();) {
      const size_t end = mesh::end_of_edge(sides_, begin);
      if (end - begin == 1) {
        ends.push_back({fans_.find(from(sides_[begin])), edges});
        ends.push_back({fans_.find(to(sides_[begin])), edges++});
      }
      begin = end;
    }
    tbb::parallel_sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
      return a.fan != b.fan ? a.fan < b.fan : a.edge < b.edge;
    });
    DisjointSets loops(edges);
    for (size_t i = 1; i < ends.size(); ++i)
      if (ends[i].fan == ends[i - 1].fan) loops.unite(ends[i].edge, ends[i - 1].edge);
    std::vector<uint64_t> lengths(edges);
    for (uint32_t edge = 0; edge < edges; ++edge) ++lengths[loops.find(edge)];
    for (const uint64_t length : lengths) {
      out.boundary_loops += length > 0;
      out.longest_loop = std::max(out.longest_loop, length);
    }
  }

  void measure(Inspection& out) {
    // Relative to the centre of the bounds, to keep precision far from the origin.
    Double3 middle;
    for (size_t axis = 0; axis < 3; ++axis) middle[axis] = (double(out.low[axis]) + out.high[axis]) / 2;
    for (uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& v = mesh_.triangles[t];
      const Double3 a = to_double(mesh_.positions[v[0]]) - middle,
                    b = to_double(mesh_.positions[v[1]]) - middle,
                    c = to_double(mesh_.positions[v[2]]) - middle, normal = cross(b - a, c - a);
      Component& component = component_of(out, t);
      component.area += std::sqrt(dot(normal, normal)) / 2;
      component.volume += dot(a, normal) / 6;
    }
    for (const Component& component : out.components) {
      out.area += component.area;
      if (component.solid()) out.volume += component.volume;
    }
  }

  const mesh::CleanMesh& mesh_;
  size_t count_;
  std::vector<Side> sides_;
  DisjointSets pieces_, fans_;
  std::vector<uint32_t> component_;  // indexed by the triangle that represents a component
};

template <class Predicate>
uint64_t count_if(const std::vector<Component>& components, Predicate predicate) {
  return uint64_t(std::count_if(components.begin(), components.end(), predicate));
}

}  // namespace

std::vector<Component> Inspection::largest(size_t count) const {
  std::vector<const Component*> order;
  for (const Component& component : components) order.push_back(&component);
  count = std::min(count, order.size());
  std::partial_sort(order.begin(), order.begin() + std::ptrdiff_t(count), order.end(),
                    [](const Component* a, const Component* b) {
                      return a->triangles != b->triangles ? a->triangles > b->triangles : a < b;
                    });
  std::vector<Component> found;
  for (size_t i = 0; i < count; ++i) found.push_back(*order[i]);
  return found;
}

uint64_t Inspection::closed_components() const {
  return count_if(components, [](const Component& c) { return c.closed(); });
}
uint64_t Inspection::solids() const {
  return count_if(components, [](const Component& c) { return c.solid(); });
}
uint64_t Inspection::inward_solids() const {
  return count_if(components, [](const Component& c) { return c.solid() && c.volume < 0; });
}

Inspection& Inspection::operator+=(const Inspection& other) {
  if (other.distinct_vertices > 0) {
    for (size_t axis = 0; axis < 3; ++axis) {
      low[axis] = distinct_vertices == 0 ? other.low[axis] : std::min(low[axis], other.low[axis]);
      high[axis] = distinct_vertices == 0 ? other.high[axis] : std::max(high[axis], other.high[axis]);
    }
  }
  triangles += other.triangles, vertices += other.vertices, distinct_vertices += other.distinct_vertices;
  degenerate += other.degenerate, duplicate += other.duplicate, opposite += other.opposite;
  edges += other.edges, boundary_edges += other.boundary_edges;
  non_manifold_edges += other.non_manifold_edges, inconsistent_edges += other.inconsistent_edges;
  non_manifold_vertices += other.non_manifold_vertices;
  boundary_loops += other.boundary_loops, longest_loop = std::max(longest_loop, other.longest_loop);
  area += other.area, volume += other.volume;
  components.insert(components.end(), other.components.begin(), other.components.end());
  return *this;
}

Inspection inspect(const mesh::Mesh& mesh, bool welded) {
  const mesh::CleanMesh clean = mesh::clean_or_nothing(mesh, welded);
  Inspection out;
  out.triangles = mesh.triangles.size();
  out.vertices = mesh.positions.size();
  out.distinct_vertices = clean.positions.size();
  if (!clean.positions.empty()) out.low = out.high = clean.positions[0];
  for (const Float3& p : clean.positions)
    for (size_t axis = 0; axis < 3; ++axis) {
      out.low[axis] = std::min(out.low[axis], p[axis]);
      out.high[axis] = std::max(out.high[axis], p[axis]);
    }
  out.degenerate = clean.report.degenerate;
  out.duplicate = clean.report.duplicate;
  out.opposite = count_opposite(clean.triangles);
  Net(clean).describe(out);
  return out;
}

}  // namespace nif::inspect
