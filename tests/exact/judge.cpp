// Signs of volumes by a floating-point filter with GMP behind it; distances in 113 bits.
#include "tests/exact/judge.hpp"

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "formats/base/random.hpp"

namespace nif::test {
namespace {

Quad3 operator+(const Quad3& a, const Quad3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Quad3 operator-(const Quad3& a, const Quad3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Quad3 operator*(const Quad3& a, Quad s) { return {a.x * s, a.y * s, a.z * s}; }
Quad dot(const Quad3& a, const Quad3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Quad3 cross(const Quad3& a, const Quad3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Quad magnitude(Quad a) { return a < 0 ? -a : a; }
Quad largest(const Quad3& a) { return std::max({magnitude(a.x), magnitude(a.y), magnitude(a.z)}); }
Quad clamp(Quad a, Quad low, Quad high) { return a < low ? low : a > high ? high : a; }
/// Two steps of Newton's method from double precision. `a` is scaled first, because it may exceed the range
/// of double.
Quad root(Quad a) {
  if (!(a > 0)) return 0;
  Quad scale = 1;
  for (; a < Quad(1e-200); a *= Quad(0x1p400)) scale *= Quad(0x1p-200);
  for (; a > Quad(1e200); a *= Quad(0x1p-400)) scale *= Quad(0x1p200);
  Quad r = std::sqrt(double(a));
  for (int i = 0; i < 2; ++i) r = (r + a / r) / 2;
  return r * scale;
}
Quad3 quad_of(const double p[3]) { return {p[0], p[1], p[2]}; }

/// The float times 2^149.
mpz_class whole(float f) {
  int exponent;
  const float mantissa = std::frexp(f, &exponent);
  mpz_class value = int(std::ldexp(mantissa, 24));
  const int shift = exponent - 24 + 149;
  if (shift >= 0) return value << shift;
  return value >> -shift;  // exact: the last bits of a denormal are 0
}

/// The determinant of d, p - o and q - o in double precision; `error` bounds its error.
struct Bounded {
  double value, error;
};
Bounded side_of(const double d[3], const double p[3], const double q[3]) {
  double value = 0, sizes = 0;
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    const double first = p[b] * q[c], second = p[c] * q[b];
    value += d[a] * (first - second);
    sizes += std::abs(d[a]) * (std::abs(first) + std::abs(second));
  }
  return {value, 0x1p-49 * sizes};
}
int exact_side(const NifRay& ray, const double p[3], const double q[3]) {
  mpz_class d[3], from[3], to[3], sum = 0;
  for (int a = 0; a < 3; ++a) {
    d[a] = whole(ray.direction[a]);
    from[a] = whole(float(p[a])) - whole(ray.origin[a]);
    to[a] = whole(float(q[a])) - whole(ray.origin[a]);
  }
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    sum += d[a] * (from[b] * to[c] - from[c] * to[b]);
  }
  return sgn(sum);
}

double length_between(const double p[3], const double q[3]) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

Quad square_to_segment(const Quad3& point, const Quad3& from, const Quad3& to) {
  const Quad3 along = to - from;
  const Quad length = dot(along, along);
  const Quad s = length > 0 ? clamp(dot(point - from, along) / length, 0, 1) : Quad(0);
  const Quad3 apart = point - (from + along * s);
  return dot(apart, apart);
}

/// Distance between two segments, after Ericson, "Real-Time Collision Detection" (2005), 5.1.9.
Quad square_between(const Quad3& p, const Quad3& p_end, const Quad3& q, const Quad3& q_end) {
  const Quad3 d = p_end - p, e = q_end - q, r = p - q;
  const Quad a = dot(d, d), b = dot(d, e), c = dot(d, r), f = dot(e, r), g = dot(e, e), area = a * g - b * b;
  Quad square = std::min({square_to_segment(p, q, q_end), square_to_segment(p_end, q, q_end),
                          square_to_segment(q, p, p_end), square_to_segment(q_end, p, p_end)});
  if (area > 0) {
    const Quad s = (b * f - c * g) / area, t = (a * f - b * c) / area;
    if (s > 0 && s < 1 && t > 0 && t < 1) {
      const Quad3 apart = (p + d * s) - (q + e * t);
      square = std::min(square, dot(apart, apart));
    }
  }
  return square;
}

std::string said(const char* what, Quad t) {
  char text[160];
  std::snprintf(text, sizeof text, "%s t %a", what, double(t));
  return text;
}

}  // namespace

Judge::Judge(const mesh::Mesh& mesh, bool closed) : closed_(closed) {
  for (const mesh::Triangle& t : mesh.triangles) {
    Corners& corners = triangles_.emplace_back();
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 3; ++a) {
        const float x = mesh.positions[t[size_t(i)]][size_t(a)];
        corners.at[i][a] = double(x);
        extent_ = std::max(extent_, std::abs(x));
      }
    const Quad3 first = quad_of(corners.at[0]);
    const Quad3 normal = cross(quad_of(corners.at[1]) - first, quad_of(corners.at[2]) - first);
    const Quad length = root(dot(normal, normal));
    corners.normal = length > 0 ? normal * (1 / length) : Quad3{};
    corners.area = double(length);
    for (int a = 0; a < 3; ++a)
      corners.centre[a] = (corners.at[0][a] + corners.at[1][a] + corners.at[2][a]) / 3;
    for (int i = 0; i < 3; ++i)
      corners.radius = std::max(corners.radius, length_between(corners.at[i], corners.centre));
  }
}

Quad Judge::rounding(const Look& look) const {
  return std::max(largest(look.origin), Quad(extent_)) * Quad(0x1p-40);
}

Look Judge::look(const NifRay& ray) const {
  Look look{{ray.origin[0], ray.origin[1], ray.origin[2]},
            {ray.direction[0], ray.direction[1], ray.direction[2]},
            ray.tmin,
            ray.tmax,
            0,
            {}};
  look.aside = rounding(look);
  meet(look, true, ray);
  return look;
}

Look Judge::look(const NifRay& ray, const std::array<float, 12>& m, double aside,
                 const std::array<float, 3>& remainder) const {
  const auto row = [&](size_t i) { return Quad3{m[4 * i], m[4 * i + 1], m[4 * i + 2]}; };
  const Quad3 a = row(0), b = row(1), c = row(2);
  const Quad determinant = dot(a, cross(b, c));
  const Quad3 columns[3] = {cross(b, c), cross(c, a), cross(a, b)};  // of the inverse, times the determinant
  const auto back = [&](const Quad3& p) {
    return (columns[0] * p.x + columns[1] * p.y + columns[2] * p.z) * (1 / determinant);
  };
  const auto origin_on = [&](size_t a) { return Quad(ray.origin[a]) - m[4 * a + 3] - remainder[a]; };
  const Quad3 origin{origin_on(0), origin_on(1), origin_on(2)};
  Look look{back(origin), back({ray.direction[0], ray.direction[1], ray.direction[2]}),
            ray.tmin,     ray.tmax,
            aside,        {}};
  look.aside = std::max(look.aside, rounding(look));
  meet(look, false, ray);
  return look;
}

void Judge::meet(Look& look, bool exact, const NifRay& ray) const {
  const double o[3] = {double(look.origin.x), double(look.origin.y), double(look.origin.z)};
  // Scaled to a length near 1, so that nothing overflows.
  const int exponent = std::ilogb(double(largest(look.direction)));
  const Quad scale = exact ? Quad(1) : Quad(std::ldexp(1.0, -exponent));
  const double d[3] = {double(look.direction.x * scale), double(look.direction.y * scale),
                       double(look.direction.z * scale)};
  for (size_t i = 0; i < triangles_.size(); ++i) {
    const Corners& triangle = triangles_[i];
    double seen[3][3];
    for (int k = 0; k < 3; ++k)
      for (int a = 0; a < 3; ++a) seen[k][a] = triangle.at[k][a] - o[a];
    Bounded sides[3];
    bool above = false, below = false;
    for (int k = 0; k < 3; ++k) {
      sides[k] = side_of(d, seen[(k + 1) % 3], seen[(k + 2) % 3]);
      above |= sides[k].value > sides[k].error;
      below |= sides[k].value < -sides[k].error;
    }
    if (above && below) continue;
    if (exact) {
      above = below = false;
      for (int k = 0; k < 3; ++k) {
        int sign = sides[k].value > 0 ? 1 : -1;
        if (!(std::abs(sides[k].value) > sides[k].error))
          sign = exact_side(ray, triangle.at[(k + 1) % 3], triangle.at[(k + 2) % 3]);
        above |= sign > 0;
        below |= sign < 0;
      }
      if (above == below) continue;
    }
    const Quad3 direction = look.direction, normal = triangle.normal;
    const Quad height = dot(normal, look.origin - quad_of(triangle.at[0])), rate = dot(normal, direction);
    if (rate == 0) continue;
    bool sure = true;
    // The width of the triangle as seen by the ray, and the ray's distance from its edges: areas over
    // lengths.
    const double area = std::abs(double(rate * scale)) * triangle.area, aside = double(look.aside);
    for (int k = 0; k < 3; ++k) {
      const double *from = triangle.at[(k + 1) % 3], *to = triangle.at[(k + 2) % 3];
      double across[3];
      for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        across[a] = (to[b] - from[b]) * d[c] - (to[c] - from[c]) * d[b];
      }
      const double length = std::hypot(across[0], across[1], across[2]);
      sure = sure && area > aside * length;
      if (!exact) sure = sure && std::abs(sides[k].value) - sides[k].error > aside * length;
    }
    if (!exact && !sure) continue;
    look.meetings.push_back({uint32_t(i), -height / rate, height, rate, sure});
  }
}

bool Judge::starts_inside(const Look& look) const {
  if (!closed_ || look.tmin > 0 || look.tmax < kEndless) return false;
  if (near_any(look, 0, 0)) return false;
  const double o[3] = {double(look.origin.x), double(look.origin.y), double(look.origin.z)};
  Random random(triangles_.size(), 1, 2);
  for (int attempt = 0; attempt < 8; ++attempt) {
    const Double3 direction = random.direction();
    const double d[3] = {direction[0], direction[1], direction[2]};
    bool clear = true, inside = false;
    for (const Corners& triangle : triangles_) {
      double seen[3][3];
      for (int k = 0; k < 3; ++k)
        for (int a = 0; a < 3; ++a) seen[k][a] = triangle.at[k][a] - o[a];
      bool above = false, below = false, open = false;
      for (int k = 0; k < 3; ++k) {
        const Bounded side = side_of(d, seen[(k + 1) % 3], seen[(k + 2) % 3]);
        above |= side.value > side.error;
        below |= side.value < -side.error;
        open |= !(std::abs(side.value) > side.error);
      }
      if (above && below) continue;
      if (open) {
        clear = false;
        break;
      }
      const Quad height = dot(triangle.normal, look.origin - quad_of(triangle.at[0]));
      const Quad rate = dot(triangle.normal, quad_of(d));
      inside ^= (height > 0) != (rate > 0);
    }
    if (clear) return inside;
  }
  return false;
}

bool Judge::sure_within(const Look& look, const Meeting& m, float from, float to) const {
  if (!m.sure) return false;
  const auto height_at = [&](float t) -> Quad {
    if (std::isinf(t)) return (t > 0) == (m.rate > 0) ? Quad(1e300) : Quad(-1e300);
    return m.height + m.rate * Quad(t);
  };
  const Quad first = height_at(from), last = height_at(to);
  return m.rate > 0 ? first < -look.aside && last > look.aside : first > look.aside && last < -look.aside;
}

const Meeting* Judge::first_sure(const Look& look, float from, float to) const {
  if (!(from < to)) return nullptr;
  const Meeting* first = nullptr;
  for (const Meeting& m : look.meetings)
    if (sure_within(look, m, from, to) && (!first || m.t < first->t)) first = &m;
  return first;
}

/// Clamps t to a range that contains the whole mesh.
Quad Judge::end_of(const Look& look, float t) const {
  const Quad farthest = 8 * std::max(largest(look.origin), Quad(extent_)) / largest(look.direction);
  return clamp(std::isinf(t) ? (t > 0 ? farthest : -farthest) : Quad(t), -farthest, farthest);
}

/// Distance from a triangle to the ray between two t.
Quad Judge::distance(const Look& look, Quad from, Quad to, const Corners& triangle) const {
  const Quad3 p = look.origin + look.direction * from, q = look.origin + look.direction * to;
  const Quad3 corner[3] = {quad_of(triangle.at[0]), quad_of(triangle.at[1]), quad_of(triangle.at[2])};
  Quad square = square_between(p, q, corner[0], corner[1]);
  square = std::min(square, square_between(p, q, corner[1], corner[2]));
  square = std::min(square, square_between(p, q, corner[2], corner[0]));
  const auto above_triangle = [&](const Quad3& point) {
    bool above = true;
    for (int k = 0; k < 3; ++k)
      above = above && dot(cross(corner[(k + 1) % 3] - corner[k], point - corner[k]), triangle.normal) >= 0;
    return above;
  };
  const Quad heights[2] = {dot(triangle.normal, p - corner[0]), dot(triangle.normal, q - corner[0])};
  if (dot(triangle.normal, triangle.normal) > 0) {
    if (above_triangle(p)) square = std::min(square, heights[0] * heights[0]);
    if (above_triangle(q)) square = std::min(square, heights[1] * heights[1]);
    if ((heights[0] < 0) != (heights[1] < 0)) {
      const Quad3 through = p + (q - p) * (heights[0] / (heights[0] - heights[1]));
      if (above_triangle(through)) square = 0;
    }
  }
  return root(square);
}

bool Judge::near_any(const Look& look, Quad from, Quad to) const {
  for (const Meeting& m : look.meetings)
    if (from <= m.t && m.t <= to) return true;
  // Skips triangles whose bounding ball the line misses by more than the tolerance.
  const Quad3 unit = look.direction * (1 / root(dot(look.direction, look.direction)));
  const double o[3] = {double(look.origin.x), double(look.origin.y), double(look.origin.z)};
  const double d[3] = {double(unit.x), double(unit.y), double(unit.z)};
  const double off =
      0x1p-40 * std::max(double(largest(look.origin)), double(extent_)) + 2 * double(look.aside);
  return std::any_of(triangles_.begin(), triangles_.end(), [&](const Corners& triangle) {
    double apart[3];
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3, c = (a + 2) % 3;
      apart[a] = (triangle.centre[b] - o[b]) * d[c] - (triangle.centre[c] - o[c]) * d[b];
    }
    if (std::hypot(apart[0], apart[1], apart[2]) > triangle.radius * 1.001 + off) return false;
    return distance(look, from, to, triangle) <= look.aside;
  });
}

