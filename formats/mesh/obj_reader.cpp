// Wavefront OBJ: polygons with positive or relative indices. Each object ("o") becomes a mesh.
//
// This is our own code, because the reader of OpenMesh 9 opens any file that a "mtllib" line names, also a device,
// which blocks it for ever; skips vertices that it cannot parse, such as "nan", so that every later index refers
// to another vertex, and removes repeated corners, so that degenerate triangles disappear uncounted.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "formats/mesh/chooser.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/hole_collector.hpp"
#include "formats/mesh/obj_materials.hpp"
#include "formats/mesh/readers.hpp"
#include "formats/mesh/text_cursor.hpp"

namespace nif::mesh::detail {
namespace {

/// The triangles from `first_triangle` up to those of the next object.
struct Object {
  std::string name;
  size_t first_triangle = 0;
};

class ObjReader {
 public:
  explicit ObjReader(const Input& input)
      : input_(input), text_(input.bytes), faces_(input, all_), chooser_(input), alpha_(input) {}

  Scene read() {
    objects_.push_back({input_.stem, 0});
    while (!text_.at_end()) {
      line_start_ = text_;
      read_line(next_line());
    }
    chooser_.require_used("object, group or material");
    if (all_.positions.empty() && !saw_face_) {
      input_.fail(Status::not_a_mesh, "has no OBJ vertices or faces");
    }
    const uint64_t vertices = all_.positions.size();
    if (vertices > std::numeric_limits<uint32_t>::max()) {
      input_.fail(Status::too_large,
                  fmt::format("has {} vertices, more than 32-bit indices can address", vertices));
    }
    all_.look.complete(all_.positions.size(), all_.triangles.size());
    Scene scene;
    faces_.settle(scene, [&](uint64_t triangle) {
      // The last of those that begin there: the others have no triangles.
      const auto after = std::ranges::upper_bound(objects_, triangle, {}, &Object::first_triangle);
      return std::string_view(std::prev(after)->name);
    });
    if (alpha_.any()) {
      HoleCollector holes;
      all_.alpha = alpha_.decide(all_.triangles, holes);
      holes.finish(all_);
    }
    alpha_.report(scene);
    scene = scene_of(split(), std::move(scene));
    if (skipped_curves_ != 0) {
      scene.notes.push_back(
          {NoteKind::curves, fmt::format("{}: left out {} points, lines and free-form shapes.",
                                         input_.file.string(), skipped_curves_)});
    }
    return scene;
  }

 private:
  /// Returns a line, joined with those that follow a backslash. The backslash must be the last character,
  /// because a name may end in one and a space.
  std::string_view next_line() {
    std::string_view line = text_.rest_of_line();
    const auto goes_on = [&] { return line.ends_with('\\') && text_.ends_line(line); };
    if (!goes_on()) return line;
    joined_.clear();
    while (goes_on()) {
      line.remove_suffix(1);
      joined_.append(line).push_back(' ');
      line = text_.rest_of_line();
    }
    return joined_.append(line);
  }

  void read_line(std::string_view line) {
    TextCursor words(line);
    const std::string_view keyword = words.word();
    if (keyword == "v") {
      read_vertex(words);
    } else if (keyword == "f" || keyword == "fo") {
      read_face(words);
    } else if (keyword == "o") {
      begin_object(words.rest_of_line());
    } else if (keyword == "g" && chooser_.active()) {
      group_ = {};
      for (std::string_view name = words.word(); !name.empty(); name = words.word())
        group_ = group_ | chooser_.look_up(name);
    } else if (keyword == "usemtl" && (chooser_.active() || alpha_.any())) {
      const std::string_view name = words.rest_of_line();
      alpha_.use(name);
      if (chooser_.active()) material_ = chooser_.look_up(name);
    } else if (keyword == "vt" && alpha_.any()) {
      std::array<float, 2> place{};
      for (float& part : place)
        if (!parse_float(words.word(), part)) part = 0;
      alpha_.add_coordinates(place);
    } else if (keyword == "l" || keyword == "p" || keyword == "curv" || keyword == "curv2" ||
               keyword == "surf") {
      ++skipped_curves_;
    }
    // Everything else (normals, smoothing groups) does not affect the surface.
  }

  void read_vertex(TextCursor& words) {
    Float3 position;
    Double3 exact;
    for (size_t a = 0; a < 3; ++a) {
      const std::string_view word = words.word();
      if (!parse_float(word, position[a])) fail_word("vertex", word, "a number");
      if (input_.exact) parse_double(word, exact[a]);
    }
    all_.positions.push_back(position);  // a weight or a colour may follow
    if (input_.exact) all_.exact.push_back(exact);
    if (input_.limits.colors) read_color(words);
  }

  /// "v x y z r g b": programs that have 8-bit colours write them as sRGB.
  void read_color(TextCursor& words) {
    std::array<float, 3> color;
    for (float& c : color) {
      float value;
      if (!parse_float(words.word(), value)) return;
      c = static_cast<float>(linear_of(double(value)));
    }
    all_.look.set_color(all_.positions.size() - 1, color);
  }

  void read_face(TextCursor& words) {
    saw_face_ = true;
    corners_.clear();
    placed_.clear();
    for (std::string_view word = words.word(); !word.empty() && word[0] != '#'; word = words.word()) {
      int64_t index = 0;
      if (!parse_integer(word.substr(0, word.find('/')), index)) fail_word("face", word, "a vertex index");
      // Positive indices count from 1 and may refer to vertices that come later; negative ones count back
      // from here.
      const int64_t known = static_cast<int64_t>(all_.positions.size());
      const int64_t vertex = index > 0 ? index - 1 : known + index;
      if (index == 0 || index < -known || vertex >= std::numeric_limits<uint32_t>::max()) {
        input_.fail(Status::index_out_of_range,
                    fmt::format("the face in line {} uses vertex {}, but only {} vertices precede it",
                                line_start_.line(), index, known));
      }
      corners_.push_back(static_cast<uint32_t>(vertex));
      if (alpha_.any()) placed_.push_back({corners_.back(), coordinates_of(word)});
    }
    if (!chooser_.takes(object_ | group_ | material_)) return;
    const uint64_t first = all_.triangles.size();
    faces_.polygon(corners_);
    alpha_.add_face(placed_, first, all_.triangles.size());
  }

