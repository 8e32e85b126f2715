// Meshes that lie far from the origin for their size, as surveys and CAD have them: floats are too coarse for
// their coordinates. Readers keep their positions relative to an offset, which places the mesh, and writers
// add it again.
#pragma once

#include <functional>
#include <optional>

#include "formats/mesh/input.hpp"

namespace nif::mesh {

/// A box whose sides doubles can tell.
struct WideBox {
  Double3 low, high;
};

/// Where a mesh as it is placed should have its origin. None if floats are fine for it: they are too coarse
/// where rounding may move a corner by more than 1/4096 of the box's smallest side (or of 1/256 of its
/// longest, if that is more) or by more than 1/65536 of its longest side, and where an offset helps. The
/// offset is exact as floats, and as round a number as lies near the middle of the box; 0 along axes where
/// the box is near the origin.
std::optional<Double3> far_offset(const WideBox& box);

/// The same for a mesh that is placed.
std::optional<Double3> far_offset(const Mesh& mesh, const Instance& instance);

/// The same for all of a scene together; 0 if floats are fine for it.
Double3 far_offset(const Scene& scene);

/// Moves what a scene places, and loses nothing.
void move_instances(Scene& scene, const Double3& by);

/// The number with the fewest digits behind the point that is the same float relative to `offset`.
double shortest_near(double value, double offset);

namespace detail {

/// Reads a file whose positions may be no floats. If floats may be too coarse for a mesh, `read` is called
/// again, with Input::exact; meshes of which rounding loses something then get an offset. A note says where
/// even that is not enough.
Scene read_exactly(const Input& input, const std::function<Scene(const Input&)>& read);

/// Keeps the remainders of instances that floats are too coarse to place: where rounding would move one by
/// more than 1/4096 of its mesh's smallest side.
void forget_small_remainders(Scene& scene);

}  // namespace detail
}  // namespace nif::mesh
