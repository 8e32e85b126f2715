// A file is first read as floats. Only if these may be too coarse, it is read again in doubles, and the
// meshes that need it are moved near the origin. Offsets are chosen so that floats represent them exactly.
#include "formats/mesh/far_from_origin.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "formats/base/rounding.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh {
namespace {

/// Fractions of the smallest side and of the longest side.
constexpr double kParts = 4096, kPartsOfLongest = 65536;
/// Sides count as at least this fraction of the longest side, because thinner ones may be noise.
constexpr double kThinnest = 1.0 / 256;
/// A box is far from the origin along an axis if it extends this many times farther than it is long. Then all
/// of it is far, and an offset makes nothing coarser.
constexpr double kFar = 2;

/// Half the spacing of floats of this size, which is the most that rounding moves them.
double rounding_of(double size) { return std::ldexp(1.0, std::max(std::ilogb(size), -126) - 24); }

WideBox no_box() {
  constexpr double kMost = std::numeric_limits<double>::infinity();
  return {{kMost, kMost, kMost}, {-kMost, -kMost, -kMost}};
}

/// NaN is ignored.
void add(WideBox& box, const Double3& p) {
  for (size_t a = 0; a < 3; ++a) {
    box.low[a] = std::min(box.low[a], p[a]);
    box.high[a] = std::max(box.high[a], p[a]);
  }
}

/// The properties of a box that the rule needs.
struct Reach {
  Double3 side, farthest;
  double longest = 0;

  /// `doubt`: by how many roundings its sides may be longer or shorter.
  explicit Reach(const WideBox& box) {
    for (size_t a = 0; a < 3; ++a) {
      side[a] = box.high[a] - box.low[a];
      farthest[a] = std::max(std::abs(box.low[a]), std::abs(box.high[a]));
      longest = std::max(longest, side[a]);
    }
  }

  bool finite() const {
    return std::ranges::all_of(farthest,
                               [](double x) { return x <= double{std::numeric_limits<float>::max()}; });
  }
  bool far(size_t a, double doubt) const {
    return farthest[a] > 0 && farthest[a] >= kFar * (side[a] - doubt * rounding_of(farthest[a]));
  }
  bool far_anywhere(double doubt) const { return far(0, doubt) || far(1, doubt) || far(2, doubt); }

  /// How far a corner may move, in relation to the others of the mesh (`within`) or to other meshes.
  double allowed(double doubt, bool within = true) const {
    double least = within ? longest / kPartsOfLongest * kParts : longest;
    for (size_t a = 0; a < 3; ++a) {
      const double unsure = farthest[a] > 0 ? doubt * rounding_of(farthest[a]) : 0;
      if (side[a] + unsure > kThinnest * longest)
        least = std::min(least, std::max(side[a] - unsure, kThinnest * longest));
    }
    return least / kParts;
  }

  /// `doubt`: by how many roundings each side may be longer or shorter than in the box.
  bool coarse(double doubt) const {
    if (!finite()) return false;
    const double least = allowed(doubt);
    for (size_t a = 0; a < 3; ++a)
      if (far(a, doubt) && rounding_of(farthest[a]) > least) return true;
    return false;
  }
};

/// Both ends of a side are rounded.
constexpr double kRoundedSides = 2;

/// Whether floats may be too coarse, judged by rounded positions. Stops as early as possible: a box that is
/// near the origin stays so, whatever is added to it.
bool may_be_coarse(const Mesh& mesh) {
  constexpr size_t kStep = 256;
  WideBox box = no_box();
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t v : mesh.triangles[t]) {
      if (v >= mesh.positions.size()) return false;  // it will be refused
      add(box, to_double(mesh.positions[v]));
    }
    if (t % kStep == 0 && !Reach(box).far_anywhere(kRoundedSides)) return false;
  }
  return Reach(box).coarse(kRoundedSides);
}

/// All offsets are multiples of a power of two, about half the box's longest side.
Double3 offset_of(const WideBox& box, const Reach& reach) {
  Double3 offset{};
  for (size_t a = 0; a < 3; ++a) {
    if (!reach.far(a, 0)) continue;
    const int of_float = std::ilogb(reach.farthest[a]) - 23,
              of_box = reach.longest > 0 ? std::ilogb(reach.longest) - 1 : of_float;
    const double step = std::ldexp(1.0, std::max(of_float, of_box));
    const double middle = box.low[a] + reach.side[a] / 2;
    const auto rounded = static_cast<float>(step * std::round(middle / step));
    if (std::isfinite(rounded)) offset[a] = double{rounded};
  }
  return offset;
}

/// What the meshes of a file lost by rounding.
struct Loss {
  uint64_t meshes = 0;
  double most = 0;
  std::string name;  ///< of the mesh with the largest loss
};

