// Reading of glTF accessors with every offset, stride and count checked against the bytes that are there.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "formats/mesh/gltf_json.hpp"

namespace tinygltf {
class Model;
}

namespace nif::mesh::detail {

class GltfData {
 public:
  GltfData(const Input& input, const GltfSource& source, const tinygltf::Model& model)
      : input_(input), source_(source), model_(model) {}

  std::vector<Float3> positions(int accessor) const;  ///< of float or quantised integer components
  std::vector<uint32_t> indices(int accessor) const;
  bool normalized(int accessor) const;
  std::string_view view(int buffer_view) const;  ///< the bytes of a buffer view

 private:
  struct Layout {
    int component_type = 0;
    int components = 1;
    uint64_t count = 0;
  };
  struct Elements;

  Elements elements(int accessor, int buffer_view, uint64_t offset, uint64_t stride,
                    const Layout& layout) const;
  void apply_sparse(int accessor, std::vector<Float3>& out) const;

  const Input& input_;
  const GltfSource& source_;
  const tinygltf::Model& model_;
};

}  // namespace nif::mesh::detail
