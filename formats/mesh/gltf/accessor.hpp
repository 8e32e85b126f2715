// Reads glTF accessors and checks every offset, stride and count against the available bytes.
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/gltf/gltf_hierarchy.hpp"
#include "formats/mesh/gltf/json.hpp"

namespace tinygltf {
class Model;
class Value;
}  // namespace tinygltf

namespace nif::mesh::detail {

/// The structure of a file: GltfSource::json. Throws malformed_mesh.
tinygltf::Model parse_model(const Input& input, const std::string& json);

/// A member of a value of any type; a null value if there is none. (Value::Get() requires an object.)
const tinygltf::Value& member_of(const tinygltf::Value& value, const char* name);

/// Not thread-safe, because it caches decoded data.
class GltfData {
 public:
  GltfData(const Input& input, const GltfSource& source, const tinygltf::Model& model)
      : input_(input), source_(source), model_(model) {}

  // Elements of accessors, also of sparse ones; without a buffer view they are zero. `most`: reads at most
  // this many, for accessors that may have more elements than are used.
  std::vector<Float3> positions(int accessor) const;  ///< with float or quantised integer components
  std::vector<Float3> colors(int accessor, uint64_t most) const;  ///< from a vertex attribute, without alpha
  std::vector<float> alphas(int accessor, uint64_t most) const;   ///< of colours that have alpha, from 0 to 1
  std::vector<std::array<float, 2>> coordinates(int accessor, uint64_t most) const;  ///< texture coordinates
  std::vector<std::array<float, 4>> rotations(int accessor) const;                   ///< unit quaternions
  std::vector<std::array<uint16_t, 4>> joints(int accessor) const;
  std::vector<std::array<float, 4>> weights(int accessor) const;
  std::vector<uint32_t> indices(int accessor) const;
  /// Of animations: `components` numbers of each key, one, three or four.
  std::vector<float> keys(int accessor, int components) const;
  std::vector<Affine> matrices(int accessor, uint64_t most) const;  ///< 4x4 floats, without the last row

  uint64_t count(int accessor) const;
  bool normalized(int accessor) const;
  bool has_alpha(int accessor) const;            ///< for colours: whether they have four components
  std::string_view view(int buffer_view) const;  ///< the bytes of a buffer view

 private:
  struct Layout {
    int component_type = 0;
    int components = 1;
    uint64_t count = 0;
  };
  struct Elements;

  std::string_view span(const std::string& what, int buffer, uint64_t offset, uint64_t length) const;
  std::string_view decoded(int buffer_view, const tinygltf::Value& extension) const;
  uint64_t stride_of(int buffer_view) const;  ///< 0 if it states none
  Elements elements(int accessor, int buffer_view, uint64_t offset, uint64_t stride,
                    const Layout& layout) const;
  /// The elements of an accessor with this number of components each; `load` makes an element from its bytes.
  template <class T, class Load>
  std::vector<T> load_all(int accessor, int components, const char* what, uint64_t most, Load&& load) const;
  template <class T, class Load>
  void apply_sparse(int accessor, int components, std::vector<T>& out, Load&& load) const;
  /// The first kCount of this number of components of each element.
  template <size_t kCount>
  std::vector<std::array<float, kCount>> numbers(int accessor, int components, const char* what,
                                                 uint64_t most) const;
  [[noreturn]] void fail_type(int accessor, const char* what) const;

  const Input& input_;
  const GltfSource& source_;
  const tinygltf::Model& model_;
  mutable std::map<int, std::string> decoded_;  // buffer views that were compressed
  mutable uint64_t decoded_bytes_ = 0;
  // elements of accessors without a buffer view, counted each time they are read
  mutable uint64_t zeros_ = 0;
};

}  // namespace nif::mesh::detail
