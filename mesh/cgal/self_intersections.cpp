// CGAL's sweep finds overlapping boxes, and its exact predicates test the pairs of triangles in them, in
// batches on all threads. (CGAL's own function for this requires a mesh with at most two triangles per edge;
// this one serves meshes that do not meet that yet.)
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangle_3.h>
#include <CGAL/box_intersection_d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "mesh/cgal/cgal.hpp"

namespace nif::cgal {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;
using Pair = std::pair<uint32_t, uint32_t>;

class Pairs {
 public:
  /// Thrown by flush().
  struct TooMany {};

  Pairs(const mesh::CleanMesh& mesh, const std::atomic<bool>& cancel, uint64_t most)
      : mesh_(mesh),
        cancel_(cancel),
        left_(most),
        hit_(std::make_unique<std::atomic<bool>[]>(mesh.triangles.size())) {}

  void add(uint32_t a, uint32_t b) {
    batch_.emplace_back(a, b);
    if (batch_.size() == kBatch) flush();
  }

  void flush() {
    if (cancel_) throw Error(Status::interrupted, "the search for self-intersections was cancelled");
    if (batch_.size() > left_) throw TooMany();
    left_ -= batch_.size();
    std::atomic<uint64_t> found{0};
    constexpr size_t kGrain = 256;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, batch_.size(), kGrain), [&](const auto& range) {
      for (size_t i = range.begin(); i < range.end(); ++i) {
        const auto [a, b] = batch_[i];
        if (!intersect(mesh_.triangles[a], mesh_.triangles[b])) continue;
        ++found;
        hit_[a] = hit_[b] = true;
      }
    });
    pairs_ += found;
    batch_.clear();
  }

  SelfIntersections result() const {
    SelfIntersections result{pairs_, 0};
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) result.triangles += hit_[t];
    return result;
  }

 private:
  static constexpr size_t kBatch = 1 << 16;

  Point point(uint32_t vertex) const {
    const mesh::Float3& p = mesh_.positions[vertex];
    return {p[0], p[1], p[2]};
  }

  bool intersect(mesh::Triangle a, mesh::Triangle b) const {
    // Moves shared vertices to the front, in the same positions of both.
    size_t shared = 0;
    for (size_t i = 0; i < 3; ++i) {
      const auto found = std::find(b.begin() + std::ptrdiff_t(shared), b.end(), a[i]);
      if (found == b.end()) continue;
      std::swap(a[i], a[shared]);
      std::iter_swap(found, b.begin() + std::ptrdiff_t(shared));
      ++shared;
    }
    const std::array p{point(a[0]), point(a[1]), point(a[2])}, q{point(b[0]), point(b[1]), point(b[2])};
    const Kernel::Triangle_3 first(p[0], p[1], p[2]), second(q[0], q[1], q[2]);
    switch (shared) {
      case 0:
        return CGAL::do_intersect(first, second);
      case 1:  // besides the vertex: the opposite side of one triangle meets the other triangle
        return CGAL::do_intersect(first, Kernel::Segment_3(q[1], q[2])) ||
               CGAL::do_intersect(second, Kernel::Segment_3(p[1], p[2]));
      case 2:  // folded onto each other
        return CGAL::coplanar(p[0], p[1], p[2], q[2]) &&
               CGAL::coplanar_orientation(p[0], p[1], p[2], q[2]) == CGAL::POSITIVE;
      default:
        return false;
    }
  }

  const mesh::CleanMesh& mesh_;
  const std::atomic<bool>& cancel_;
  uint64_t left_;  ///< pairs that may still be tested
  std::vector<Pair> batch_;
  uint64_t pairs_ = 0;
  std::unique_ptr<std::atomic<bool>[]> hit_;
};

}  // namespace

std::optional<SelfIntersections> find_self_intersections(const mesh::CleanMesh& mesh,
                                                         const std::atomic<bool>& cancel,
                                                         uint64_t most_pairs) {
  std::vector<Box> boxes;
  boxes.reserve(mesh.triangles.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    CGAL::Bbox_3 bounds;
    for (const uint32_t v : mesh.triangles[t]) {
      const mesh::Float3& p = mesh.positions[v];
      bounds += CGAL::Bbox_3(p[0], p[1], p[2], p[0], p[1], p[2]);
    }
    boxes.emplace_back(bounds, t);
  }
  Pairs pairs(mesh, cancel, most_pairs);
  // The sweep permutes its input; with pointers that is cheaper.
  std::vector<const Box*> handles;
  handles.reserve(boxes.size());
  for (const Box& box : boxes) handles.push_back(&box);
  constexpr std::ptrdiff_t kCutoff = 1000;  // below it every pair is tested; the value of CGAL's examples
  try {
    CGAL::box_self_intersection_d(
        handles.begin(), handles.end(), [&](const Box* a, const Box* b) { pairs.add(a->info(), b->info()); },
        kCutoff);
    pairs.flush();
  } catch (const Pairs::TooMany&) {
    return std::nullopt;
  }
  return pairs.result();
}

}  // namespace nif::cgal
