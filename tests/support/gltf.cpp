// Builds glTF files without any code of the reader under test.
#include "tests/support/gltf.hpp"

#include <cstring>

namespace nif::test {
namespace {

void put(std::string& out, uint32_t value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (size_t k = 0; k < 4; ++k) {
      out.push_back(i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=');
    }
  }
  return out;
}

nlohmann::json buffers_of(nlohmann::json first, const nlohmann::json& others) {
  nlohmann::json buffers = nlohmann::json::array({std::move(first)});
  buffers.insert(buffers.end(), others.begin(), others.end());
  return buffers;
}

}  // namespace

int Gltf::view(std::string_view bytes) {
  data.resize((data.size() + 3) / 4 * 4);
  json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", data.size()}, {"byteLength", bytes.size()}});
  data += bytes;
  return static_cast<int>(json["bufferViews"].size()) - 1;
}

int Gltf::accessor(std::string_view bytes, int component_type, const char* type, size_t count) {
  json["accessors"].push_back(
      {{"bufferView", view(bytes)}, {"componentType", component_type}, {"type", type}, {"count", count}});
  return static_cast<int>(json["accessors"].size()) - 1;
}

int Gltf::positions(const std::vector<mesh::Float3>& values) {
  return accessor(raw(values), 5126, "VEC3", values.size());
}
int Gltf::indices(const std::vector<uint32_t>& values) {
  return accessor(raw(values), 5125, "SCALAR", values.size());
}
int Gltf::indices16(const std::vector<uint16_t>& values) {
  return accessor(raw(values), 5123, "SCALAR", values.size());
}

int Gltf::mesh(int positions, int indices, const char* name, int mode) {
  nlohmann::json primitive = {{"attributes", {{"POSITION", positions}}}, {"mode", mode}};
  if (indices >= 0) primitive["indices"] = indices;
  nlohmann::json mesh = {{"primitives", nlohmann::json::array({primitive})}};
  if (name != nullptr) mesh["name"] = name;
  json["meshes"].push_back(mesh);
  return static_cast<int>(json["meshes"].size()) - 1;
}

int Gltf::node(nlohmann::json node) {
  json["nodes"].push_back(std::move(node));
  return static_cast<int>(json["nodes"].size()) - 1;
}

void Gltf::scene(std::vector<int> roots) {
  json["scenes"].push_back({{"nodes", roots}});
  json["scene"] = json["scenes"].size() - 1;
}

int Gltf::camera(nlohmann::json definition, nlohmann::json carrier) {
  carrier["camera"] = json["cameras"].size();
  json["cameras"].push_back(std::move(definition));
  json["scenes"][0]["nodes"].push_back(node(std::move(carrier)));
  return json["scenes"][0]["nodes"].back();
}

int Gltf::light(nlohmann::json definition, nlohmann::json carrier) {
  nlohmann::json& lights = json["extensions"]["KHR_lights_punctual"]["lights"];
  carrier["extensions"]["KHR_lights_punctual"]["light"] = lights.size();
  lights.push_back(std::move(definition));
  json["scenes"][0]["nodes"].push_back(node(std::move(carrier)));
  return json["scenes"][0]["nodes"].back();
}

std::string Gltf::glb() const {
  nlohmann::json document = json;
  document["buffers"] = buffers_of({{"byteLength", data.size()}}, more_buffers);
  std::string text = document.dump(), binary = data;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4);
  std::string out = "glTF";
  put(out, 2);
  put(out, static_cast<uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  put(out, static_cast<uint32_t>(text.size()));
  out += "JSON" + text;
  put(out, static_cast<uint32_t>(binary.size()));
  out += std::string_view("BIN\0", 4);
  return out + binary;
}

std::string Gltf::gltf(const std::string& buffer_uri) const {
  nlohmann::json document = json;
  document["buffers"] = buffers_of({{"byteLength", data.size()}, {"uri", buffer_uri}}, more_buffers);
  return document.dump(1);
}

std::string Gltf::embedded() const { return gltf("data:application/octet-stream;base64," + base64(data)); }

Gltf gltf_of(const mesh::Mesh& mesh) {
  Gltf out;
  std::vector<uint32_t> flat;
  for (const auto& t : mesh.triangles) flat.insert(flat.end(), t.begin(), t.end());
  const int positions = out.positions(mesh.positions), indices = out.indices(flat);
  out.scene({out.node({{"mesh", out.mesh(positions, indices, mesh.name.c_str())}})});
  return out;
}

}  // namespace nif::test
