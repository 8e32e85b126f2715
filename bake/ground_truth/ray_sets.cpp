// Draws each ray set: lines through the box, points on the surface, pictures of a sun or a camera. Each chunk
// and each picture has its own random stream, so that threads change nothing.
#include "bake/ground_truth/ray_sets.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numbers>

#include "formats/base/vector.hpp"

namespace nif::bake {
namespace {

constexpr size_t kChunk = 4096;  // rays that share a random stream
constexpr int kTries = 10000;

Double3 centre(const mesh::Box& box) { return (to_double(box.min) + to_double(box.max)) * 0.5; }

/// Two unit vectors that make an orthogonal frame with a unit vector (Duff et al. 2017).
void frame(const Double3& n, Double3& u, Double3& v) {
  const double sign = n[2] < 0 ? -1.0 : 1.0;
  const double a = -1.0 / (sign + n[2]), b = n[0] * n[1] * a;
  u = {1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
  v = {b, sign + n[1] * n[1] * a, -n[1]};
}

/// An isotropic line through the box: it enters at a uniform point of the box's surface, cosine-weighted
/// about the normal there, which is the uniform measure of lines that meet a convex body. Its origin lies
/// outside.
Segment draw_line(const RaySource& source, Random& random) {
  const Double3 low = to_double(source.box.min), size = to_double(source.box.max) - low;
  const double areas[3] = {size[1] * size[2], size[2] * size[0], size[0] * size[1]};
  double pick = random.uniform(0, areas[0] + areas[1] + areas[2]);
  int axis = 0;
  while (axis < 2 && pick >= areas[axis]) pick -= areas[axis++];
  const bool top = random.below(2) == 1;

  Double3 entry;
  for (int a = 0; a < 3; ++a) entry[a] = low[a] + size[a] * (a == axis ? double(top) : random.uniform());
  double x, y;
  do {
    x = random.uniform(-1, 1), y = random.uniform(-1, 1);
  } while (x * x + y * y > 1);
  Double3 direction;
  direction[(axis + 1) % 3] = x;
  direction[(axis + 2) % 3] = y;
  direction[axis] = (top ? -1 : 1) * std::sqrt(std::max(0.0, 1 - x * x - y * y));
  return make_segment(entry - direction * (1.25 * source.box.diagonal()), direction, kInfinity);
}

std::optional<SurfacePoint> shading_point(const RaySource& source, const Segment& view) {
  const std::optional<EmbreeTruth::Hit> hit = source.embree.first_hit(view);
  if (!hit) return std::nullopt;
  const double size = length(hit->normal);
  if (!(size > 0)) return std::nullopt;
  const Double3 direction{view.direction[0], view.direction[1], view.direction[2]};
  Double3 normal = hit->normal * (1 / size);
  if (dot(normal, direction) > 0) normal = normal * -1;
  const Double3 origin{view.origin[0], view.origin[1], view.origin[2]};
  const float bias = source.biases.empty() ? source.bias : source.biases[hit->instance];
  return SurfacePoint{origin + direction * hit->t + normal * bias, normal};
}

std::optional<Segment> draw_from_surface(const RaySource& source, Random& random) {
  const std::optional<SurfacePoint> point = draw_surface_point(source, random);
  if (!point) return std::nullopt;
  return draw_from(*point, random);
}

std::array<float, 3> draw_point(const mesh::Box& box, Random& random) {
  std::array<float, 3> point;
  for (int a = 0; a < 3; ++a) point[a] = static_cast<float>(random.uniform(box.min[a], box.max[a]));
  return point;
}

std::optional<Segment> draw_from_volume(const RaySource& source, Random& random) {
  for (int i = 0; source.has_volume && i < kTries; ++i) {
    const std::array<float, 3> origin = draw_point(source.box, random);
    if (!source.inside.inside(origin)) return make_segment(to_double(origin), random.direction(), kInfinity);
  }
  return std::nullopt;
}

std::optional<Segment> cut(const RaySource& source, std::optional<Segment> ray, Random& random) {
  if (ray) draw_length(source, *ray, random);
  return ray;
}

/// Surface points of a picture in scan order, and one direction towards the sun. Points that face away from
/// it are left out, as in a renderer. Parallel projection; the picture just covers the box.
std::vector<Segment> make_sun(const RaySource& source, size_t count, uint64_t seed, size_t number) {
  Random random(seed, uint64_t(RaySet::sun), number);
  // The sun stands behind the viewer, at most 60 degrees off, so that even a flat sheet is lit.
  const Double3 view = random.direction();
  Double3 sun;
  do {
    sun = random.direction();
  } while (dot(sun, view) > -0.5);
  Double3 u, v;
  frame(view, u, v);
  double low[2] = {kInfinity, kInfinity}, high[2] = {-kInfinity, -kInfinity};
  for (uint32_t c = 0; c < 8; ++c) {
    Double3 corner;
    for (int a = 0; a < 3; ++a) corner[a] = (c >> a) & 1 ? source.box.max[a] : source.box.min[a];
    const double at[2] = {dot(corner - centre(source.box), u), dot(corner - centre(source.box), v)};
    for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], at[i]), high[i] = std::max(high[i], at[i]);
  }
  const double width = high[0] - low[0], height = high[1] - low[1];
  if (count == 0 || !(width > 0 && height > 0)) return {};

