// Builds the bust from ellipsoids and rods, joined and cut; the left side mirrors the right one.
#include "mesh/generate/bust.hpp"

#include <algorithm>
#include <cmath>

#include "formats/base/random.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kBustStream = 0x62757374;  // "bust"

/// The smaller of two distances, rounded off where they differ by less than k.
double join(double a, double b, double k) {
  const double h = std::fmax(0, k - std::fabs(a - b)) / k;
  return std::fmin(a, b) - h * h * k / 4;
}
double cut(double a, double b, double k) { return -join(-a, -b, k); }

/// The distance from the middle plane, without a crease there.
double folded(double x, double round) { return std::sqrt(x * x + round * round); }

double ball(const Double3& p, const Double3& centre, double radius) { return length(p - centre) - radius; }

/// Quilez' estimate of the distance to an ellipsoid.
double ellipsoid(const Double3& p, const Double3& centre, const Double3& radii) {
  const Double3 d = p - centre, a{d[0] / radii[0], d[1] / radii[1], d[2] / radii[2]},
                b{a[0] / radii[0], a[1] / radii[1], a[2] / radii[2]};
  const double k = length(a), l = length(b);
  return l < 1e-9 ? -std::fmin(radii[0], std::fmin(radii[1], radii[2])) : k * (k - 1) / l;
}

/// Distance to a rod from a to b whose radius changes from ra to rb.
double rod(const Double3& p, const Double3& a, const Double3& b, double ra, double rb) {
  const Double3 ab = b - a, ap = p - a;
  const double t = std::fmin(1, std::fmax(0, dot(ap, ab) / dot(ab, ab)));
  return length(ap - ab * t) - (ra + t * (rb - ra));
}

/// Distance to a horizontal disc with rounded edges.
double disc(const Double3& p, double y, double radius, double half, double edge) {
  const double z = p[2] - Bust::kAxisZ;
  const double out = std::sqrt(p[0] * p[0] + z * z) - radius + edge, up = std::fabs(p[1] - y) - half + edge;
  const double o = std::fmax(out, 0), u = std::fmax(up, 0);
  return std::fmin(std::fmax(out, up), 0) + std::sqrt(o * o + u * u) - edge;
}

}  // namespace

Bust::Bust(uint64_t seed) {
  Random random(seed, kBustStream, 0);
  turn_ = random.uniform(0.03, 0.07) * (random.below(2) ? 1 : -1);
  width_ = random.uniform(0.95, 1.05);
  nose_ = random.uniform(-0.04, 0.06);
  jaw_ = random.uniform(-0.04, 0.05);
  brow_ = random.uniform(-0.02, 0.03);
}

Double3 Bust::unturned(const Double3& p) const {
  const Turn t = turn(turn_ * smoothstep(-1.6, -0.7, p[1]));
  const double z = p[2] - kAxisZ;
  return {p[0] * t.cos + z * t.sin, p[1], z * t.cos - p[0] * t.sin + kAxisZ};
}

double Bust::hair(const Double3& p) const {
  const double behind_the_line = 0.8 * (p[1] - 0.1) - (p[2] - 0.3);
  const double ear = ellipsoid({std::fabs(p[0]), p[1], p[2]}, {0.78, -0.08, -0.02}, {0.25, 0.3, 0.2});
  return smoothstep(-0.02, 0.1, behind_the_line) * smoothstep(-0.95, -0.7, p[1]) *
         smoothstep(-0.02, 0.08, ear);
}

double Bust::cloth(const Double3& p) const {
  const double x = p[0] - 0.1;
  const double neckline = -1.55 - 0.5 * smoothstep(0.4, 0, x * x) * smoothstep(-0.3, 0.4, p[2]);
  return smoothstep(0, 0.09, neckline - p[1]) * smoothstep(-2.75, -2.5, p[1]);
}

double Bust::eye(const Double3& p) const {
  const Double3 centre{0.27, 0.02, 0.62};
  const double white = ball(p, centre, 0.155), lids = ball(p, centre, 0.18);
  // The lids are a shell, open between two planes through the eye's axis.
  const double x = p[0] - centre[0], y = p[1] - centre[1], z = p[2] - centre[2];
  const double upper = 0.38 * z - y + 0.1 * x, lower = y + 0.22 * z - 0.05 * x;
  return join(white, join(cut(lids, upper, 0.02), cut(lids, lower, 0.02), 0.01), 0.012);
}

