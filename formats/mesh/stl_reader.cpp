// STL, text and binary. Each solid of a text file becomes a mesh with its name.
//
// This is our own code, because the reader of OpenMesh 9 welds vertices through a map that considers a NaN
// equal to anything (so a broken file reads as a sound but wrong mesh), drops degenerate triangles uncounted,
// and trusts the announced number of triangles, reading zeros past the end of the file.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "formats/mesh/chooser.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/readers.hpp"
#include "formats/mesh/text_cursor.hpp"

namespace nif::mesh::detail {
namespace {

constexpr size_t kHeader = 84;  // 80 bytes of anything, then the number of triangles
constexpr size_t kRecord = 50;  // normal, three vertices, two bytes of attributes

uint64_t announced_triangles(std::string_view bytes) {
  uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  return count;
}

bool has_binary_size(std::string_view bytes) {
  return bytes.size() >= kHeader && bytes.size() == kHeader + kRecord * announced_triangles(bytes);
}

/// Binary files may also begin with "solid". The count in their header contains a zero byte, which texts do
/// not.
bool looks_like_text(std::string_view bytes) {
  return !has_binary_size(bytes) && same_word(TextCursor(bytes).word(), "solid") &&
         bytes.substr(0, kHeader).find('\0') == std::string_view::npos;
}

void add_corner_positions(Mesh& mesh, const std::array<Float3, 3>& corners) {
  const uint32_t first = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
}

/// The corners of a triangle.
std::array<Float3, 3> corners_at(std::string_view bytes, uint64_t triangle) {
  std::array<Float3, 3> corners;
  std::memcpy(&corners, bytes.data() + kHeader + kRecord * triangle + sizeof(Float3), sizeof corners);
  return corners;
}

/// Number of triangles of a binary file. A program that writes to a pipe cannot go back to count them: then
/// everything up to the end is triangles, and likewise if the header counts too few. `notes` get a sentence.
uint64_t count_triangles(const Input& input, std::vector<Note>& notes) {
  const std::string_view bytes = input.bytes;
  if (bytes.size() < kHeader) {
    input.fail(Status::file_truncated,
               fmt::format("has {} bytes, fewer than the {} of a binary STL header", bytes.size(), kHeader));
  }
  const uint64_t announced = announced_triangles(bytes), all = (bytes.size() - kHeader) / kRecord;
  if (all < announced) {
    input.fail(Status::file_truncated,
               fmt::format("announces {} triangles, which take {} bytes, but the file ends at byte {}",
                           announced, kHeader + kRecord * announced, bytes.size()));
  }
  const uint64_t after = bytes.size() - kHeader - kRecord * announced;
  const bool whole = after % kRecord == 0;
  if (announced == 0 && after != 0 && !whole)
    input.fail(Status::no_triangles,
               fmt::format("has no triangles: its header counts none, and the {} bytes that follow are not "
                           "a multiple of a triangle's {} bytes",
                           after, kRecord));
  if (after < kRecord) return announced;
  const auto is_finite = [&](uint64_t t) {
    for (const Float3& corner : corners_at(bytes, t))
      for (const float x : corner)
        if (!std::isfinite(x)) return false;
    return true;
  };
  bool triangles = whole;
  for (uint64_t t = announced; t < all && triangles; ++t) triangles = is_finite(t);
  if (triangles) {
    notes.push_back(
        {NoteKind::counted_by_length,
         fmt::format("{}: its header counts {} triangles, but {} follow to its end; all were read",
                     input.file.string(), announced, all)});
    return all;
  }
  notes.push_back({NoteKind::bytes_after_end,
                   fmt::format("{}: {} bytes follow the {} triangles that its header counts, and were left "
                               "out; concatenated files look like this.",
                               input.file.string(), after, announced)});
  return announced;
}

std::vector<Mesh> read_binary(const Input& input, uint64_t count) {
  check_triangle_limit(input, count);
  if (count > std::numeric_limits<uint32_t>::max() / 3) {
    input.fail(Status::too_large,
               fmt::format("has {} triangles, more than 32-bit indices can address", count));
  }
  Mesh mesh;
  mesh.name = input.stem;
  mesh.positions.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (uint64_t t = 0; t < count; ++t) add_corner_positions(mesh, corners_at(input.bytes, t));
  std::vector<Mesh> meshes;
  meshes.push_back(std::move(mesh));
  return meshes;
}

class TextReader {
 public:
  explicit TextReader(const Input& input) : input_(input), words_(input.bytes), chooser_(input) {}