  // Some of a picture's pixels miss the object and some face away: a second and third picture are made finer
  // according to the previous yield, within reason.
  std::vector<Segment> segments;
  double pixels = 2 * double(count) + 256;
  for (int pictures = 0; pictures < 3; ++pictures) {
    const double pitch = std::sqrt(width * height / pixels);
    const size_t columns = size_t(std::min(width / pitch + 1, pixels)),
                 rows = size_t(std::min(height / pitch + 1, pixels));
    std::vector<std::vector<Segment>> lines(rows);
    tbb::parallel_for(size_t{0}, rows, [&](size_t row) {
      for (size_t column = 0; column < columns; ++column) {
        const double x = low[0] + (double(column) + 0.5) / double(columns) * width,
                     y = low[1] + (double(row) + 0.5) / double(rows) * height;
        const Double3 origin = centre(source.box) + u * x + v * y - view * (1.25 * source.box.diagonal());
        const auto point = shading_point(source, make_segment(origin, view, kInfinity));
        if (point && dot(point->normal, sun) > 0)
          lines[row].push_back(make_segment(point->origin, sun, kInfinity));
      }
    });
    segments.clear();
    for (const auto& line : lines) segments.insert(segments.end(), line.begin(), line.end());
    if (segments.size() >= count || segments.empty()) break;
    pixels *= std::min(1.05 * double(count) / double(segments.size()), 50.0);
  }
  if (segments.size() > count) segments.resize(count);
  return segments;
}

/// What a pinhole camera sees in scan order, through the centres of square pixels. It looks at the middle of
/// the box, and its picture just covers the box.
std::vector<Segment> make_camera(const RaySource& source, size_t count, uint64_t seed, size_t number) {
  Random random(seed, uint64_t(RaySet::camera), number);
  const Double3 view = random.direction(),
                position = centre(source.box) - view * (1.25 * source.box.diagonal());
  Double3 u, v;
  frame(view, u, v);
  double low[2] = {kInfinity, kInfinity}, high[2] = {-kInfinity, -kInfinity};
  for (uint32_t c = 0; c < 8; ++c) {
    Double3 corner;
    for (int a = 0; a < 3; ++a) corner[a] = (c >> a) & 1 ? source.box.max[a] : source.box.min[a];
    const Double3 to = corner - position;
    const double depth = dot(to, view), at[2] = {dot(to, u) / depth, dot(to, v) / depth};
    for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], at[i]), high[i] = std::max(high[i], at[i]);
  }
  const double width = high[0] - low[0], height = high[1] - low[1];
  if (count == 0 || !(width > 0 && height > 0)) return {};
  const auto columns =
      size_t(std::clamp(std::round(std::sqrt(double(count) * width / height)), 1.0, double(count)));
  const double pitch = width / double(columns);
  std::vector<Segment> segments(count);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    const double x = low[0] + (double(i % columns) + 0.5) * pitch,
                 y = low[1] + (double(i / columns) + 0.5) * pitch;
    const Double3 along = view + u * x + v * y;
    segments[i] = make_segment(position, along * (1 / length(along)), kInfinity);
  });
  return segments;
}

