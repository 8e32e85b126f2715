// The named ray sets on which accuracy is stated, and from which training rays are drawn.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "bake/ground_truth/embree_truth.hpp"
#include "formats/base/random.hpp"
#include "formats/mesh/box.hpp"

namespace nif::bake {

/// docs/ray-sets.md defines each.
enum class RaySet : uint32_t { outer_lines, inner_surface, inner_volume, segments, sun, camera };
/// The sets on which accuracy is always stated.
inline constexpr std::array kRaySets{RaySet::outer_lines, RaySet::inner_surface, RaySet::inner_volume,
                                     RaySet::segments, RaySet::sun};
/// These, and the sets that a user may request.
inline constexpr std::array kAllRaySets{RaySet::outer_lines, RaySet::inner_surface, RaySet::inner_volume,
                                        RaySet::segments,    RaySet::sun,           RaySet::camera};

/// True if a set consists of pictures in scan order, so that each ray is similar to the one before.
constexpr bool is_coherent(RaySet set) { return set == RaySet::sun || set == RaySet::camera; }

std::string_view name_of(RaySet set);
std::optional<RaySet> ray_set_named(std::string_view name);

/// Distance from the surface at which shadow rays start, as a fraction of the AABB's longest side.
inline constexpr float kBiasFraction = 1e-3f;

/// Lengths of `segments` run from this fraction of the AABB's diagonal to all of it.
inline constexpr double kShortestSegment = 0.01;

/// Everything needed to draw rays for an object, or for a scene of instances. Immutable while in use; not
/// owned.
struct RaySource {
  const EmbreeTruth& embree;
  const InsideTest& inside;
  mesh::Box box;
  float bias;
  bool has_volume;                     ///< some of the box lies outside every solid, see has_free_volume()
  std::span<const float> biases = {};  ///< of each instance; empty: `bias` everywhere
};

/// False if the box is flatter than the bias along an axis, or if 4,096 random points of it all lie inside.
bool has_free_volume(const InsideTest& inside, const mesh::Box& box, float bias);

/// A segment from single-precision copies of its origin and direction, with tmin = 0.
Segment make_segment(const Double3& origin, const Double3& direction, float tmax);

/// One random ray of a set (not of coherent ones, which are pictures and not distributions). Directions have
/// unit length. nullopt if no ray hits the object (or leaves it free) within many tries.
std::optional<Segment> draw_ray(const RaySource& source, RaySet set, Random& random);

/// Where shadow rays start: off the surface by the bias, on the viewer's side.
struct SurfacePoint {
  Double3 origin;
  Double3 normal;  ///< unit length, towards the viewer
};

// Building blocks of some sets' rays, for callers that draw many rays from one start.
std::optional<SurfacePoint> draw_surface_point(const RaySource& source, Random& random);
Segment draw_from(const SurfacePoint& point, Random& random);
/// Gives an infinite ray a length as in `segments`.
void draw_length(const RaySource& source, Segment& ray, Random& random);

/// Directions of the sun in its set, each with a picture of its own.
inline constexpr size_t kSuns = 32;
/// Cameras in their set, each with a picture of its own.
inline constexpr size_t kCameras = 4;

struct RaysWithTruth {
  std::vector<Segment> segments;
  std::vector<uint8_t> visible;  ///< ground truth
  /// Where the rays of each sun or camera end; for sets that are not coherent one group, which ends with the
  /// last ray.
  std::vector<size_t> group_ends;
};

/// make_ray_set() without ground truth: `visible` stays empty.
RaysWithTruth draw_ray_set(const RaySource& source, RaySet set, size_t count, uint64_t seed);

/// The first `count` rays of a set for a seed, in parallel and the same for any number of threads. Fewer if
/// the object has no such rays (a set of a flat sheet, say, can be empty).
RaysWithTruth make_ray_set(const RaySource& source, RaySet set, size_t count, uint64_t seed);

}  // namespace nif::bake
