// Rays that are as hard to answer as we know how to draw them: first what they are made of, then one function
// for each kind, which says what it attacks.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/exact/draws.hpp"
#include "tests/exact/generators.hpp"

namespace nif::test {
namespace {

using mesh::Mesh;

/// The corners of one triangle, beginning with any.
std::array<Double3, 3> any_triangle(const Mesh& mesh, nif::Random& random) {
  const mesh::Triangle& t = mesh.triangles[random.below(uint32_t(mesh.triangles.size()))];
  const size_t first = random.below(3);
  std::array<Double3, 3> corners;
  for (size_t i = 0; i < 3; ++i) corners[i] = to_double(mesh.positions[t[(first + i) % 3]]);
  return corners;
}
Double3 any_corner(const Mesh& mesh, nif::Random& random) { return any_triangle(mesh, random)[0]; }

/// At an eighth of an edge, or anywhere on it.
Double3 any_edge_point(const Mesh& mesh, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  return a + (b - a) * (random.below(2) ? between(random, 1, 7) / 8.0 : random.uniform());
}
Double3 any_inner_point(const Mesh& mesh, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  const int i = between(random, 1, 6), k = between(random, 1, 7 - i);
  if (random.below(2)) return a + (b - a) * (i / 8.0) + (c - a) * (k / 8.0);
  const double u = random.uniform(), v = random.uniform() * (1 - u);
  return a + (b - a) * u + (c - a) * v;
}
Double3 any_point(const Mesh& mesh, nif::Random& random) {
  const uint32_t kind = random.below(3);
  return kind == 0   ? any_corner(mesh, random)
         : kind == 1 ? any_edge_point(mesh, random)
                     : any_inner_point(mesh, random);
}

Double3 point_in(const mesh::Box& box, nif::Random& random, double margin = 0) {
  Double3 point;
  for (size_t a = 0; a < 3; ++a) {
    const double side = double(box.max[a]) - box.min[a];
    point[a] = box.min[a] + side * random.uniform(-margin, 1 + margin);
  }
  return point;
}
/// Of few bits, or of many.
Double3 any_way(const mesh::Box& box, nif::Random& random) {
  const double step = step_of(box, random);
  if (random.below(4)) return whole_vector(random, 8) * step;
  return random.direction() * size_of(box);
}

/// Passes a point at t = `back`, coming from `way` times that. Exactly so where the origin's coordinates have
/// 24 bits, else to rounding.
NifRay pass(const Double3& point, const Double3& way, double back) {
  NifRay ray{{}, 0, {}, kInfinity};
  for (size_t a = 0; a < 3; ++a) {
    ray.origin[a] = float(point[a] - way[a] * back);
    ray.direction[a] = float((point[a] - double(ray.origin[a])) / back);
  }
  return ray;
}
double any_back(nif::Random& random) {
  return random.below(2) ? between(random, 1, 16) : power(random, 0, 6);
}
NifRay pass_any_way(const Double3& point, const mesh::Box& box, nif::Random& random) {
  const Double3 way = any_way(box, random);
  return pass(point, way, any_back(random));
}

void set_origin(NifRay& ray, const Double3& point) {
  for (size_t a = 0; a < 3; ++a) ray.origin[a] = float(point[a]);
}
void set_direction(NifRay& ray, const Double3& way) {
  for (size_t a = 0; a < 3; ++a) ray.direction[a] = float(way[a]);
}

/// The same points: the direction times a power of two.
void lengthen(NifRay& ray, int by) {
  for (float& x : ray.direction) x = std::ldexp(x, by);
  ray.tmin = std::ldexp(ray.tmin, -by);
  ray.tmax = std::ldexp(ray.tmax, -by);
}

/// A direction that is out of what is valid is mostly brought back; and in a third of all it gets any length,
/// in a few one that makes t as large or as small as it can be.
void finish(NifRay& ray, nif::Random& random) {
  double steep = 0;
  for (const float x : ray.direction) steep = std::max(steep, std::abs(double(x)));
  if (steep == 0) return set_direction(ray, random.direction());
  if (std::abs(std::ilogb(steep)) > 40 && random.below(8)) lengthen(ray, -std::ilogb(steep));
  if (chance(random, 3)) lengthen(ray, between(random, -20, 20));
  if (chance(random, 24)) {
    steep = 0;
    for (const float x : ray.direction) steep = std::max(steep, std::abs(double(x)));
    lengthen(ray, (random.below(2) ? 59 : -59) - std::ilogb(steep));
  }
}

/// All triangles around a corner have it: one of them must be met.
NifRay through_corner(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return pass_any_way(any_corner(mesh, random), box, random);
}

/// Both triangles have it.
NifRay through_edge(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return pass_any_way(any_edge_point(mesh, random), box, random);
}

/// A triangle seen edge-on does not count, its neighbours do; nearly edge-on, its depth is noise.
NifRay in_plane(const Mesh& mesh, const mesh::Box&, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  const Double3 u = b - a, v = c - a, shares = whole_vector(random, 4);
  const Double3 way = u * shares[0] + v * shares[1];
  const double i = between(random, 0, 8), k = between(random, 0, 8);
  const Double3 at = a + u * (i / 8) + v * (k / 8);
  NifRay ray = pass(at, way * 0.25, between(random, 1, 8));
  if (chance(random, 3)) {
    float& x = (random.below(2) ? ray.origin : ray.direction)[random.below(3)];
    x = ulps_beside(x, random.below(2) ? 1 : -1);
  }
  if (chance(random, 4)) ray.tmax = float(between(random, 0, 16));
  return ray;
}

/// All of the edge is met, or nothing of it, and each end by others.
NifRay along_edge(const Mesh& mesh, const mesh::Box&, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  NifRay ray = pass(a, b - a, between(random, 0, 1) ? between(random, 1, 8) : power(random, -3, 0));
  if (chance(random, 4)) ray.tmax = float(power(random, -3, 4));
  return ray;
}

/// Along an axis, through coordinates of corners: of one, or of several, which is where grid planes cross.
NifRay along_axis(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  Double3 at = any_corner(mesh, random), way{};
  if (random.below(2))
    for (size_t a = 0; a < 3; ++a) at[a] = any_corner(mesh, random)[a];
  else if (random.below(2))
    at = any_point(mesh, random);
  const double step = step_of(box, random);
  way[random.below(3)] = sign(random) * step;
  return pass(at, way, random.below(4) ? any_back(random) * 4 : 0.25);
}

/// One or two components are zeros, of either sign: slopes and slabs divide by them.
NifRay with_zeros(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  Double3 way = any_way(box, random);
  const uint32_t zeros = 1 + random.below(6);
  for (size_t a = 0; a < 3; ++a)
    if (zeros >> a & 1) way[a] = 0;
  const double back = any_back(random);
  const Double3 at = any_point(mesh, random);
  NifRay ray = pass(at, way, back);
  for (size_t a = 0; a < 3; ++a)
    if (zeros >> a & 1) ray.direction[a] = random.below(2) ? 0.f : -0.f;  // also where its point was rounded
  return ray;
}

/// Nearly zeros, of either sign: they may count as zero only where that changes nothing.
NifRay with_near_zeros(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = with_zeros(mesh, box, random);
  finish(ray, random);
  constexpr int kLimits[] = {-149, -127, -126, -125, -61,
                             -60,  -41,  -40,  -39};  // of formats, and of the product
  for (float& x : ray.direction) {
    if (x != 0) continue;
    const int size = random.below(3) ? between(random, -149, -20) : kLimits[random.below(std::size(kLimits))];
    const double above = random.below(2) ? 1 : random.uniform(1, 2);
    x = float(std::ldexp(above * sign(random), size));
  }
  return ray;
}

/// Ends exactly on a triangle, or begins there, or an ulp before or behind. The ends belong to the segment.
NifRay ends_on_triangle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const Double3 way = any_way(box, random);
  const double back = any_back(random);
  const Double3 at = any_point(mesh, random);
  NifRay ray = pass(at, way, back);
  const float end = ulps_beside(float(back), between(random, -1, 1));
  if (random.below(2))
    ray.tmax = end;
  else
    ray.tmin = end;
  if (chance(random, 8)) ray.tmin = ray.tmax = end;
  return ray;
}

/// Starts exactly on a triangle: that is met, whatever the direction.
NifRay starts_on_triangle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  const auto [a, b, c] = any_triangle(mesh, random);
  const uint32_t place = random.below(3);
  const double i = between(random, 1, 6), k = place == 0   ? 0
                                              : place == 1 ? 8 - i
                                                           : between(random, 1, int(7 - i));
  set_origin(ray, place == 0 ? a : a + (b - a) * (i / 8) + (c - a) * (k / 8));
  const Double3 normal = cross((b - a) * (1 / size_of(box)), (c - a) * (1 / size_of(box)));
  const uint32_t kind = random.below(4);
  set_direction(ray, kind == 0   ? normal * sign(random)
                     : kind == 1 ? any_point(mesh, random) - (place == 0 ? a : b)
                                 : any_way(box, random));
  if (chance(random, 4)) ray.tmax = chance(random, 2) ? 0.f : float(power(random, -20, 2));
  return ray;
}

