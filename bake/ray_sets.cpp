#include "bake/ray_sets.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <numbers>

namespace nif::bake {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr size_t kBlock = 4096;  // rays that share a random stream
constexpr int kTries = 10000;

Segment make_segment(const Double3& origin, const Double3& direction, float tmax) {
  Segment segment{{}, {}, 0, tmax};
  for (int a = 0; a < 3; ++a) {
    segment.origin[a] = static_cast<float>(origin[a]);
    segment.direction[a] = static_cast<float>(direction[a]);
  }
  return segment;
}

Double3 centre(const Box& box) { return (to_double(box.min) + to_double(box.max)) * 0.5; }

/// Two unit vectors that make an orthogonal frame with a unit vector (Duff et al. 2017).
void frame(const Double3& n, Double3& u, Double3& v) {
  const double sign = n[2] < 0 ? -1.0 : 1.0;
  const double a = -1.0 / (sign + n[2]), b = n[0] * n[1] * a;
  u = {1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
  v = {b, sign + n[1] * n[1] * a, -n[1]};
}

bool meets_box(const Segment& ray, const Box& box) {
  double enter = ray.tmin, leave = ray.tmax;
  for (int a = 0; a < 3; ++a) {
    const double d = ray.direction[a], o = ray.origin[a];
    if (d == 0) {
      if (o < box.min[a] || o > box.max[a]) return false;
      continue;
    }
    const double t0 = (box.min[a] - o) / d, t1 = (box.max[a] - o) / d;
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave;
}

/// A line through the box, isotropic: uniform direction, uniform over the disc that shadows the bounding
/// sphere, kept where it meets the box. Its origin lies outside.
std::optional<Segment> draw_line(const RaySource& source, Random& random) {
  const double radius = source.box.diagonal() / 2;
  for (int i = 0; i < kTries; ++i) {
    const Double3 direction = random.direction();
    Double3 u, v;
    frame(direction, u, v);
    double x, y;
    do {
      x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    } while (x * x + y * y > 1);
    const Double3 origin = centre(source.box) + (u * x + v * y - direction * 1.25) * radius;
    const Segment ray = make_segment(origin, direction, kInfinity);
    if (meets_box(ray, source.box)) return ray;
  }
  return std::nullopt;
}

struct SurfacePoint {
  Double3 origin;  // off the surface by the bias, on the viewer's side
  Double3 normal;  // unit length, towards the viewer
};

std::optional<SurfacePoint> shading_point(const RaySource& source, const Segment& view) {
  const std::optional<Oracle::Hit> hit = source.oracle.first_hit(view);
  if (!hit) return std::nullopt;
  const double size = length(hit->normal);
  if (!(size > 0)) return std::nullopt;
  const Double3 direction{view.direction[0], view.direction[1], view.direction[2]};
  Double3 normal = hit->normal * (1 / size);
  if (dot(normal, direction) > 0) normal = normal * -1;
  const Double3 origin{view.origin[0], view.origin[1], view.origin[2]};
  return SurfacePoint{origin + direction * hit->t + normal * source.bias, normal};
}

std::optional<Segment> draw_from_surface(const RaySource& source, Random& random) {
  for (int i = 0; i < kTries; ++i) {
    const std::optional<Segment> view = draw_line(source, random);
    if (!view) return std::nullopt;
    const std::optional<SurfacePoint> point = shading_point(source, *view);
    if (!point) continue;
    Double3 direction = random.direction();
    if (dot(direction, point->normal) < 0) direction = direction * -1;
    return make_segment(point->origin, direction, kInfinity);
  }
  return std::nullopt;
}

std::optional<Segment> draw_from_volume(const RaySource& source, Random& random) {
  for (int i = 0; i < kTries; ++i) {
    std::array<float, 3> origin;
    for (int a = 0; a < 3; ++a) {
      origin[a] = static_cast<float>(random.uniform(source.box.min[a], source.box.max[a]));
    }
    if (source.inside.inside(origin)) continue;
    return make_segment(to_double(origin), random.direction(), kInfinity);
  }
  return std::nullopt;
}

/// Gives an infinite ray a length, log-uniform from kShortestSegment to 1 times the diagonal.
std::optional<Segment> cut(const RaySource& source, std::optional<Segment> ray, Random& random) {
  const double fraction = std::exp(random.uniform(std::log(kShortestSegment), 0));
  if (ray) ray->tmax = static_cast<float>(fraction * source.box.diagonal());
  return ray;
}

/// Surface points of a picture in scan order, and one direction towards the sun; points that face away from
/// it are left out, as a renderer would.
std::vector<Segment> make_sun(const RaySource& source, size_t count, uint64_t seed) {
  Random random(seed, uint64_t(RaySet::sun), 0);
  const Double3 view = random.direction(), sun = random.direction();
  Double3 u, v;
  frame(view, u, v);
  const double radius = source.box.diagonal() / 2;
  // Of a picture's pixels some miss the object and some lie in their own shade: ask for finer ones until
  // enough hit.
  for (size_t side = size_t(std::sqrt(double(count))) + 1; side < 40000; side += side / 3 + 1) {
    std::vector<std::vector<Segment>> rows(side);
    tbb::parallel_for(size_t{0}, side, [&](size_t y) {
      for (size_t x = 0; x < side; ++x) {
        const double px = (double(x) + 0.5) / double(side) * 2 - 1,
                     py = (double(y) + 0.5) / double(side) * 2 - 1;
        const Double3 origin = centre(source.box) + (u * px + v * py - view * 1.25) * radius;
        const auto point = shading_point(source, make_segment(origin, view, kInfinity));
        if (point && dot(point->normal, sun) > 0)
          rows[y].push_back(make_segment(point->origin, sun, kInfinity));
      }
    });
    size_t total = 0;
    for (const auto& row : rows) total += row.size();
    if (total == 0 && side > 1000) break;
    if (total < count) continue;
    std::vector<Segment> segments;
    segments.reserve(total);
    for (const auto& row : rows) segments.insert(segments.end(), row.begin(), row.end());
    segments.resize(count);
    return segments;
  }
  return {};
}

constexpr std::array<std::string_view, kRaySets.size()> kNames{"outer-lines", "inner-surface", "inner-volume",
                                                               "segments", "sun"};

}  // namespace

std::string_view name_of(RaySet set) { return kNames[size_t(set)]; }

std::optional<RaySet> ray_set_named(std::string_view name) {
  for (RaySet set : kRaySets) {
    if (name_of(set) == name) return set;
  }
  return std::nullopt;
}

std::optional<Segment> draw_ray(const RaySource& source, RaySet set, Random& random) {
  switch (set) {
    case RaySet::outer_lines:
      return draw_line(source, random);
    case RaySet::inner_surface:
      return draw_from_surface(source, random);
    case RaySet::inner_volume:
      return draw_from_volume(source, random);
    case RaySet::segments:
      if (random.below(2) == 0) return draw_surface_segment(source, random);
      return cut(source, draw_from_volume(source, random), random);
    case RaySet::sun:
      break;
  }
  return std::nullopt;
}

std::optional<Segment> draw_surface_segment(const RaySource& source, Random& random) {
  return cut(source, draw_from_surface(source, random), random);
}

LabelledRays make_ray_set(const RaySource& source, RaySet set, size_t count, uint64_t seed) {
  LabelledRays rays;
  if (set == RaySet::sun) {
    rays.segments = make_sun(source, count, seed);
  } else {
    const size_t blocks = (count + kBlock - 1) / kBlock;
    std::vector<std::vector<Segment>> drawn(blocks);
    tbb::parallel_for(size_t{0}, blocks, [&](size_t b) {
      Random random(seed, uint64_t(set), b);
      const size_t wanted = std::min(kBlock, count - b * kBlock);
      while (drawn[b].size() < wanted) {
        const std::optional<Segment> segment = draw_ray(source, set, random);
        if (!segment) break;
        drawn[b].push_back(*segment);
      }
    });
    for (auto& block : drawn) rays.segments.insert(rays.segments.end(), block.begin(), block.end());
  }
  rays.visible.resize(rays.segments.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, rays.segments.size(), 1024), [&](const auto& range) {
    for (size_t i = range.begin(); i != range.end(); ++i)
      rays.visible[i] = !source.oracle.occluded(rays.segments[i]);
  });
  return rays;
}

}  // namespace nif::bake
