// Builds glTF documents for tests.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::test {

/// The bytes of the values, in their order.
template <class T>
std::string raw(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// A glTF document under construction: tests may change `json` before it is written.
struct Gltf {
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
  std::string data;  ///< the first buffer, and the only one with data
  nlohmann::json more_buffers = nlohmann::json::array();

  int view(std::string_view bytes);
  int accessor(std::string_view bytes, int component_type, const char* type, size_t count);
  int positions(const std::vector<mesh::Float3>& values);
  int indices(const std::vector<uint32_t>& values);
  int indices16(const std::vector<uint16_t>& values);
  /// A mesh of one primitive; `indices` may be -1.
  int mesh(int positions, int indices, const char* name = nullptr, int mode = 4);
  int node(nlohmann::json node);
  void scene(std::vector<int> roots);
  /// Adds a node in scene 0, `carrier`, with a camera or a light by KHR_lights_punctual; returns its number.
  int camera(nlohmann::json definition, nlohmann::json carrier = nlohmann::json::object());
  int light(nlohmann::json definition, nlohmann::json carrier = nlohmann::json::object());

  std::string glb() const;
  std::string gltf(const std::string& buffer_uri) const;
  std::string embedded() const;  ///< .gltf with a data URI
};

Gltf gltf_of(const mesh::Mesh& mesh);

}  // namespace nif::test