/// The same, some ulps off, as rays start that leave a hit.
NifRay starts_near_triangle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = starts_on_triangle(mesh, box, random);
  for (float& x : ray.origin)
    if (random.below(2)) x = ulps_beside(x, between(random, -4, 4));
  return ray;
}

/// Lines and half-lines in both directions: what lies behind the origin counts, too.
NifRay from_behind(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const Double3 way = any_way(box, random);
  const double back = random.below(4) ? -any_back(random) : any_back(random);
  const Double3 at = any_point(mesh, random);
  NifRay ray = pass(at, way, back);
  const uint32_t kind = random.below(6);
  const auto near = ulps_beside(float(back), between(random, -1, 1));
  ray.tmin = kind < 3 ? -kInfinity : kind == 3 ? near : float(back * random.uniform(0, 2));
  ray.tmax = kind == 0 ? kInfinity : kind == 1 ? near : kind == 2 ? -0.f : std::max(0.f, ray.tmin);
  if (ray.tmin > ray.tmax) std::swap(ray.tmin, ray.tmax);
  return ray;
}

/// From one corner to another, as visibility of vertices is asked: both ends are met.
NifRay corner_to_corner(const Mesh& mesh, const mesh::Box&, nif::Random& random) {
  const Double3 from = any_corner(mesh, random), to = any_point(mesh, random);
  NifRay ray{{}, 0, {}, 1};
  set_origin(ray, from);
  set_direction(ray, (random.below(2) ? any_corner(mesh, random) : to) - from);
  if (chance(random, 4)) ray.tmin = ulps_beside(0, 1), ray.tmax = ulps_beside(1, -1);
  return ray;
}