/// Moves a mesh to its offset, if floats are too coarse for it. Its positions are then those of the file
/// minus the offset, in double, rounded once.
Double3 take_near(Mesh& mesh, Loss& loss) {
  const std::vector<Double3> exact = std::exchange(mesh.exact, {});
  WideBox box = no_box();
  bool rounded = false;
  for (const Triangle& triangle : mesh.triangles)
    for (const uint32_t v : triangle) {
      if (v >= exact.size()) return {};
      add(box, exact[v]);
      for (size_t a = 0; a < 3; ++a) rounded = rounded || double{mesh.positions[v][a]} != exact[v][a];
    }
  const std::optional<Double3> offset = rounded ? far_offset(box) : std::nullopt;
  if (!offset) return {};
  for (size_t v = 0; v < exact.size(); ++v) mesh.positions[v] = to_float(exact[v] - *offset);
  double most = 0;
  for (const Triangle& triangle : mesh.triangles)
    for (const uint32_t v : triangle)
      for (size_t a = 0; a < 3; ++a)
        most = std::max(most, std::abs(exact[v][a] - (*offset)[a] - double{mesh.positions[v][a]}));
  if (most > Reach(box).allowed(0)) {
    ++loss.meshes;
    if (most > loss.most) loss.most = most, loss.name = mesh.name;
  }
  return *offset;
}

}  // namespace

std::optional<Double3> far_offset(const WideBox& box) {
  const Reach reach(box);
  if (!(reach.longest > 0) || !reach.coarse(0)) return std::nullopt;
  return offset_of(box, reach);
}

std::optional<Double3> far_offset(const Mesh& mesh, const Instance& instance) {
  WideBox box = no_box();
  constexpr size_t kStep = 256;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t v : mesh.triangles[t]) add(box, placed(instance, mesh.positions[v]));
    if (t % kStep == 0 && !Reach(box).far_anywhere(0)) return std::nullopt;
  }
  return far_offset(box);
}

Double3 far_offset(const Scene& scene) {
  WideBox box = no_box();
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    for (const Triangle& triangle : mesh.triangles)
      for (const uint32_t v : triangle) add(box, placed(instance, mesh.positions[v]));
  }
  return far_offset(box).value_or(Double3{});
}

void move_instances(Scene& scene, const Double3& by) {
  if (by == Double3{}) return;
  for (Instance& instance : scene.instances)
    for (size_t a = 0; a < 3; ++a) {
      float& rounded = instance.transform[4 * a + 3];
      const double exact = double{rounded} + instance.remainder[a] + by[a];
      rounded = static_cast<float>(exact);
      instance.remainder[a] = lost_to_float(exact);
    }
}

double shortest_near(double value, double offset) {
  const auto wanted = static_cast<float>(value - offset);
  if (wanted == 0 || !std::isfinite(wanted)) return value;
  std::array<char, 64> text;
  double read = value;
  // Also tries numbers with one digit fewer than needed to tell two neighbours apart.
  const double distance = 2 * rounding_of(std::abs(double{wanted}));
  const int digits = std::max(0, static_cast<int>(std::floor(-std::log10(distance))));
  for (int more = 0; more < 3 && digits + more < 20; ++more) {
    const auto end =
        std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, digits + more);
    if (end.ec != std::errc()) break;
    std::from_chars(text.data(), end.ptr, read);
    if (static_cast<float>(read - offset) == wanted) return read;
  }
  return value;
}

namespace detail {

Scene read_exactly(const Input& input, const std::function<Scene(const Input&)>& read) {
  Scene scene = read(input);
  if (std::ranges::none_of(scene.meshes, may_be_coarse)) return scene;
  Input again = input;
  again.exact = true;
  scene = {};  // both at once would take more memory
  scene = read(again);
  std::vector<Double3> offsets;
  Loss loss;
  for (Mesh& mesh : scene.meshes) offsets.push_back(take_near(mesh, loss));
  for (Instance& instance : scene.instances)
    for (size_t a = 0; a < 3; ++a)
      instance.transform[4 * a + 3] = static_cast<float>(offsets[instance.mesh][a]);
  if (loss.meshes > 0)
    scene.notes.push_back(
        {NoteKind::rounding,
         fmt::format("{}: floats cannot hold the positions of {}, not even near its middle: they "
                     "were rounded, by up to {:.3g} in mesh '{}'",
                     input.file.string(), loss.meshes == 1 ? "a mesh" : fmt::format("{} meshes", loss.meshes),
                     loss.most, loss.name)});
  return scene;
}

void forget_small_remainders(Scene& scene) {
  std::vector<std::optional<Box>> boxes(scene.meshes.size());
  for (Instance& instance : scene.instances) {
    if (instance.remainder == Double3{}) continue;
    const Mesh& mesh = scene.meshes[instance.mesh];
    std::optional<Box>& own = boxes[instance.mesh];
    if (!own) own = bounds(mesh.positions, mesh.triangles);
    const Box box = bounds(*own, instance.transform);
    const double allowed = Reach({to_double(box.min), to_double(box.max)}).allowed(0, false);
    double moved = 0;
    for (const double x : instance.remainder) moved = std::max(moved, std::abs(x));
    if (!(moved > allowed)) instance.remainder = {};
  }
}

}  // namespace detail
}  // namespace nif::mesh