std::string Judge::visible(const Look& look) const {
  if (const Meeting* m = first_sure(look, look.tmin, look.tmax))
    return said("visible, but met at", m->t) + ", triangle " + std::to_string(m->triangle);
  if (starts_inside(look)) return "visible, but it starts inside";
  return {};
}

std::string Judge::occluded(const Look& look) const {
  if (near_any(look, end_of(look, look.tmin), end_of(look, look.tmax))) return {};
  return "occluded, but nothing is near";
}

std::string Judge::first_hit(const Look& look, float t, const mesh::Float3 corners[3]) const {
  if (!(look.tmin <= t && t <= look.tmax)) return said("a hit beyond the segment,", t);
  const float before = std::nextafter(t, -kEndless), after = std::nextafter(t, kEndless);
  Corners triangle;
  for (int k = 0; k < 3; ++k)
    for (int a = 0; a < 3; ++a) triangle.at[k][a] = double(corners[k][size_t(a)]);
  const Quad3 first = quad_of(triangle.at[0]);
  const Quad3 normal = cross(quad_of(triangle.at[1]) - first, quad_of(triangle.at[2]) - first);
  const Quad length = root(dot(normal, normal));
  triangle.normal = length > 0 ? normal * (1 / length) : Quad3{};
  const Quad apart = distance(look, before, after, triangle);
  if (apart > look.aside) {
    char text[160];
    std::snprintf(text, sizeof text, "a hit at t %a, but its triangle is 2^%.1f tolerances away", double(t),
                  std::log2(double(apart / look.aside)));
    return text;
  }
  return nothing_before(look, before);
}