/// Rounding grows with the distance: the ray is moved along itself, and must meet the same triangles.
NifRay from_far(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  constexpr double kTimes[] = {64, 256, 4096, 16384};
  const double times = random.below(2) ? kTimes[random.below(4)] : power(random, 10, 21);
  const double extent = std::ldexp(1, std::ilogb(extent_of(box)));
  Double3 way = random.below(2) ? whole_vector(random, 3) * 0.5 : random.direction();
  if (chance(random, 4)) way = whole_vector(random, 1);
  NifRay ray = pass(any_point(mesh, random), way * extent, times);
  if (chance(random, 6)) ray.tmax = ulps_beside(float(times), between(random, -2, 2));
  return ray;
}

/// Of an object that is far from where its space begins: what a transform rounds of such a ray's direction
/// grows on the way.
NifRay from_origin_of_space(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  if (random.below(2)) set_origin(ray, arrow(random, 0.1, 10) * size_of(box));
  const Double3 target = random.below(2) ? any_edge_point(mesh, random) : any_inner_point(mesh, random);
  set_direction(ray, target - to_double(std::to_array(ray.origin)));
  return ray;
}

/// It meets something at about the last t that is a float, or the first one, from as far away as an answer
/// may be certain, if the mesh is large.
NifRay at_last_t(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const double last = double(std::numeric_limits<float>::max()), side = sign(random);
  const double length = extent_of(box) * power(random, 17, 19) * random.uniform(1, 2) / last;
  NifRay ray{{}, 0, {}, 0};
  set_direction(ray, random.direction() * std::clamp(length, 0x1p-59, 0x1p-57));
  const Double3 target = any_point(mesh, random);
  const double t = side * last * (1 - random.uniform(0, 0x1p-22));
  for (size_t a = 0; a < 3; ++a) ray.origin[a] = float(target[a] - double(ray.direction[a]) * t);
  (side > 0 ? ray.tmax : ray.tmin) = float(side * last);
  return ray;
}

