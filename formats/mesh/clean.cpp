// Welds and removes duplicates with open-addressing hash tables that store only indices: seven million
// triangles take a few dozen megabytes and about a second.
#include "formats/mesh/clean.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <string>

#include "formats/base/collinear.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

uint64_t mix(uint32_t a, uint32_t b, uint32_t c) {
  uint64_t h = (uint64_t{a} << 32 | b) * 0x9E3779B97F4A7C15u;
  h = (h ^ (h >> 32) ^ c) * 0xD6E8FEB86659FD93u;
  return h ^ (h >> 32);
}

/// A set of indices into an array, compared by the elements that they refer to.
class IndexSet {
 public:
  explicit IndexSet(size_t most) : slots_(std::bit_ceil(most * 2 + 2), kNone) {}

  /// Returns the member that `equal` calls equal to `index`; otherwise inserts `index` and returns it.
  template <class Equal>
  uint32_t insert(uint64_t hash, uint32_t index, Equal equal) {
    const size_t mask = slots_.size() - 1;
    for (size_t i = hash & mask;; i = (i + 1) & mask) {
      if (slots_[i] == kNone) return slots_[i] = index;
      if (equal(slots_[i])) return slots_[i];
    }
  }

 private:
  std::vector<uint32_t> slots_;
};

Float3 without_negative_zero(Float3 p) {
  for (float& x : p) x += 0.0f;  // -0 + 0 is +0; nothing else changes
  return p;
}

using Bits = std::array<uint32_t, 3>;
Bits bits(const Float3& p) { return std::bit_cast<Bits>(p); }

bool is_clear(const Mesh& mesh, size_t triangle) {
  return !mesh.alpha.empty() && mesh.alpha[triangle] == TriangleAlpha::clear;
}

/// Maps every used position to its index in `out`; with `equal_ones`, equal positions get the same index.
/// Positions that no triangle uses, or only clear ones, map to kNone.
std::vector<uint32_t> weld(const Mesh& mesh, bool equal_ones, CleanMesh& out) {
  std::vector<bool> used(mesh.positions.size());
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (is_clear(mesh, i)) continue;
    for (const uint32_t v : mesh.triangles[i]) used[v] = true;
  }
  std::vector<uint32_t> welded(mesh.positions.size(), kNone);
  IndexSet seen(equal_ones ? mesh.positions.size() : 0);
  for (size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!used[v]) continue;
    const Float3 p = without_negative_zero(mesh.positions[v]);
    const Bits key = bits(p);
    const uint32_t next = static_cast<uint32_t>(out.positions.size());
    welded[v] = !equal_ones ? next : seen.insert(mix(key[0], key[1], key[2]), next, [&](uint32_t other) {
      return bits(out.positions[other]) == key;
    });
    if (welded[v] == next) {
      out.positions.push_back(p);
    } else {
      ++out.report.welded_positions;
    }
  }
  return welded;
}

/// The corner with the smallest index.
size_t first_corner(const Triangle& t) {
  if (t[0] < t[1] && t[0] < t[2]) return 0;
  return t[1] < t[2] ? 1 : 2;
}

/// The same corners, beginning with another one.
template <class Corner>
std::array<Corner, 3> from_corner(const std::array<Corner, 3>& corners, size_t first) {
  return {corners[first], corners[(first + 1) % 3], corners[(first + 2) % 3]};
}

/// Equal for triangles that cover each other: the corners from the one with the smallest index on, and the holes
/// likewise.
struct Key {
  Triangle corners;
  TriangleHoles holes;

  explicit Key(const Triangle& t, const TriangleHoles& own = {})
      : corners(from_corner(t, first_corner(t))), holes(own) {
    holes.places = from_corner(own.places, first_corner(t));
  }
  bool operator==(const Key&) const = default;

  /// Many triangles may have the same corners and different holes.
  uint64_t hash() const {
    uint64_t h = mix(corners[0], corners[1], corners[2]);
    if (!holes.any()) return h;
    h ^= mix(holes.map, holes.shift, 0);
    for (const auto& [x, y] : holes.places)
      h = mix(uint32_t(h >> 32), uint32_t(x), uint32_t(y)) ^ uint32_t(h);
    return h;
  }
};

Triangle welded_triangle(const Mesh& mesh, size_t number, const std::vector<uint32_t>& welded) {
  const Triangle& t = mesh.triangles[number];
  return {welded[t[0]], welded[t[1]], welded[t[2]]};
}

/// The corners of all triangles without holes, sorted, if others have some: those are covered if they are among these.
std::vector<Triangle> whole_triangles(const Mesh& mesh, const std::vector<uint32_t>& welded) {
  std::vector<Triangle> whole;
  for (size_t number = 0; number < mesh.holes.size(); ++number)
    if (!mesh.holes[number].any() && !is_clear(mesh, number))
      whole.push_back(Key(welded_triangle(mesh, number, welded)).corners);
  std::ranges::sort(whole);
  return whole;
}

