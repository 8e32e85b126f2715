// Triangulates a polygon, so that the triangles cover it and nothing else. Internal to formats/mesh.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/orientation.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/blockers.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh::detail {

/// Triangulates polygons of four or more corners, one after another. Corners may repeat, lie on lines or on
/// each other, and an edge may be used twice, once in each direction, as the bridge to a hole.
///
/// A polygon is viewed along the axis of the largest component of its normal (Newell's), where its
/// coordinates stay the floats of the file, so that every sign is certain. If it is convex there, it stays
/// the fan that it is. Otherwise ears are cut off. They add up to the polygon, whatever the order: if no
/// triangle faces backwards, no point is in more of them than the winding number of the outline around it. So
/// no triangle leaves a polygon whose outline does not cross itself.
class PolygonCutter {
 public:
  /// Properties that are worth a note.
  struct Found {
    /// No triangulation was found in which all face forwards: the outline crosses itself.
    bool crosses = false;
    bool bent = false;  ///< five or more corners that are far from flat
  };

  /// Polygons with more corners are treated as self-crossing, because they would need much memory.
  static constexpr size_t kMostCorners = 1 << 22;

  /// `fan` has the triangles of a polygon, as a fan around its first corner, with valid indices. They are
  /// replaced if it is not convex. The result then depends on the polygon's geometry, not on which corner
  /// comes first. Takes nearly linear time; the work is bounded. A polygon with a corner that is not finite
  /// stays a fan.
  Found cut(std::span<const Float3> positions, std::span<Triangle> fan);

 private:
  struct Corner {
    uint32_t before = 0, after = 0;
    uint32_t stamp = 0;  ///< changes with its neighbours
    bool gone = false;
  };
  struct Waiting {
    uint32_t corner, stamp;
  };
  /// A corner that may be cut off if there is no ear.
  struct Least {
    double area;
    uint32_t corner, stamp;
  };
  static constexpr auto kSooner = [](const Least& a, const Least& b) {  // of a heap
    return a.area != b.area ? a.area > b.area : a.corner > b.corner;
  };
  // Number of visited boxes and corners: up to twice Blockers::kFewest for each corner of a small polygon;
  // for a million corners, per corner 57 in a star, 165 in a spiral, 250 in a comb, 450 in a skyline.
  // Afterwards: once it is clear that the outline crosses itself.
  static constexpr int64_t kFirstWork = 10'000, kWorkPerCorner = 500, kWorkAfterwards = 100;
  /// Which corners count as ears.
  enum class Rule : uint8_t {
    clear,     ///< those whose third side touches nothing
    touching,  ///< also those whose third side touches corners on its other side
    straight,  ///< also those on a straight line
  };

  struct Plane {
    Double3 normal{};
    int axis = 2;
    bool certain_axis = false, certain_sign = false;
  };

  Plane plane_of(std::span<const Float3> positions) const;
  void project(std::span<const Float3> positions, int axis);
  bool is_convex();
  bool is_bent(std::span<const Float3> positions, const Plane& plane) const;
  bool is_clockwise() const;
  void start_at_least(std::span<const Float3> positions);
  bool clip(std::span<Triangle> out);

  double turn(uint32_t b) const;
  bool is_straight(uint32_t b) const;
  bool is_ear(uint32_t b);
  bool blocks(uint32_t p, uint32_t a, uint32_t b, uint32_t c) const;
  void look_at(uint32_t corner);
  void remove(uint32_t b, double area);
  void refill();
  void forget_straight();
  uint32_t least();

  std::vector<uint32_t> vertices_;         // of the corners, in the order of processing
  std::vector<Point2> points_, distinct_;  // the corners in the plane
  std::vector<Corner> corners_;
  std::vector<uint32_t> spikes_;
  std::vector<Waiting> queue_;
  std::vector<Least> heap_;
  Blockers blockers_;
  size_t next_ = 0;   // in queue_
  uint32_t any_ = 0;  // some remaining corner
  size_t left_ = 0;
  int64_t budget_ = 0, half_budget_ = 0;
  double slack_ = 0;                     // how far rounding may have moved corners relative to each other
  double forwards_ = 0, backwards_ = 0;  // twice the areas of triangles by orientation
  bool straight_block_ = true;           // corners on a straight line are among the blockers
  Rule rule_ = Rule::clear;
  bool has_heap_ = false;
  std::span<Triangle> out_;
  size_t written_ = 0;
};

}  // namespace nif::mesh::detail
