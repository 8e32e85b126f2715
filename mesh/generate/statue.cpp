// `statue`: a bust found along rays from its axis, then roughened: curls, folds, chiselled stone.
#include <algorithm>
#include <cmath>

#include "mesh/generate/bust.hpp"
#include "mesh/generate/computed.hpp"
#include "mesh/generate/noise.hpp"
#include "mesh/generate/shapes.hpp"
#include "mesh/generate/stacked_rings.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

// Rays start on the axis between these heights; below and above, they fan out.
constexpr double kLowest = Bust::kFoot + 0.3, kHighest = 0.35;

class Statue {
 public:
  explicit Statue(const Request& request)
      : rings_(request.triangles, 0.6),
        bust_(request.seed),
        curls_(request.seed, 1),
        folds_(request.seed, 2),
        stone_(request.seed, 3) {}

  uint64_t vertex_count() const { return rings_.vertex_count(); }
  uint64_t triangle_count() const { return rings_.triangle_count(); }
  mesh::Triangle triangle(uint64_t index) const { return rings_.triangle(index); }

  Double3 vertex(uint64_t index) const {
    const StackedRings::Place place = rings_.place(index);
    const Turn around = turn(place.turns), up = turn(place.elevation / 4);
    // No two rays intersect, because both their origins and their directions rise. So the surface does not
    // intersect itself, whatever the distances along them.
    const Double3 origin{0, kLowest + place.height * (kHighest - kLowest), Bust::kAxisZ};
    const Double3 direction{up.cos * around.cos, up.sin, -up.cos * around.sin};
    const double way = hit(origin, direction);
    return origin + direction * std::fmax(0.05, way + relief(origin + direction * way));
  }

 private:
  /// Distance from `origin`, which is inside, to the surface along the ray.
  double hit(const Double3& origin, const Double3& direction) const {
    const auto distance = [&](double way) { return bust_.distance(origin + direction * way); };
    double inside = 0, at_inside = distance(0), outside = 0, at_outside = 0;
    for (int step = 0; step < 64; ++step) {
      outside = inside + std::fmax(-0.9 * at_inside, 0.01);
      at_outside = distance(outside);
      if (at_outside >= 0) break;
      inside = outside;
      at_inside = at_outside;
    }
    // Regula falsi, with the Illinois rule against an end that does not move.
    for (int step = 0; step < 20 && outside - inside > 1e-9; ++step) {
      const double middle = inside + (outside - inside) * at_inside / (at_inside - at_outside);
      const double at_middle = distance(middle);
      if (std::fabs(at_middle) < 1e-9) return middle;
      if (at_middle < 0) {
        inside = middle;
        at_inside = at_middle;
        at_outside /= 2;
      } else {
        outside = middle;
        at_outside = at_middle;
        at_inside /= 2;
      }
    }
    return (inside + outside) / 2;
  }

  /// Height of the relief at a point of the bust.
  double relief(const Double3& p) const {
    const Double3 q = bust_.unturned(p);
    const double hair = bust_.hair(q), cloth = bust_.cloth(p);
    double raised = 0.004 * stone_.octaves(p * 6, 11, 0.55);
    if (hair > 0) {
      // Locks follow the level lines of a noise, which curl around its peaks, and consist of strands.
      const double field = curls_(q * 1.9) + 0.3 * curls_(q * 4.1);
      const double lock = std::fabs(turn(1.6 * field).sin), strand = std::fabs(turn(8 * field).sin);
      raised += hair * (0.03 + 0.1 * lock + 0.015 * strand + 0.05 * curls_(q * 3.0));
    }
    if (cloth > 0) {
      // Folds hang between the shoulders.
      const Double3 bent = folds_.warp(p * 0.9, 0.35);
      const double across = bent[1] * 2.2 - 1.1 * bent[0] * bent[0] + 0.5 * bent[2];
      const double fold = std::fabs(turn(across).sin);
      raised += cloth * (0.04 + 0.07 * (1 - fold * fold) + 0.02 * folds_.octaves(p * 3, 3, 0.5));
    }
    return raised;
  }

  StackedRings rings_;
  Bust bust_;
  Noise curls_, folds_, stone_;
};

}  // namespace

std::unique_ptr<mesh::MeshSource> make_statue(const Request& request) { return computed(Statue(request)); }

}  // namespace nif::generate