/// The parts in front of the skull, joined to `d`, the distance to it.
double Bust::face(double d, const Double3& p) const {
  d = join(d, rod(p, {0.08, 0.2, 0.76 + brow_}, {0.44, 0.21, 0.55}, 0.075, 0.05), 0.14);  // brow
  d = cut(d, -ellipsoid(p, {0.28, 0.02, 0.84}, {0.2, 0.14, 0.2}), 0.12);                  // socket
  d = join(d, eye(p), 0.03);
  const double tip = 0.98 + nose_;
  double nose = rod(p, {0, 0.22, 0.74}, {0, -0.22, tip}, 0.055, 0.085);
  nose = join(nose, rod(p, {0, 0.2, 0.66}, {0, -0.24, tip - 0.17}, 0.085, 0.14), 0.06);
  nose = join(nose, ball(p, {0.1, -0.27, tip - 0.16}, 0.07), 0.06);  // wing
  d = join(d, nose, 0.08);
  d = join(d, ellipsoid(p, {0, -0.585, 0.68}, {0.2, 0.16, 0.14}), 0.12);            // mouth, before lips
  d = cut(d, -rod(p, {0, -0.33, 0.9}, {0, -0.43, 0.89}, 0.03, 0.035), 0.06);        // groove below the nose
  d = join(d, rod(p, {0, -0.48, 0.795}, {0.2, -0.535, 0.66}, 0.045, 0.025), 0.04);  // upper lip
  d = join(d, rod(p, {0, -0.578, 0.785}, {0.17, -0.55, 0.66}, 0.055, 0.03), 0.03);  // lower lip
  d = cut(d, -rod(p, {0, -0.528, 0.84}, {0.18, -0.542, 0.7}, 0.008, 0.004), 0.06);
  return cut(d, -ellipsoid(p, {0, -0.685, 0.86}, {0.14, 0.045, 0.09}), 0.08);  // below the lips
}

double Bust::head(const Double3& unturned) const {
  const Double3 p{folded(unturned[0], 0.01) / width_, unturned[1], unturned[2]};
  double d = ellipsoid(p, {0, 0.36, -0.14}, {0.72, 0.78, 0.9});
  d = join(d, ellipsoid(p, {0, -0.18, 0.2}, {0.52, 0.84, 0.6}), 0.25);
  d = join(d, ellipsoid(p, {0.27, -0.55 - jaw_, 0.1}, {0.24, 0.26, 0.42}), 0.25);  // jaw
  d = join(d, ellipsoid(p, {0, -0.83 - jaw_, 0.55}, {0.18, 0.13, 0.18}), 0.2);     // chin
  d = join(d, ellipsoid(p, {0.36, -0.17, 0.5}, {0.18, 0.13, 0.2}), 0.2);           // cheekbone
  if (p[2] > -0.1) d = face(d, p);
  if (p[0] < 0.3) return d;
  double ear = ellipsoid(p, {0.63, -0.06, -0.02}, {0.2, 0.25, 0.155});
  ear = cut(ear, -ellipsoid(p, {0.87, -0.02, 0.03}, {0.12, 0.15, 0.08}), 0.05);
  return join(d, ear, 0.04);
}

double Bust::torso(const Double3& point) const {
  const Double3 p{folded(point[0], 0.05), point[1], point[2]};
  double d = 1e3;
  if (p[1] > -2.75) {
    d = ellipsoid(p, {0, -2.05, -0.2}, {1.0, 0.62, 0.6});
    d = join(d, ellipsoid(p, {0.85, -1.9, -0.25}, {0.42, 0.42, 0.4}), 0.3);          // shoulder
    d = join(d, rod(p, {0.1, -1.15, -0.4}, {0.85, -1.72, -0.3}, 0.28, 0.22), 0.35);  // trapezius
    d = join(d, ellipsoid(p, {0.38, -2.0, 0.22}, {0.45, 0.32, 0.25}), 0.25);         // breast
    d = join(d, rod(p, {0.1, -1.62, 0.24}, {0.85, -1.6, -0.1}, 0.06, 0.07), 0.12);   // collarbone
    d = cut(d, ellipsoid(p, {0, -1.55, -0.15}, {1.18, 1.05, 1.0}), 0.12);            // lower end of the bust
  }
  if (p[1] > -1.9) return d;
  double foot = disc(p, -2.92, 0.62, 0.08, 0.03);
  foot = join(foot, disc(p, -2.78, 0.52, 0.07, 0.06), 0.03);
  foot = join(foot, rod(p, {0, -2.6, kAxisZ}, {0, -2.3, kAxisZ}, 0.36, 0.42), 0.12);
  return join(d, foot, 0.08);
}

double Bust::distance(const Double3& p) const {
  const Double3 q = unturned(p);
  // Parts that are far away do not change the shape here.
  double d = 1e3;
  if (p[1] > -1.3) d = head(q);
  if (p[1] < -0.6) d = join(d, torso(p), 0.2);
  if (p[1] > -2.2 && p[1] < 0.2) {
    d = join(d, rod(p, {0, -0.4, -0.22}, {0, -1.7, -0.3}, 0.43, 0.5), 0.15);
    const Double3 half{folded(q[0], 0.04), q[1], q[2]};
    d = join(d, rod(half, {0.5, -0.45, -0.3}, {0.1, -1.6, 0.22}, 0.1, 0.07), 0.15);  // cord of the neck
  }
  return d;
}

}  // namespace nif::generate
