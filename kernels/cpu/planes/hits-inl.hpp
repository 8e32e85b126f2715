// First hits of objects that have planes: a SIMD traversal lists the open cells of each ray, and the network,
// if there is one, tells for many rays at a time which cell has the hit.
// kernels/reference/planes/planes_hit.hpp defines the hits.
//
// Compiled once for each target.
#if defined(NIF_PLANES_HITS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_HITS_INL
#undef NIF_PLANES_HITS_INL
#else
#define NIF_PLANES_HITS_INL
#endif

#include "kernels/cpu/planes/grid_traversal-inl.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/planes/planes_hit.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct HitScratch {
  RayTable rays;
  FirstHitCellLog log;
  HardRays hard;
  // By end of the log: the range of its open cells that contains the first hit.
  uint8_t first[kBatchRays], last[kBatchRays];
  // Segments for the network.
  uint16_t asked[kBatchRays];  ///< ends of the log
  SegmentBatch questions;
  AnswerBatch answers;
};

/// The hits of the rays that a traversal has listed.
template <class Network>
class HitPlacer {
 public:
  HitPlacer(const PlanesField& field, const SegmentBatch& batch, const float* limit, const Network& network,
            HitScratch& scratch, HitBatch& hits)
      : field_(field),
        batch_(batch),
        limit_(limit),
        network_(network),
        s_(scratch),
        log_(scratch.log),
        hits_(hits) {}

  void place() const {
    for (uint32_t k = 0; k < log_.count; ++k) bound(k);
    if constexpr (!std::is_same_v<Network, NoNetwork>) {
      decide_open_rays();
      while (halve()) continue;
    }
    for (uint32_t k = 0; k < log_.count; ++k) finish(k);
  }

 private:
  static constexpr uint8_t kNowhere = 255;  ///< as `last`: there is no cell to choose

  uint32_t cells(uint32_t k) const { return std::min(uint32_t(log_.by_ray.cells[k]), OpenCells::kRoom); }
  /// The index in the log of a cell, numbered as KeepCells does.
  uint32_t index(uint32_t k, uint32_t cell) const {
    const auto first = uint32_t(log_.by_ray.first[k]);
    const uint32_t at = cell < OpenCells::kRoom - 1 ? cell : uint32_t(log_.by_ray.cells[k]) - 1;
    return uint32_t(log_.cell[first + at]);
  }

  void bound(uint32_t k) const {
    const uint32_t i = log_.ray(k), count = cells(k);
    const bool blocked = log_.blocked(k);
    const float first = (count != 0 ? log_.cells.enter[index(k, 0)] : log_.begin[k]) + 0.0f;
    Hit hit = bounds_of(field_, segment_of(batch_, i), blocked ? Verdict::occluded : Verdict::open, true,
                        first, log_.end[k] + 0.0f);
    s_.first[k] = 0;
    s_.last[k] = count != 0 ? uint8_t(count - 1) : kNowhere;
    if (hit.low > limit_[i]) {
      hit.t = hit.low;
      s_.last[k] = kNowhere;
    } else if (count == 0) {
      hit.t = log_.begin[k] + 0.0f;
    } else if constexpr (std::is_same_v<Network, NoNetwork>) {
      s_.first[k] = s_.last[k];
    }
    set_hit(hits_, i, hit);
  }

  /// Asks the network about segments from their ray's start to `end(k)`, and reports whether each is
  /// occluded.
  template <class End, class Tell>
  void ask(uint32_t count, const End& end, const Tell& tell) const {
    if (count == 0) return;
    s_.questions.count = count;
    for (uint32_t q = 0; q < count; ++q) {
      const uint32_t k = s_.asked[q];
      Segment segment = segment_of(batch_, log_.ray(k));
      segment.tmax = end(k, segment);
      set_segment(s_.questions, q, segment);
    }
    network_(s_.questions, s_.answers);
    for (uint32_t q = 0; q < count; ++q) tell(s_.asked[q], s_.answers.logit[q] < 0);
  }

  /// Decides rays that nothing certainly blocks, each as a whole.
  void decide_open_rays() const {
    uint32_t count = 0;
    for (uint32_t k = 0; k < log_.count; ++k)
      if (!log_.blocked(k) && s_.last[k] != kNowhere) s_.asked[count++] = uint16_t(k);
    ask(
        count, [](uint32_t, const Segment& segment) { return segment.tmax; },
        [&](uint32_t k, bool occluded) {
          if (!occluded) s_.last[k] = kNowhere;
        });
  }

  /// Halves the range of cells that are left, as hit_in_cells() does. Returns false if each ray has one cell.
  bool halve() const {
    uint32_t count = 0;
    for (uint32_t k = 0; k < log_.count; ++k)
      if (s_.last[k] != kNowhere && s_.first[k] < s_.last[k]) s_.asked[count++] = uint16_t(k);
    const auto middle = [&](uint32_t k) { return uint8_t((s_.first[k] + s_.last[k]) / 2); };
    ask(
        count, [&](uint32_t k, const Segment&) { return log_.cells.leave[index(k, middle(k))] + 0.0f; },
        [&](uint32_t k, bool occluded) {
          if (occluded)
            s_.last[k] = middle(k);
          else
            s_.first[k] = uint8_t(middle(k) + 1);
        });
    return count != 0;
  }

  void finish(uint32_t k) const {
    if (s_.last[k] == kNowhere) return;
    const uint32_t i = log_.ray(k), c = index(k, s_.first[k]);
    const auto word = uint32_t(log_.cells.word[c]);
    const float size = log_.cells.size[c];
    const PartBetween between = part_between(
        log_.cells.enter[c], log_.cells.leave[c], log_.cells.enter_height[c], log_.cells.leave_height[c],
        plane_height(lower_offset(word), size), plane_height(upper_offset(word), size));
    OpenCell cell{};
    cell.begin = between.begin + 0.0f;
    cell.end = between.end + 0.0f;
    cell.word = word;
    Hit hit = hit_of(hits_, i);
    place_hit(cell, hit);
    set_hit(hits_, i, hit);
  }

  const PlanesField& field_;
  const SegmentBatch& batch_;
  const float* limit_;
  const Network& network_;
  HitScratch& s_;
  FirstHitCellLog& log_;
  HitBatch& hits_;
};

/// Like ObjectKernel::intersect(). Field: as for follow_segment(). `network(questions, answers)` answers
/// segments; `by_reference(ray)` is the hit of one ray.
template <class Field, class Network, class ByReference>
void hits_by_planes(const Field& field, const TraversalGrid& grid, const SegmentBatch& batch,
                    const float* limit, HitBatch& hits, HitScratch& s, const Network& network,
                    const ByReference& by_reference) {
  if (batch.count <= kFewForTraversal) {
    for (uint32_t i = 0; i < batch.count; ++i) set_hit(hits, i, by_reference(i));
    return;
  }
  fill_hits(hits, batch.count, no_hit(true));
  GridTraversal traversal(field, grid, batch, s.answers, s.rays, s.log, s.hard);
  const HitPlacer<Network> placer(field, batch, limit, network, s, hits);
  while (traversal.fill_log()) placer.place();
  for (uint32_t k = 0; k < s.hard.count; ++k) set_hit(hits, s.hard.ray[k], by_reference(s.hard.ray[k]));
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