  std::vector<Mesh> read() {
    for (std::string_view word = words_.word(); !word.empty(); word = words_.word()) {
      if (same_word(word, "solid")) {
        begin_solid();
      } else if (is_end(word, "endsolid")) {
        words_.rest_of_line();
        open_ = false;
      } else if (same_word(word, "facet") && open_) {
        words_.rest_of_line();  // the normal, which follows from the corners
        read_facet();
      } else {
        fail(word, open_ ? "'facet' or 'endsolid'" : "'solid'");
      }
    }
    if (open_) fail_truncated();
    chooser_.require_used("solid");
    return std::move(meshes_);
  }

 private:
  void begin_solid() {
    if (open_) fail("solid", "'endsolid'");
    open_ = true;
    const std::string_view name = words_.rest_of_line();
    meshes_.emplace_back().name = name.empty() ? input_.stem : name;
    taken_ = chooser_.takes(chooser_.look_up(name));
  }

  void read_facet() {
    expect("outer");
    expect("loop");
    std::array<Float3, 3> corners;
    for (Float3& corner : corners) {
      expect("vertex");
      Double3 exact;
      for (size_t a = 0; a < 3; ++a) {
        const std::string_view word = words_.word();
        if (word.empty()) fail_truncated();
        if (!parse_float(word, corner[a])) fail(word, "a number");
        if (input_.exact) parse_double(word, exact[a]);
      }
      if (input_.exact && taken_) meshes_.back().exact.push_back(exact);
    }
    expect_end("endloop");
    expect_end("endfacet");
    // One index space for all solids keeps this simple; 32 bits suffice for 1.4 billion triangles.
    check_triangle_limit(input_, ++triangles_);
    if (triangles_ > std::numeric_limits<uint32_t>::max() / 3) {
      input_.fail(Status::too_large, "has more triangles than 32-bit indices can address");
    }
    if (taken_) add_corner_positions(meshes_.back(), corners);
  }

  void expect(std::string_view keyword) {
    const std::string_view word = words_.word();
    if (word.empty()) fail_truncated();
    if (!same_word(word, keyword)) fail(word, fmt::format("'{}'", keyword));
  }

  /// Some programs write "end loop" for "endloop".
  bool is_end(std::string_view word, std::string_view keyword) {
    if (!same_word(word, "end")) return same_word(word, keyword);
    const TextCursor before = words_;
    if (same_word(words_.word(), keyword.substr(3))) return true;
    words_ = before;
    return false;
  }

  void expect_end(std::string_view keyword) {
    const std::string_view word = words_.word();
    if (word.empty()) fail_truncated();
    if (!is_end(word, keyword)) fail(word, fmt::format("'{}'", keyword));
  }

  [[noreturn]] void fail(std::string_view word, const std::string& wanted) const {
    if (words_.at_end() && open_) fail_truncated();  // within a word
    const Status status = meshes_.empty() ? Status::not_a_mesh : Status::malformed_mesh;
    input_.fail(status, fmt::format("line {} of the STL text has '{}' where {} is expected", words_.line(),
                                    word.substr(0, 40), wanted));
  }
  [[noreturn]] void fail_truncated() const {
    input_.fail(Status::file_truncated,
                fmt::format("the STL text ends in line {}, before 'endsolid'", words_.line()));
  }

  const Input& input_;
  TextCursor words_;
  std::vector<Mesh> meshes_;
  uint64_t triangles_ = 0;
  bool open_ = false;
  Chooser chooser_;
  bool taken_ = true;  // whether the current solid is chosen
};

}  // namespace

bool looks_like_stl(std::string_view bytes) {
  return has_binary_size(bytes) || same_word(TextCursor(bytes.substr(0, kHeader)).word(), "solid");
}

Scene read_stl(const Input& input) {
  if (looks_like_text(input.bytes))
    return read_exactly(input, [](const Input& given) { return scene_of(TextReader(given).read()); });
  // Other text would pass for a binary file that announces an absurd number of triangles.
  if (input.bytes.size() > kHeader && !has_binary_size(input.bytes) &&
      input.bytes.substr(0, kHeader).find('\0') == std::string_view::npos) {
    input.fail(Status::not_a_mesh,
               "is taken for STL, but is neither a binary STL file nor a text that starts with 'solid'");
  }
  refuse_choice(input);
  Scene scene;
  const uint64_t count = count_triangles(input, scene.notes);
  return scene_of(read_binary(input, count), std::move(scene));
}

}  // namespace nif::mesh::detail
