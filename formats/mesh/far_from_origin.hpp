// Handles meshes that are far from the origin for their size, as in surveys and CAD, for whose coordinates
// floats are too coarse. Readers store positions relative to an offset, which places the mesh, and writers
// add it again.
#pragma once

#include <functional>
#include <optional>

#include "formats/mesh/input.hpp"

namespace nif::mesh {

/// A box whose sides doubles resolve.
struct WideBox {
  Double3 low, high;
};

/// The origin that a placed mesh should have. Nothing if floats are precise enough for it. They are too
/// coarse if rounding may move a corner by more than 1/4096 of the box's smallest side (or of 1/256 of its
/// longest, if that is more) or by more than 1/65536 of its longest side, and if an offset helps. The offset
/// is exact in floats, and the roundest number near the middle of the box; it is 0 along axes where the box
/// is near the origin.
std::optional<Double3> far_offset(const WideBox& box);

/// The same for a placed mesh.
std::optional<Double3> far_offset(const Mesh& mesh, const Instance& instance);

/// The same for a whole scene; 0 if floats are precise enough.
Double3 far_offset(const Scene& scene);

/// Moves all instances of a scene, without loss.
void move_instances(Scene& scene, const Double3& by);

/// The number with the fewest decimals that is the same float relative to `offset`.
double shortest_near(double value, double offset);

namespace detail {

/// Reads a file whose positions may not be floats. If floats may be too coarse for a mesh, calls `read` again
/// with Input::exact; meshes that would lose something by rounding then get an offset. A note reports if that
/// is not enough.
Scene read_exactly(const Input& input, const std::function<Scene(const Input&)>& read);

/// Keeps the remainders of instances that floats are too coarse to place, which means that rounding would
/// move one by more than 1/4096 of its mesh's smallest side.
void forget_small_remainders(Scene& scene);

}  // namespace detail
}  // namespace nif::mesh
