// Reads line by line and needs no library. Numbers go through std::from_chars, which ignores the locale.
// Errors name the line.
#include "obj.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string_view>

namespace {

/// Takes the next word from a line; empty if there is none.
std::string_view take_word(std::string_view& line) {
  const size_t begin = std::min(line.find_first_not_of(" \t\r"), line.size());
  const size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

float to_coordinate(std::string_view word) {
  float value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
    throw std::runtime_error("'" + std::string(word) + "' is not a coordinate");
  return value;
}

/// "7", "7/1", "7//3", or "-1" for the latest vertex.
uint32_t to_index(std::string_view word, size_t vertices) {
  const std::string_view number = word.substr(0, word.find('/'));
  int64_t index = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), index);
  const auto count = int64_t(vertices);
  if (error != std::errc() || end != number.data() + number.size() || index == 0 || index > count ||
      index < -count)
    throw std::runtime_error("'" + std::string(word) + "' is not the number of an earlier vertex");
  return uint32_t(index > 0 ? index - 1 : count + index);
}

void read_line(std::string_view line, Mesh& mesh) {
  const std::string_view kind = take_word(line);
  if (kind == "v") {
    std::array<float, 3> position;
    for (float& coordinate : position) coordinate = to_coordinate(take_word(line));
    mesh.positions.push_back(position);
  } else if (kind == "f") {
    std::array<uint32_t, 3> triangle{};
    size_t corners = 0;
    for (std::string_view word; !(word = take_word(line)).empty(); ++corners) {
      const uint32_t index = to_index(word, mesh.positions.size());
      if (corners == 0) triangle[0] = index;
      triangle[1] = triangle[2];
      triangle[2] = index;
      if (corners >= 2) mesh.triangles.push_back(triangle);
    }
  }
}

}  // namespace

Mesh read_obj(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
  Mesh mesh;
  std::string line;
  for (size_t number = 1; std::getline(file, line); ++number) {
    try {
      read_line(line, mesh);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path + ", line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (file.bad()) throw std::runtime_error(path + ": cannot be read");
  if (mesh.triangles.empty()) throw std::runtime_error(path + ": not an OBJ file, or one without faces");
  mesh.low = mesh.high = mesh.positions[mesh.triangles[0][0]];
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t corner : triangle) {
      for (size_t a = 0; a < 3; ++a) {
        mesh.low[a] = std::min(mesh.low[a], mesh.positions[corner][a]);
        mesh.high[a] = std::max(mesh.high[a], mesh.positions[corner][a]);
      }
    }
  }
  return mesh;
}
