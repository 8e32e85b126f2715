// Draws training rays: candidates in chunks, of which it keeps those that OpenFilter finds open, and asks
// Embree only about these. Many candidates share a start and differ in direction, because finding a start
// takes rays, too.
#include "bake/network/training_rays.hpp"

#include <tbb/parallel_for.h>

#include <bit>

#include "formats/base/vector.hpp"

namespace nif::bake {

SurfaceCells::SurfaceCells(const kernels::SegmentField& field) : field_(field) {
  first_.assign(field.mixed_bricks, kNone);
  for (uint32_t bz = 0; bz < field.bricks[2]; ++bz) {
    for (uint32_t by = 0; by < field.bricks[1]; ++by) {
      for (uint32_t bx = 0; bx < field.bricks[0]; ++bx) {
        const uint16_t entry = field.brick_table[bx + field.bricks[0] * (by + field.bricks[1] * bz)];
        if (entry < kernels::kFirstMixedBrick) continue;
        const uint32_t brick = entry - kernels::kFirstMixedBrick;
        first_[brick] = uint32_t(cells.size());
        const uint64_t surface = field.brick_states[brick].surface & ~field.brick_states[brick].aux;
        for (uint64_t rest = surface; rest != 0; rest &= rest - 1) {
          const uint32_t bit = uint32_t(std::countr_zero(rest));
          const uint32_t v[3] = {bx * 4 + (bit & 3), by * 4 + ((bit >> 2) & 3), bz * 4 + (bit >> 4)};
          cells.push_back({{uint16_t(v[0]), uint16_t(v[1]), uint16_t(v[2])}});
          auto& eight = corners.emplace_back();
          for (uint32_t c = 0; c < 8; ++c) {
            eight[c] = kernels::corner_index(field, v[0] + (c & 1), v[1] + ((c >> 1) & 1), v[2] + (c >> 2));
          }
        }
      }
    }
  }
}

uint32_t SurfaceCells::cell_of(const uint16_t voxel[3]) const {
  const uint32_t x = voxel[0], y = voxel[1], z = voxel[2];
  const uint16_t entry =
      field_.brick_table[(x >> 2) + field_.bricks[0] * ((y >> 2) + field_.bricks[1] * (z >> 2))];
  if (entry < kernels::kFirstMixedBrick) return kNone;
  const kernels::BrickStates& states = field_.brick_states[entry - kernels::kFirstMixedBrick];
  const uint64_t surface = states.surface & ~states.aux;
  const uint32_t bit = (x & 3) + 4 * (y & 3) + 16 * (z & 3);
  if (!((surface >> bit) & 1)) return kNone;
  return first_[entry - kernels::kFirstMixedBrick] +
         uint32_t(std::popcount(surface & ((uint64_t{1} << bit) - 1)));
}

namespace {

/// The rays of one random stream.
class ChunkDrawer {
 public:
  ChunkDrawer(const RaySource& source, const kernels::SegmentField& field, const SurfaceCells& cells,
              const OpenFilter& filter, Random& random, TrainingRays& rays)
      : source_(source), field_(field), cells_(cells), filter_(filter), random_(random), rays_(rays) {
    rays_.samples = field.samples;
  }

  void draw(const Mix& mix, const std::atomic<bool>& cancel) {
    std::array<size_t, kRaySets.size()> wanted{};
    for (size_t i = 0; i < kTrainingChunk; ++i) ++wanted[size_t(draw_set(mix, random_))];
    for (const RaySet set : kRaySets) {
      const size_t until = rays_.count() + wanted[size_t(set)];
      const size_t most = rays_.candidates + wanted[size_t(set)] * kMostCandidates;
      for (bool any = true; any && rays_.count() < until && rays_.candidates < most;) {
        if (cancel.load(std::memory_order_relaxed)) return;
        any = draw_round(set, until);
      }
    }
    shuffle();
  }

 private:
  static constexpr size_t kCandidates = 1024;  ///< drawn at a time
  /// Per ray that is wanted: if fewer candidates are open, there are fewer rays.
  static constexpr size_t kMostCandidates = 32;
  static constexpr uint32_t kRaysFromStart = 32;  ///< in random directions

  /// Every part of the chunk should have rays of all sets.
  void shuffle() {
    const uint32_t samples = rays_.samples;
    for (uint32_t i = uint32_t(rays_.count()); i-- > 1;) {
      const uint32_t j = random_.below(i + 1);
      for (uint32_t k = 0; k < samples; ++k) {
        std::swap(rays_.cells[i * samples + k], rays_.cells[j * samples + k]);
        std::swap(rays_.points[i * samples + k], rays_.points[j * samples + k]);
      }
      std::swap(rays_.globals[i], rays_.globals[j]);
      std::swap(rays_.visible[i], rays_.visible[j]);
      std::swap(rays_.set[i], rays_.set[j]);
    }
  }