constexpr std::array<std::string_view, kAllRaySets.size()> kNames{
    "outer-lines", "inner-surface", "inner-volume", "segments", "sun", "camera"};

}  // namespace

Segment make_segment(const Double3& origin, const Double3& direction, float tmax) {
  Segment segment{{}, {}, 0, tmax};
  for (int a = 0; a < 3; ++a) {
    segment.origin[a] = static_cast<float>(origin[a]);
    segment.direction[a] = static_cast<float>(direction[a]);
  }
  return segment;
}

std::string_view name_of(RaySet set) { return kNames[size_t(set)]; }

std::optional<RaySet> ray_set_named(std::string_view name) {
  for (RaySet set : kAllRaySets) {
    if (name_of(set) == name) return set;
  }
  return std::nullopt;
}

bool has_free_volume(const InsideTest& inside, const mesh::Box& box, float bias) {
  for (int a = 0; a < 3; ++a) {
    if (box.max[a] - box.min[a] < bias) return false;
  }
  Random random(0, 0x766f6c756d65, 0);
  for (int i = 0; i < 4096; ++i) {
    if (!inside.inside(draw_point(box, random))) return true;
  }
  return false;
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
      // If an object has no free volume, all its segments start on the surface.
      if (random.below(2) == 1) {
        if (auto segment = cut(source, draw_from_volume(source, random), random)) return segment;
      }
      return cut(source, draw_from_surface(source, random), random);
    case RaySet::sun:
    case RaySet::camera:
      break;
  }
  return std::nullopt;
}

std::optional<SurfacePoint> draw_surface_point(const RaySource& source, Random& random) {
  for (int i = 0; i < kTries; ++i) {
    const std::optional<SurfacePoint> point = shading_point(source, draw_line(source, random));
    if (point) return point;
  }
  return std::nullopt;
}

Segment draw_from(const SurfacePoint& point, Random& random) {
  Double3 direction = random.direction();
  if (dot(direction, point.normal) < 0) direction = direction * -1;
  return make_segment(point.origin, direction, kInfinity);
}

void draw_length(const RaySource& source, Segment& ray, Random& random) {
  const double fraction = std::exp(random.uniform(std::log(kShortestSegment), 0));
  ray.tmax = static_cast<float>(fraction * source.box.diagonal());
}

RaysWithTruth draw_ray_set(const RaySource& source, RaySet set, size_t count, uint64_t seed) {
  RaysWithTruth rays;
  if (is_coherent(set)) {
    const bool of_sun = set == RaySet::sun;
    const size_t pictures = of_sun ? kSuns : kCameras;
    for (size_t p = 0; p < pictures; ++p) {
      const size_t share = count * (p + 1) / pictures - count * p / pictures;
      const std::vector<Segment> part =
          of_sun ? make_sun(source, share, seed, p) : make_camera(source, share, seed, p);
      rays.segments.insert(rays.segments.end(), part.begin(), part.end());
      if (!part.empty()) rays.group_ends.push_back(rays.segments.size());
    }
  } else {
    const size_t chunks = (count + kChunk - 1) / kChunk;
    std::vector<std::vector<Segment>> drawn(chunks);
    tbb::parallel_for(size_t{0}, chunks, [&](size_t b) {
      Random random(seed, uint64_t(set), b);
      const size_t wanted = std::min(kChunk, count - b * kChunk);
      while (drawn[b].size() < wanted) {
        const std::optional<Segment> segment = draw_ray(source, set, random);
        if (!segment) break;
        drawn[b].push_back(*segment);
      }
    });
    for (auto& chunk : drawn) rays.segments.insert(rays.segments.end(), chunk.begin(), chunk.end());
    rays.group_ends.push_back(rays.segments.size());
  }
  return rays;
}

RaysWithTruth make_ray_set(const RaySource& source, RaySet set, size_t count, uint64_t seed) {
  RaysWithTruth rays = draw_ray_set(source, set, count, seed);
  rays.visible.resize(rays.segments.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, rays.segments.size(), 1024), [&](const auto& range) {
    for (size_t i = range.begin(); i != range.end(); ++i)
      rays.visible[i] = !source.embree.occluded(rays.segments[i]);
  });
  return rays;
}

}  // namespace nif::bake
