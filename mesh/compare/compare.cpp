// Distance: points distributed by area, Embree's BVH to find near triangles, double precision for the
// distances. Rays: evaluate() with the second mesh in place of an asset, so leaks are rays that were opened.
#include "mesh/compare/compare.hpp"

#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/ground_truth/embree_scene.hpp"
#include "bake/ground_truth/evaluate.hpp"
#include "formats/base/random.hpp"

namespace nif::compare {
namespace {

using mesh::CleanMesh;
using mesh::Triangle;

constexpr uint64_t kPurpose = 0x636f6d70617265;  // selects the random streams

/// Squared distance to the nearest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
double squared_distance(const Double3& p, const Double3& a, const Double3& b, const Double3& c) {
  const auto square = [](const Double3& v) { return dot(v, v); };
  const Double3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return square(ap);
  const Double3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return square(bp);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return square(ap - ab * (d1 / (d1 - d3)));
  const Double3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return square(cp);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return square(ap - ac * (d2 / (d2 - d6)));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const Double3 bc = c - b;
    return square(bp - bc * ((d4 - d3) / ((d4 - d3) + (d5 - d6))));
  }
  const double sum = va + vb + vc;
  return square(ap - ab * (vb / sum) - ac * (vc / sum));
}

/// Finds the triangles near a point with Embree's BVH, and computes the distances in double precision.
class Nearest {
 public:
  explicit Nearest(const CleanMesh& mesh)
      : mesh_(mesh), scene_({mesh.positions, mesh.triangles}, bake::EmbreeBuild::robust) {}

  /// Distance of a point from the surface. Any number of threads may call it.
  double distance(const Double3& point) const {
    Query query{this, point, std::numeric_limits<double>::infinity()};
    RTCPointQuery at{float(point[0]), float(point[1]), float(point[2]), 0,
                     std::numeric_limits<float>::infinity()};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_.handle(), &at, &context, &Nearest::visit, &query);
    return std::sqrt(query.least);
  }

 private:
  struct Query {
    const Nearest* nearest;
    Double3 point;
    double least;  ///< squared
  };

  static bool visit(RTCPointQueryFunctionArguments* arguments) {
    Query& query = *static_cast<Query*>(arguments->userPtr);
    const CleanMesh& mesh = query.nearest->mesh_;
    const Triangle& t = mesh.triangles[arguments->primID];
    const double found = squared_distance(query.point, to_double(mesh.positions[t[0]]),
                                          to_double(mesh.positions[t[1]]), to_double(mesh.positions[t[2]]));
    if (found >= query.least) return false;
    query.least = found;
    // A little more than the distance: Embree's floats must not cut off points that are nearer still.
    arguments->query->radius = float(std::sqrt(found) * 1.00001);
    return true;
  }

  const CleanMesh& mesh_;
  bake::EmbreeScene scene_;
};

/// Random points on a surface, evenly distributed by area.
class Sampler {
 public:
  explicit Sampler(const CleanMesh& mesh) : mesh_(mesh) {
    double sum = 0;
    ends_.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
      const Double3 a = to_double(mesh.positions[t[0]]);
      sum += length(cross(to_double(mesh.positions[t[1]]) - a, to_double(mesh.positions[t[2]]) - a));
      ends_.push_back(sum);
    }
  }

  Double3 draw(Random& random) const {
    // Two draws: 32 bits are too few to reach each of many millions of triangles.
    const double at = (random.uniform() + random.uniform() * 0x1p-32) * ends_.back();
    const auto found = std::upper_bound(ends_.begin(), ends_.end(), at);
    const size_t t = std::min(size_t(found - ends_.begin()), ends_.size() - 1);
    const double root = std::sqrt(random.uniform()), turn = random.uniform();
    const Double3 a = to_double(mesh_.positions[mesh_.triangles[t][0]]),
                  b = to_double(mesh_.positions[mesh_.triangles[t][1]]),
                  c = to_double(mesh_.positions[mesh_.triangles[t][2]]);
    return a * (1 - root) + b * (root * (1 - turn)) + c * (root * turn);
  }

 private:
  const CleanMesh& mesh_;
  std::vector<double> ends_;
};

/// Calls `distances_of(i)` for all i in parallel, and adds up the results in order.
template <class DistanceOf>
Distance collect(uint64_t count, uint64_t chunk, DistanceOf distances_of) {
  const uint64_t chunks = (count + chunk - 1) / chunk;
  std::vector<Distance> parts(chunks);
  tbb::parallel_for(uint64_t{0}, chunks, [&](uint64_t b) {
    Distance& part = parts[b];
    const auto add = [&](double d) {
      ++part.samples;
      part.mean += d;
      part.root_mean_square += d * d;
      part.max = std::max(part.max, d);
    };
    distances_of(b, b * chunk, std::min(count, (b + 1) * chunk), add);
  });
  Distance all;
  for (const Distance& part : parts) {
    all.samples += part.samples;
    all.mean += part.mean;
    all.root_mean_square += part.root_mean_square;
    all.max = std::max(all.max, part.max);
  }
  if (all.samples > 0) {
    all.mean /= double(all.samples);
    all.root_mean_square = std::sqrt(all.root_mean_square / double(all.samples));
  }
  return all;
}

}  // namespace

Distance distance(const CleanMesh& from, const CleanMesh& to, uint64_t samples, uint64_t seed) {
  constexpr uint64_t kChunk = 4096;
  const Nearest nearest(to);
  const Sampler sampler(from);
  Distance drawn =
      collect(samples, kChunk, [&](uint64_t chunk, uint64_t first, uint64_t last, const auto& add) {
        Random random(seed, kPurpose, chunk);
        for (; first < last; ++first) add(nearest.distance(sampler.draw(random)));
      });
  const Distance vertices =
      collect(from.positions.size(), kChunk, [&](uint64_t, uint64_t first, uint64_t last, const auto& add) {
        for (; first < last; ++first) add(nearest.distance(to_double(from.positions[first])));
      });
  drawn.max = std::max(drawn.max, vertices.max);
  return drawn;
}

Visibility visibility(const bake::GroundTruth& first, const bake::EmbreeTruth& second, bake::RaySet set,
                      uint64_t rays, uint64_t seed) {
  const bake::RaysWithTruth drawn = bake::make_ray_set(first.source(), set, rays, seed);
  const bake::Accuracy found = bake::evaluate(
      drawn,
      [&](std::span<const bake::Segment> segments, const bake::Answers& answers) {
        for (size_t i = 0; i < segments.size(); ++i) {
          answers.visible[i] = !second.occluded(segments[i]);
          answers.certain[i] = 0;
          answers.probability[i] = answers.visible[i];
        }
      },
      first.source().embree);
  return {set, found.rays, found.leak, found.spurious};
}

}  // namespace nif::compare