/// At the distances from which answers are computed in another way, no more called certain, or no more given,
/// and an ulp before and behind. (A BVH's extent is up to twice that of the box.)
NifRay from_limit(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  constexpr int kLimits[] = {6, 6, 20, 20, 14, 24, 32};
  const double extent = extent_of(box) * (random.below(4) ? 1 : random.uniform(1, 2));
  const double limit = std::ldexp(extent, kLimits[random.below(std::size(kLimits))]);
  const float far = ulps_beside(float(limit), between(random, -2, 2));
  const size_t axis = random.below(3);
  const Double3 target = any_point(mesh, random);
  Double3 from = target;  // along an axis
  if (random.below(2))
    for (double& x : from) x = limit * random.uniform(-1, 1) * (1 - 0x1p-20);
  from[axis] = far * sign(random);
  NifRay ray{{}, 0, {}, kInfinity};
  set_origin(ray, from);
  set_direction(ray, target - to_double(std::to_array(ray.origin)));
  if (chance(random, 4)) ray.tmax = ulps_beside(1, between(random, -2, 2));
  return ray;
}

/// In a plane of the box, or between its cells: such a ray is in the cells of both sides, or in neither.
NifRay in_plane_of_box(const Mesh& mesh, const mesh::Box& box, nif::Random& random, int most) {
  Double3 at = random.below(2) ? any_point(mesh, random) : point_in(box, random), way = any_way(box, random);
  const uint32_t axes = 1 + random.below(6);
  for (size_t a = 0; a < 3; ++a) {
    if (!(axes >> a & 1)) continue;
    const double side = double(box.max[a]) - box.min[a];
    const int parts = 1 << between(random, 0, most);
    at[a] = float(box.min[a] + side * (between(random, 0, parts) / double(parts)));
    way[a] = 0;
  }
  NifRay ray = pass(at, way, any_back(random));
  if (chance(random, 4)) {
    float& x = ray.origin[random.below(3)];
    x = ulps_beside(x, random.below(2) ? 1 : -1);
  }
  return ray;
}
/// Walls of boxes that a ray runs along: 0 times infinity.
NifRay in_side_of_box(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return in_plane_of_box(mesh, box, random, 0);
}
/// Planes between voxels and cells.
NifRay in_plane_of_voxels(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  return in_plane_of_box(mesh, box, random, 7);
}

/// Touches the box at an edge or a corner: no box may be passed by that has what is met there.
NifRay grazing(const Mesh&, const mesh::Box& box, nif::Random& random) {
  Double3 at = point_in(box, random);
  const size_t free_axis = random.below(4);  // 3: a corner
  for (size_t a = 0; a < 3; ++a)
    if (a != free_axis) at[a] = (random.below(2) ? box.max : box.min)[a];
  NifRay ray = pass_any_way(at, box, random);
  if (chance(random, 3)) {
    float& x = ray.origin[random.below(3)];
    x = ulps_beside(x, random.below(2) ? 1 : -1);
  }
  return ray;
}

/// What rays are like mostly.
NifRay chord(const Mesh&, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  const Double3 from = point_in(box, random, 1);
  set_origin(ray, from);
  set_direction(ray, point_in(box, random) - from);
  if (chance(random, 3)) ray.tmax = float(random.uniform(0, 2));
  if (chance(random, 4)) ray.tmin = float(random.uniform() * std::min(ray.tmax, 1.f));
  return ray;
}

/// Starts within the box, so often within the surface: it may not get out.
NifRay from_inside(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = pass_any_way(any_point(mesh, random), box, random);
  set_origin(ray, point_in(box, random));
  return ray;
}

/// From the middle, where it is inside of most that are closed, out through corners and edges: where leaks
/// are.
NifRay from_middle(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray{{}, 0, {}, kInfinity};
  Double3 middle;
  for (size_t a = 0; a < 3; ++a) middle[a] = (double(box.min[a]) + box.max[a]) / 2;
  if (chance(random, 3)) middle = middle * 0.75 + any_corner(mesh, random) * 0.25;
  set_origin(ray, middle);
  const Double3 target = random.below(2) ? any_corner(mesh, random) : any_edge_point(mesh, random);
  set_direction(ray, target - to_double(std::to_array(ray.origin)));
  return ray;
}