std::string Judge::nothing_before(const Look& look, float low) const {
  const Meeting* m = first_sure(look, look.tmin, std::min(low, look.tmax));
  return m ? said("met before, at", m->t) + said(" not", low) + ", triangle " + std::to_string(m->triangle)
           : std::string();
}

std::string Judge::something_until(const Look& look, float high) const {
  const float end = std::min(high, look.tmax);
  if (near_any(look, end_of(look, look.tmin), end_of(look, end))) return {};
  return said("nothing is met until", high);
}

std::string Judge::only_between(const Look& look, float begin, float end) const {
  if (!(look.tmin <= begin && end <= look.tmax)) return "an interval beyond the segment";
  for (const auto& [from, to] : {std::pair(look.tmin, begin), std::pair(end, look.tmax)})
    if (const Meeting* m = first_sure(look, from, to)) return said("met outside of the interval, at", m->t);
  return {};
}

std::string in_hex(const NifRay& ray) {
  char text[400];
  const auto f = [](float x) { return double(x); };
  std::snprintf(text, sizeof text, "o %a %a %a d %a %a %a t %a %a", f(ray.origin[0]), f(ray.origin[1]),
                f(ray.origin[2]), f(ray.direction[0]), f(ray.direction[1]), f(ray.direction[2]), f(ray.tmin),
                f(ray.tmax));
  return text;
}

}  // namespace nif::test
