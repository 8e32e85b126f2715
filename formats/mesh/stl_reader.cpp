// STL, text and binary. Each solid of a text file becomes a mesh under its own name.
//
// Our own, because the reader of OpenMesh 9 welds vertices through a map that takes a NaN for equal to
// anything (a broken file then reads as a sound but wrong mesh), drops degenerate triangles uncounted, and
// believes the announced triangle count, reading zeros past the end of the file.
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <limits>

#include "formats/mesh/chooser.hpp"
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

/// Binary files may also begin with "solid". The count in their header has a zero byte, which no text has.
bool looks_like_text(std::string_view bytes) {
  return !has_binary_size(bytes) && same_word(TextCursor(bytes).word(), "solid") &&
         bytes.substr(0, kHeader).find('\0') == std::string_view::npos;
}

void add_corner_positions(Mesh& mesh, const std::array<Float3, 3>& corners) {
  const uint32_t first = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
}

std::vector<Mesh> read_binary(const Input& input) {
  refuse_choice(input);
  if (input.bytes.size() < kHeader) {
    input.fail(Status::file_truncated, fmt::format("has {} bytes, fewer than the {} of a binary STL header",
                                                   input.bytes.size(), kHeader));
  }
  const uint64_t count = announced_triangles(input.bytes);
  if ((input.bytes.size() - kHeader) / kRecord < count) {
    input.fail(Status::file_truncated,
               fmt::format("announces {} triangles, which take {} bytes, but the file ends at byte {}", count,
                           kHeader + kRecord * count, input.bytes.size()));
  }
  check_triangle_limit(input, count);
  if (count > std::numeric_limits<uint32_t>::max() / 3) {
    input.fail(Status::too_large,
               fmt::format("has {} triangles, more than 32-bit indices can address", count));
  }
  Mesh mesh;
  mesh.name = input.stem;
  mesh.positions.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (uint64_t t = 0; t < count; ++t) {
    std::array<Float3, 3> corners;
    std::memcpy(&corners, input.bytes.data() + kHeader + kRecord * t + sizeof(Float3), sizeof corners);
    add_corner_positions(mesh, corners);
  }
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
      } else if (same_word(word, "endsolid")) {
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
      for (float& x : corner) {
        const std::string_view word = words_.word();
        if (word.empty()) fail_truncated();
        if (!parse_float(word, x)) fail(word, "a number");
      }
    }
    expect("endloop");
    expect("endfacet");
    // One index space for all solids keeps this simple; 32 bits end at 1.4 billion triangles.
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
  bool taken_ = true;  // the solid that is open
};

}  // namespace

bool looks_like_stl(std::string_view bytes) {
  return has_binary_size(bytes) || same_word(TextCursor(bytes.substr(0, kHeader)).word(), "solid");
}

Scene read_stl(const Input& input) {
  if (looks_like_text(input.bytes)) return scene_of(TextReader(input).read());
  // A text of another kind would pass for a binary file that announces an absurd number of triangles.
  if (input.bytes.size() > kHeader && !has_binary_size(input.bytes) &&
      input.bytes.substr(0, kHeader).find('\0') == std::string_view::npos) {
    input.fail(Status::not_a_mesh,
               "is named .stl but is neither a binary STL file nor a text that starts with 'solid'");
  }
  Scene scene = scene_of(read_binary(input));
  const uint64_t counted = kHeader + kRecord * announced_triangles(input.bytes);
  if (input.bytes.size() - counted >= kRecord)
    scene.notes.push_back(
        {NoteKind::bytes_after_end,
         fmt::format(
             "{}: {} bytes follow the {} triangles that its header counts, and were left out; files that "
             "were joined read like this.",
             input.file.string(), input.bytes.size() - counted, announced_triangles(input.bytes))});
  return scene;
}

}  // namespace nif::mesh::detail