/// Misses an edge or a corner by little, and so meets one triangle or the other, or none.
NifRay past_edge(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  const auto [a, b, c] = any_triangle(mesh, random);
  const Double3 at = a + (b - a) * (chance(random, 4) ? 0 : random.uniform());
  const Double3 aside = arrow(random, 1e-7, 1e-3) * extent_of(box);
  return pass_any_way(at + aside, box, random);
}

/// Not a ray, or hardly: visible, and certain only where it has no points. And what is just valid.
NifRay invalid(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = pass_any_way(any_point(mesh, random), box, random);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const size_t a = random.below(3);
  const float infinite = random.below(2) ? kInfinity : -kInfinity;
  const auto set_steep = [&](double steep) {
    for (float& x : ray.direction) x = float(random.uniform(-1, 1) * steep);
    ray.direction[a] = float(steep * sign(random));
  };
  switch (random.below(12)) {
    case 0:
      ray.origin[a] = random.below(2) ? kNan : infinite;
      break;
    case 1:
      ray.direction[a] = random.below(2) ? kNan : infinite;
      break;
    case 2:
      (random.below(2) ? ray.tmin : ray.tmax) = kNan;
      break;
    case 3:
      set_direction(ray, {});
      break;
    case 4:
      ray.tmin = float(any_back(random)), ray.tmax = ulps_beside(ray.tmin, -between(random, 1, 3));
      break;
    case 5:
      ray.tmin = kInfinity, ray.tmax = random.below(2) ? -kInfinity : kInfinity;
      break;
    case 6:
      ray.tmin = -kInfinity, ray.tmax = -kInfinity;
      break;
    case 7:
      set_steep(std::ldexp(1, random.below(2) ? -61 : 61));
      break;
    case 8:
      set_steep(std::ldexp(1, random.below(2) ? -60 : 60));
      break;
    case 9: {
      const float limit = random.below(2) ? 0x1p-60f : 0x1p60f;
      set_steep(ulps_beside(limit, between(random, -1, 1)));
    } break;
    case 10:
      set_steep(power(random, -149, -120));
      break;
    default:  // as large as floats are, or as small
      for (float& x : ray.origin) {
        x = random.below(2) ? 1.f : -1.f;
        x *= float(spread(random, 0x1p-149, random.below(2) ? 0x1p-120 : 0x1p127));
      }
      break;
  }
  return ray;
}

/// As drawn, or the same points by a direction of another length.
template <NifRay (*draw)(const Mesh&, const mesh::Box&, nif::Random&)>
NifRay of_any_length(const Mesh& mesh, const mesh::Box& box, nif::Random& random) {
  NifRay ray = draw(mesh, box, random);
  finish(ray, random);
  return ray;
}

constexpr RayGenerator kRays[] = {
    {"through a corner", of_any_length<through_corner>},
    {"through an edge", of_any_length<through_edge>},
    {"in a triangle's plane", of_any_length<in_plane>},
    {"along an edge", of_any_length<along_edge>},
    {"along an axis", of_any_length<along_axis>},
    {"with zeros", of_any_length<with_zeros>},
    {"with near zeros", with_near_zeros},
    {"ends on a triangle", of_any_length<ends_on_triangle>},
    {"starts on a triangle", of_any_length<starts_on_triangle>},
    {"starts near a triangle", of_any_length<starts_near_triangle>},
    {"from behind", of_any_length<from_behind>},
    {"corner to corner", of_any_length<corner_to_corner>},
    {"from far", of_any_length<from_far>},
    {"from the origin of space", of_any_length<from_origin_of_space>},
    {"from a limit", of_any_length<from_limit>},
    {"in a side of the box", of_any_length<in_side_of_box>},
    {"in a plane of voxels", of_any_length<in_plane_of_voxels>},
    {"grazing", of_any_length<grazing>},
    {"chord", of_any_length<chord>},
    {"from inside", of_any_length<from_inside>},
    {"from the middle", of_any_length<from_middle>},
    {"past an edge", of_any_length<past_edge>},
    {"at the last t", at_last_t},
    {"invalid", invalid},
};

}  // namespace

std::span<const RayGenerator> ray_generators() { return kRays; }

}  // namespace nif::test
