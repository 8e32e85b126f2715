#include "bake/segment/training_rays.hpp"

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

/// A uniform point of a uniform surface voxel.
Double3 draw_surface_voxel_point(const kernels::SegmentField& field, const SurfaceCells& cells,
                                 Random& random) {
  const SurfaceCells::Cell& cell = cells.cells[random.below(uint32_t(cells.cells.size()))];
  Double3 point;
  for (int a = 0; a < 3; ++a) {
    point[a] = field.origin[a] + (cell.voxel[a] + random.uniform()) / double(field.voxels_per_unit);
  }
  return point;
}

/// A line through a random surface voxel: nearly all such lines are ambiguous, while of the lines of
/// `outer-lines` nine in ten are not. Long ways through surface voxels are drawn more often than in that set.
Segment draw_line_through_surface(const RaySource& source, const kernels::SegmentField& field,
                                  const SurfaceCells& cells, Random& random) {
  const Double3 point = draw_surface_voxel_point(field, cells, random), direction = random.direction();
  return make_segment(point - direction * (1.25 * source.box.diagonal()), direction, kInfinity);
}

/// A segment from the free volume through a random surface voxel. Its length is uniform, because a long
/// segment passes through a given voxel more often than a short one: that makes it log-uniform among
/// segments, as in `segments`. The origin may still lie inside.
std::optional<Segment> draw_segment_through_surface(const RaySource& source,
                                                    const kernels::SegmentField& field,
                                                    const SurfaceCells& cells, Random& random) {
  const Double3 point = draw_surface_voxel_point(field, cells, random), direction = random.direction();
  const double size = random.uniform(kShortestSegment, 1.0) * source.box.diagonal();
  const Double3 origin = point - direction * (random.uniform() * size);
  for (int a = 0; a < 3; ++a) {
    if (origin[a] < source.box.min[a] || origin[a] > source.box.max[a]) return std::nullopt;
  }
  return make_segment(origin, direction, static_cast<float>(size));
}

void draw_chunk(const RaySource& source, const kernels::SegmentField& field, const SurfaceCells& cells,
                const Mix& mix, Random& random, TrainingRays& rays) {
  constexpr int kTries = 2000;  // for one ambiguous ray
  rays.samples = field.samples;
  kernels::Walk walk;
  kernels::Placement placement;
  while (rays.visible.size() < kTrainingChunk) {
    const RaySet set = draw_set(mix, random);
    bool found = false;
    for (int i = 0; i < kTries && !found; ++i) {
      std::optional<Segment> segment;
      bool free_origin = true;  // known to lie outside of every solid
      if (set == RaySet::outer_lines) {
        segment = draw_line_through_surface(source, field, cells, random);
      } else if (set == RaySet::segments && random.below(2) == 0) {
        segment = draw_segment_through_surface(source, field, cells, random);
        free_origin = false;
        if (!segment) continue;
      } else if (set == RaySet::segments) {
        segment = draw_surface_segment(source, random);
      } else {
        segment = draw_ray(source, set, random);
      }
      if (!segment) break;
      kernels::walk_segment(field, *segment, walk);
      // A way of no length tells nothing of where the surface is.
      if (walk.verdict != kernels::Verdict::ambiguous || !(walk.surface_t > 0)) continue;
      if (!free_origin && source.inside.inside({segment->origin[0], segment->origin[1], segment->origin[2]}))
        continue;
      kernels::place_samples(field, walk, placement);
      uint32_t numbers[kernels::kMaxSamples];
      bool whole = true;
      for (uint32_t j = 0; j < field.samples && whole; ++j) {
        numbers[j] = cells.cell_of(placement.points[j].voxel);
        whole = numbers[j] != SurfaceCells::kNone;  // rounding put the point into a neighbour: rare, left out
      }
      if (!whole) continue;
      found = true;
      for (uint32_t j = 0; j < field.samples; ++j) {
        rays.cells.push_back(numbers[j]);
        const uint8_t* fraction = placement.points[j].fraction;
        rays.fractions.push_back({fraction[0], fraction[1], fraction[2]});
      }
      std::array<uint8_t, kernels::kGlobalInputs> globals;
      std::copy(std::begin(placement.globals), std::end(placement.globals), globals.begin());
      rays.globals.push_back(globals);
      rays.visible.push_back(!source.oracle.occluded(*segment));
      rays.set.push_back(uint8_t(set));
    }
    if (!found) break;
  }
}

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
  from = {};
}

}  // namespace

TrainingRays draw_training_rays(const RaySource& source, const kernels::SegmentField& field,
                                const SurfaceCells& cells, const Mix& mix, uint64_t seed,
                                uint64_t first_chunk, uint64_t chunks, const std::atomic<bool>& cancel) {
  constexpr uint64_t kPurpose = 0x747261696e;  // apart from the ray sets' own streams: never the same rays
  std::vector<TrainingRays> parts(chunks);
  tbb::parallel_for(uint64_t{0}, chunks, [&](uint64_t b) {
    if (cancel.load(std::memory_order_relaxed)) return;
    Random random(seed, kPurpose, first_chunk + b);
    draw_chunk(source, field, cells, mix, random, parts[b]);
  });
  TrainingRays all;
  all.samples = field.samples;
  size_t count = 0;
  for (const TrainingRays& part : parts) count += part.count();
  all.cells.reserve(count * field.samples);
  all.fractions.reserve(count * field.samples);
  all.globals.reserve(count);
  all.visible.reserve(count);
  all.set.reserve(count);
  for (TrainingRays& part : parts) {
    append(all.cells, part.cells);
    append(all.fractions, part.fractions);
    append(all.globals, part.globals);
    append(all.visible, part.visible);
    append(all.set, part.set);
  }
  return all;
}

}  // namespace nif::bake
