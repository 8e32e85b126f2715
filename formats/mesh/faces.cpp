// Turns the faces of a file into triangles. They are fans at first, because an OBJ may refer to vertices that
// come later; then polygons are triangulated properly.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "formats/base/vector.hpp"
#include "formats/mesh/polygon.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

/// Counts polygons that deserve a note, by object.
class Tally {
 public:
  void add(std::string_view name) {
    ++count_;
    if (parts_.empty() || parts_.back().name.data() != name.data()) parts_.push_back({name, 0});
    ++parts_.back().count;
  }

  bool empty() const { return count_ == 0; }
  bool one() const { return count_ == 1; }

  /// "3 polygons of 'wall' (2) and 'roof' (1)"
  std::string text() const {
    constexpr size_t kNameBytes = 128;
    std::string out = fmt::format("{} polygon{} of ", count_, count_ == 1 ? "" : "s");
    for (size_t i = 0; i < std::min(kMostNotes, parts_.size()); ++i) {
      if (i > 0) out += i + 1 == parts_.size() ? " and " : ", ";
      out += fmt::format("'{}'", clean_name(parts_[i].name.substr(0, kNameBytes)));
      if (parts_.size() > 1) out += fmt::format(" ({})", parts_[i].count);
    }
    if (parts_.size() > kMostNotes) out += fmt::format(" and {} more objects", parts_.size() - kMostNotes);
    return out;
  }

 private:
  struct Part {
    std::string_view name;
    uint64_t count;
  };
  std::vector<Part> parts_;
  uint64_t count_ = 0;
};

/// Triangulates a polygon of a mesh that may be far from the origin, where rounding may move corners relative
/// to each other. So it is done relative to the smallest corner, in double.
PolygonCutter::Found cut_exactly(PolygonCutter& cutter, const Mesh& mesh, std::span<Triangle> fan) {
  std::vector<uint32_t> corners;
  for (const Triangle& t : fan) corners.insert(corners.end(), t.begin(), t.end());
  std::ranges::sort(corners);
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  Double3 origin = mesh.exact[corners.front()];
  for (const uint32_t v : corners) origin = std::min(origin, mesh.exact[v]);
  std::vector<Float3> positions;
  for (const uint32_t v : corners) positions.push_back(to_float(mesh.exact[v] - origin));
  for (Triangle& t : fan)
    for (uint32_t& v : t) v = uint32_t(std::ranges::lower_bound(corners, v) - corners.begin());
  const PolygonCutter::Found found = cutter.cut(positions, fan);
  for (Triangle& t : fan)
    for (uint32_t& v : t) v = corners[v];
  return found;
}

}  // namespace

void FaceSink::fan(std::span<const uint32_t> corners) {
  if (corners.size() < 3) {
    ++skipped_;
    return;
  }
  check_triangle_limit(input_, mesh_.triangles.size() + corners.size() - 2);
  remember(corners.size());
  for (size_t i = 2; i < corners.size(); ++i)
    mesh_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

void FaceSink::remember(size_t corners) {
  if (corners > std::numeric_limits<uint32_t>::max())
    input_.fail(Status::too_large, fmt::format("has a polygon of {} corners", corners));
  const uint64_t at = mesh_.triangles.size();
  if (!runs_.empty()) {
    Run& run = runs_.back();
    if (run.corners == corners && run.first_triangle + uint64_t{run.count} * (corners - 2) == at &&
        run.count != std::numeric_limits<uint32_t>::max()) {
      ++run.count;
      return;
    }
  }
  runs_.push_back({at, uint32_t(corners), 1});
}

void FaceSink::settle(Scene& scene, const std::function<std::string_view(uint64_t triangle)>& name_of) {
  PolygonCutter cutter;
  Tally crossing, bent;
  const auto is_known = [&](const Triangle& t) { return std::ranges::max(t) < mesh_.positions.size(); };
  for (const Run& run : runs_) {
    const size_t each = run.corners - 2;
    const std::span<Triangle> all = std::span(mesh_.triangles).subspan(run.first_triangle, run.count * each);
    for (size_t first = 0; first < all.size(); first += each) {
      const std::span<Triangle> fan = all.subspan(first, each);
      if (!std::ranges::all_of(fan, is_known)) continue;  // check() reports it
      const PolygonCutter::Found found =
          input_.exact ? cut_exactly(cutter, mesh_, fan) : cutter.cut(mesh_.positions, fan);
      if (found.crosses) crossing.add(name_of(run.first_triangle + first));
      if (found.bent) bent.add(name_of(run.first_triangle + first));
    }
  }
  const std::string file = input_.file.string();
  if (skipped_ != 0)
    scene.notes.push_back(
        {NoteKind::short_faces,
         fmt::format("{}: left out {} faces with fewer than three corners", file, skipped_)});
  if (!crossing.empty())
    scene.notes.push_back(
        {NoteKind::crossing_polygons,
         crossing.one()
             ? fmt::format(
                   "{}: the outline of {} crosses itself; some of its triangles may lie outside of it", file,
                   crossing.text())
             : fmt::format("{}: the outlines of {} cross themselves; some of their triangles may lie outside "
                           "of them",
                           file, crossing.text())});
  if (!bent.empty())
    scene.notes.push_back(
        {NoteKind::bent_polygons,
         fmt::format("{}: {} {} far from flat, and cut into triangles as seen along the mean normal", file,
                     bent.text(), bent.one() ? "is" : "are")});
}

}  // namespace nif::mesh::detail