  /// Draws candidates of a set and keeps the open ones, until there are `until` rays. Returns false if the
  /// set has none.
  bool draw_round(RaySet set, size_t until) {
    candidates_.clear();
    for (int tries = 0; candidates_.size() < kCandidates && tries < int(kCandidates); ++tries) draw(set);
    rays_.candidates += candidates_.size();
    open_.clear();
    filter_.select(candidates_, open_);
    for (const uint32_t i : open_) {
      if (rays_.count() == until) break;
      keep(candidates_[i], set);
    }
    return !candidates_.empty();
  }

  /// Draws one candidate, or many from one start.
  void draw(RaySet set) {
    switch (set) {
      case RaySet::inner_surface:
        return draw_from_surface(false);
      case RaySet::inner_volume:
        return draw_from_volume(false);
      case RaySet::segments:
        return random_.below(2) == 0 && source_.has_volume ? draw_from_volume(true) : draw_from_surface(true);
      default:
        if (const auto ray = draw_ray(source_, set, random_)) candidates_.push_back(*ray);
    }
  }

  void draw_from_surface(bool cut) {
    if (const auto point = draw_surface_point(source_, random_))
      draw_from_start(cut, [&] { return draw_from(*point, random_); });
  }
  void draw_from_volume(bool cut) {
    const auto ray = draw_ray(source_, RaySet::inner_volume, random_);
    if (!ray) return;
    const Double3 origin{ray->origin[0], ray->origin[1], ray->origin[2]};
    draw_from_start(cut, [&] { return make_segment(origin, random_.direction(), kInfinity); });
  }
  template <class Draw>
  void draw_from_start(bool cut, const Draw& draw) {
    for (uint32_t i = 0; i < kRaysFromStart; ++i) {
      candidates_.push_back(draw());
      if (cut) draw_length(source_, candidates_.back(), random_);
    }
  }

  void keep(const Segment& segment, RaySet set) {
    kernels::traverse_segment(field_, segment, traversal_);
    // Without length, the intervals do not show where the surface is.
    if (!(traversal_.open_t > 0)) return;
    kernels::place_samples(field_, traversal_, placement_);
    uint32_t numbers[kernels::kMaxSamples];
    for (uint32_t j = 0; j < field_.samples; ++j) {
      numbers[j] = cells_.cell_of(placement_.points[j].voxel);
      if (numbers[j] == SurfaceCells::kNone) return;  // rounding put the point into a neighbour: rare
    }
    for (uint32_t j = 0; j < field_.samples; ++j) {
      rays_.cells.push_back(numbers[j]);
      const kernels::SamplePoint& point = placement_.points[j];
      rays_.points.push_back({{point.fraction[0], point.fraction[1], point.fraction[2]}, point.height});
    }
    std::array<uint8_t, kernels::kGlobalInputs> globals;
    std::copy(std::begin(placement_.globals), std::end(placement_.globals), globals.begin());
    rays_.globals.push_back(globals);
    rays_.visible.push_back(!source_.embree.occluded(segment));
    rays_.set.push_back(uint8_t(set));
  }

  const RaySource& source_;
  const kernels::SegmentField& field_;
  const SurfaceCells& cells_;
  const OpenFilter& filter_;
  Random& random_;
  TrainingRays& rays_;
  std::vector<Segment> candidates_;
  std::vector<uint32_t> open_;
  kernels::FullTraversal traversal_;
  kernels::Placement placement_;
};

template <class T>
void append_to(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

void TrainingRays::append(TrainingRays&& more) {
  candidates += more.candidates;
  if (count() == 0) {
    const size_t all = candidates;
    *this = std::move(more);
    candidates = all;
    return;
  }
  append_to(cells, more.cells);
  append_to(points, more.points);
  append_to(globals, more.globals);
  append_to(visible, more.visible);
  append_to(set, more.set);
}

TrainingRays draw_training_rays(const RaySource& source, const kernels::SegmentField& field,
                                const SurfaceCells& cells, const OpenFilter& filter, const Mix& mix,
                                uint64_t seed, uint64_t first_chunk, uint64_t chunks,
                                const std::atomic<bool>& cancel) {
  constexpr uint64_t kPurpose = 0x747261696e;  // separate from the ray sets' own streams: never the same rays
  std::vector<TrainingRays> parts(chunks);
  tbb::parallel_for(uint64_t{0}, chunks, [&](uint64_t b) {
    Random random(seed, kPurpose, first_chunk + b);
    ChunkDrawer(source, field, cells, filter, random, parts[b]).draw(mix, cancel);
  });
  TrainingRays all;
  all.samples = field.samples;
  for (TrainingRays& part : parts) all.append(std::move(part));
  return all;
}

}  // namespace nif::bake