/// Drops them from a list in which they have the same order.
void drop_slivers(const std::vector<Triangle>& slivers, std::vector<Triangle>& triangles,
                  std::vector<TriangleHoles>& holes) {
  if (slivers.empty()) return;
  size_t sliver = 0, kept = 0;
  for (size_t i = 0; i < triangles.size(); ++i) {
    if (sliver < slivers.size() && triangles[i] == slivers[sliver]) {
      ++sliver;
      continue;
    }
    if (!holes.empty()) holes[kept] = holes[i];
    triangles[kept++] = triangles[i];
  }
  triangles.resize(kept);
  if (!holes.empty()) holes.resize(kept);
}

}  // namespace

CleanMesh clean_or_nothing(const Mesh& mesh, bool equal_ones_welded) {
  CleanMesh out;
  const std::vector<uint32_t> welded = weld(mesh, equal_ones_welded, out);

  // Slivers are separated from triangles afterwards: until then, both are in one list, in the same order.
  std::vector<Triangle> distinct;
  distinct.reserve(mesh.triangles.size());
  const std::vector<Triangle> whole = whole_triangles(mesh, welded);
  std::vector<TriangleHoles> holes;  // of the same list, if any has some
  const auto holes_of = [&](uint32_t place) { return holes.empty() ? TriangleHoles() : holes[place]; };
  IndexSet seen(mesh.triangles.size());
  for (uint32_t number = 0; number < mesh.triangles.size(); ++number) {
    if (is_clear(mesh, number)) {
      ++out.report.clear;
      out.dropped.push_back(number);
      continue;
    }
    const Triangle t = welded_triangle(mesh, number, welded);
    const bool line = t[0] == t[1] || t[1] == t[2] || t[2] == t[0],
               sliver = !line && collinear(out.positions[t[0]], out.positions[t[1]], out.positions[t[2]]);
    TriangleHoles own = mesh.holes.empty() ? TriangleHoles() : mesh.holes[number];
    // A sliver with holes closes no gap of its neighbours.
    if (line || (sliver && own.any())) {
      ++out.report.degenerate;
      out.dropped.push_back(number);
      continue;
    }
    if (own.any() && std::ranges::binary_search(whole, Key(t).corners)) own = {};
    const Key key(t, own);
    const uint32_t next = static_cast<uint32_t>(distinct.size());
    const uint32_t first = seen.insert(
        key.hash(), next, [&](uint32_t other) { return Key(distinct[other], holes_of(other)) == key; });
    out.report.degenerate += sliver;
    if (sliver || first != next) out.dropped.push_back(number);
    if (first == next) {
      distinct.push_back(t);
      if (!mesh.holes.empty()) holes.push_back(own);
      if (!sliver) continue;
      out.slivers.push_back(t);
      out.sliver_numbers.push_back(number);
    } else if (!sliver) {
      ++out.report.duplicate;
    }
  }
  drop_slivers(out.slivers, distinct, holes);
  out.triangles = std::move(distinct);
  if (std::ranges::any_of(holes, &TriangleHoles::any)) {
    out.holes = std::move(holes);
    out.alpha_maps = mesh.alpha_maps;
  }
  return out;
}

std::vector<uint32_t> source_triangles(const CleanMesh& clean) {
  std::vector<uint32_t> numbers;
  numbers.reserve(clean.triangles.size());
  auto dropped = clean.dropped.begin();
  for (uint32_t number = 0; numbers.size() < clean.triangles.size(); ++number) {
    if (dropped != clean.dropped.end() && *dropped == number)
      ++dropped;
    else
      numbers.push_back(number);
  }
  return numbers;
}

void drop_clear(Scene& scene) {
  for (Mesh& mesh : scene.meshes) detail::keep_triangles(mesh, [&](size_t t) { return !is_clear(mesh, t); });
  drop_empty_meshes(scene);
}

CleanMesh clean(const Mesh& mesh) {
  CleanMesh out = clean_or_nothing(mesh);
  if (out.triangles.empty()) {
    const std::string why =
        out.report.clear == mesh.triangles.size() ? " triangles, but all of them let light through, and "
                                                    "block nothing (--ignore-alpha makes them solid)"
        : out.report.clear == 0                   ? " triangles, but none of them has an area"
                                : " triangles, but none of them has an area and blocks light";
    throw Error(Status::all_degenerate,
                "mesh '" + mesh.name + "' has " + std::to_string(mesh.triangles.size()) + why);
  }
  return out;
}

}  // namespace nif::mesh
