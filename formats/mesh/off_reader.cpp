// OFF text files. Normals, colours and texture coordinates (NOFF, COFF, STOFF) are skipped.
//
// This is our own code, because the reader of OpenMesh 9, given a stream, never looks at the header: it uses
// the flags of the previous file. It does not support comments, takes a face's colour for the next face, and
// loops over the announced number of faces whether or not the file continues.
#include <fmt/format.h>

#include <limits>

#include "formats/mesh/chooser.hpp"
#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/readers.hpp"
#include "formats/mesh/text_cursor.hpp"

namespace nif::mesh::detail {
namespace {

class OffReader {
 public:
  explicit OffReader(const Input& input) : input_(input), words_(input.bytes), faces_(input, mesh_) {}

  Scene read() {
    read_keyword();
    const uint64_t vertices = read_count("the number of vertices");
    const uint64_t faces = read_count("the number of faces");
    words_.rest_of_line();  // the number of edges, which is not reliable
    // A vertex takes at least three digits and three spaces, a face a digit and a line end.
    if (vertices > words_.bytes_left() / 5 || faces > words_.bytes_left() / 2 + 1) {
      input_.fail(Status::file_truncated,
                  fmt::format("announces {} vertices and {} faces, but {} bytes follow", vertices, faces,
                              words_.bytes_left()));
    }
    if (vertices > std::numeric_limits<uint32_t>::max()) {
      input_.fail(Status::too_large,
                  fmt::format("has {} vertices, more than 32-bit indices can address", vertices));
    }
    mesh_.name = input_.stem;
    mesh_.positions.reserve(vertices);
    mesh_.triangles.reserve(faces);
    for (uint64_t i = 0; i < vertices; ++i) read_vertex(i);
    for (uint64_t i = 0; i < faces; ++i) read_face(i, vertices);

    Scene scene;
    faces_.settle(scene, [&](uint64_t) { return std::string_view(mesh_.name); });
    std::vector<Mesh> meshes;
    meshes.push_back(std::move(mesh_));
    return scene_of(std::move(meshes), std::move(scene));
  }

 private:
  void read_keyword() {
    const std::string_view keyword = next("the keyword 'OFF'");
    std::string_view rest = keyword;
    for (const std::string_view flag : {"ST", "C", "N"}) {
      if (rest.starts_with(flag)) rest.remove_prefix(flag.size());
    }
    if (rest == "4OFF" || rest == "nOFF" || rest == "4nOFF") {
      input_.fail(Status::not_a_mesh, fmt::format("is a {} file, whose vertices are not 3D points", keyword));
    }
    int64_t count = 0;
    if (parse_integer(keyword, count)) {
      pending_ = keyword;  // the keyword is optional
    } else if (rest != "OFF") {
      input_.fail(Status::not_a_mesh, "is taken for OFF, but does not start with 'OFF'");
    }
  }

  uint64_t read_count(const char* what) {
    const std::string_view word = next(what);
    if (word == "BINARY")
      input_.fail(Status::not_a_mesh, "is a binary OFF file; only text OFF files are read");
    int64_t value = 0;
    if (!parse_integer(word, value) || value < 0) fail_word(word, what);
    return static_cast<uint64_t>(value);
  }

  void read_vertex(uint64_t index) {
    Float3 position;
    Double3 exact;
    for (size_t a = 0; a < 3; ++a) {
      const std::string_view word = next("a vertex");
      if (!parse_float(word, position[a])) fail_word(word, fmt::format("a coordinate of vertex {}", index));
      if (input_.exact) parse_double(word, exact[a]);
    }
    mesh_.positions.push_back(position);
    if (input_.exact) mesh_.exact.push_back(exact);
    words_.rest_of_line();
  }

  void read_face(uint64_t index, uint64_t vertices) {
    const std::string_view word = next("a face");
    int64_t count = 0;
    if (!parse_integer(word, count) || count < 0)
      fail_word(word, fmt::format("the corner count of face {}", index));
    corners_.clear();
    for (; count > 0; --count) {
      const std::string_view corner = next("a face");
      int64_t v = 0;
      if (!parse_integer(corner, v)) fail_word(corner, fmt::format("a vertex index of face {}", index));
      if (v < 0 || static_cast<uint64_t>(v) >= vertices) {
        input_.fail(Status::index_out_of_range,
                    fmt::format("face {} in line {} uses vertex {}, but there are only {}", index,
                                words_.line(), v, vertices));
      }
      corners_.push_back(static_cast<uint32_t>(v));
    }
    faces_.polygon(corners_);
    words_.rest_of_line();
  }

  /// The next word outside of comments.
  std::string_view next(const char* wanted) {
    if (!pending_.empty()) return std::exchange(pending_, {});
    for (;;) {
      const std::string_view word = words_.word();
      if (word.empty()) {
        input_.fail(Status::file_truncated, fmt::format("ends in line {}, before {}", words_.line(), wanted));
      }
      if (word[0] != '#') return word;
      words_.rest_of_line();
    }
  }

  [[noreturn]] void fail_word(std::string_view word, const std::string& wanted) const {
    if (words_.at_end()) {
      input_.fail(Status::file_truncated, fmt::format("ends in line {}, within {}", words_.line(), wanted));
    }
    input_.fail(Status::malformed_mesh, fmt::format("line {} has '{}' where {} is expected", words_.line(),
                                                    word.substr(0, 40), wanted));
  }

  const Input& input_;
  TextCursor words_;
  Mesh mesh_;
  FaceSink faces_;
  std::vector<uint32_t> corners_;
  std::string_view pending_;
};

}  // namespace

Scene read_off(const Input& input) {
  refuse_choice(input);
  return read_exactly(input, [](const Input& given) { return OffReader(given).read(); });
}

}  // namespace nif::mesh::detail