  /// Of a corner "vertex/coordinates/normal".
  uint32_t coordinates_of(std::string_view corner) const {
    const size_t slash = corner.find('/');
    if (slash == corner.npos) return ObjCorner::kNone;
    const std::string_view after = corner.substr(slash + 1);
    int64_t index;
    if (!parse_integer(after.substr(0, after.find('/')), index)) return ObjCorner::kNone;
    if (index < 0) index += int64_t{alpha_.coordinates()} + 1;
    return index > 0 && index <= int64_t{UINT32_MAX} ? uint32_t(index - 1) : ObjCorner::kNone;
  }

  /// An object extends to the next "o" line; each such line starts a new one, even with a repeated name.
  void begin_object(std::string_view name) {
    objects_.push_back(
        {std::string(name.empty() ? std::string_view(input_.stem) : name), all_.triangles.size()});
    object_ = chooser_.look_up(name);
  }

  std::vector<Mesh> split() {
    std::vector<Mesh> meshes;
    objects_.push_back({"", all_.triangles.size()});
    size_t used = 0;
    for (size_t i = 0; i + 1 < objects_.size(); ++i) {
      used += objects_[i].first_triangle != objects_[i + 1].first_triangle;
    }
    if (used <= 1) {
      for (size_t i = 0; i + 1 < objects_.size(); ++i) {
        if (objects_[i].first_triangle != objects_[i + 1].first_triangle) all_.name = objects_[i].name;
      }
      meshes.push_back(std::move(all_));
      return meshes;
    }
    check_range();
    local_.assign(all_.positions.size(), kNone);
    for (size_t i = 0; i + 1 < objects_.size(); ++i) {
      const size_t first = objects_[i].first_triangle, last = objects_[i + 1].first_triangle;
      if (first != last) meshes.push_back(extract(objects_[i].name, first, last));
    }
    return meshes;
  }

  /// The shared check comes too late for extract(), which looks up vertices.
  void check_range() const {
    for (size_t t = 0; t < all_.triangles.size(); ++t) {
      const uint32_t v = std::ranges::max(all_.triangles[t]);
      if (v >= all_.positions.size()) {
        input_.fail(Status::index_out_of_range,
                    fmt::format("triangle {} uses vertex {}, but there are only {}", t, uint64_t{v} + 1,
                                all_.positions.size()));
      }
    }
  }

  /// The vertices that the triangles use, in the order of the file.
  Mesh extract(const std::string& name, size_t first, size_t last) {
    Mesh mesh;
    mesh.name = name;
    mesh.triangles.assign(all_.triangles.begin() + static_cast<std::ptrdiff_t>(first),
                          all_.triangles.begin() + static_cast<std::ptrdiff_t>(last));
    if (!all_.alpha.empty())
      mesh.alpha.assign(all_.alpha.begin() + static_cast<std::ptrdiff_t>(first),
                        all_.alpha.begin() + static_cast<std::ptrdiff_t>(last));
    if (!all_.holes.empty()) {
      HoleCollector holes;
      holes.add_all(0, all_.alpha_maps, std::span(all_.holes).subspan(first, last - first));
      holes.finish(mesh);
    }
    std::vector<uint32_t> used;
    for (const Triangle& triangle : mesh.triangles) {
      for (const uint32_t v : triangle) {
        if (local_[v] == kNone) used.push_back(v);
        local_[v] = 0;
      }
    }
    std::ranges::sort(used);
    for (const uint32_t v : used) {
      local_[v] = static_cast<uint32_t>(mesh.positions.size());
      mesh.positions.push_back(all_.positions[v]);
      if (input_.exact) mesh.exact.push_back(all_.exact[v]);
      if (!all_.look.colors.empty()) mesh.look.colors.push_back(all_.look.colors[v]);
    }
    for (Triangle& triangle : mesh.triangles) {
      for (uint32_t& v : triangle) v = local_[v];
    }
    for (const uint32_t v : used) local_[v] = kNone;
    return mesh;
  }

  [[noreturn]] void fail_word(const char* what, std::string_view word, const char* wanted) const {
    const std::string found = word.empty() ? "ends" : fmt::format("has '{}'", word.substr(0, 40));
    input_.fail(Status::malformed_mesh, fmt::format("the {} in line {} {} where {} is expected", what,
                                                    line_start_.line(), found, wanted));
  }

  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  const Input& input_;
  TextCursor text_;
  TextCursor line_start_{std::string_view()};
  std::string joined_;
  Mesh all_;  // every object's triangles, in the file's common index space
  FaceSink faces_;
  Chooser chooser_;
  ObjMaterials alpha_;
  Named object_, group_, material_;  // the current ones for faces
  std::vector<Object> objects_;
  std::vector<uint32_t> corners_;
  std::vector<ObjCorner> placed_;  // the same corners, if alpha may matter
  std::vector<uint32_t> local_;    // a vertex's index within the object being extracted
  uint64_t skipped_curves_ = 0;
  bool saw_face_ = false;
};

}  // namespace

Scene read_obj(const Input& input) {
  return read_exactly(input, [](const Input& given) { return ObjReader(given).read(); });
}

}  // namespace nif::mesh::detail
