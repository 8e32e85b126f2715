// Reads what the materials of an OBJ (.mtl) say about alpha, and decides with it for the faces. Internal to formats/mesh.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/image.hpp"
#include "formats/mesh/material_alpha.hpp"

namespace nif::mesh::detail {

/// A corner of a face, counted from 0.
struct ObjCorner {
  uint32_t vertex;
  uint32_t coordinates;  ///< kNone: it has none

  static constexpr uint32_t kNone = 0xffffffff;
};

class ObjMaterials {
 public:
  /// Reads the libraries that lines of the file name, if alpha is to be read.
  explicit ObjMaterials(const Input& input);

  /// Whether any material may let light through. Otherwise none of what follows need be called.
  bool any() const { return !materials_.empty(); }

  void use(std::string_view material);                      ///< "usemtl"
  void add_coordinates(const std::array<float, 2>& place);  ///< "vt"
  uint32_t coordinates() const { return uint32_t(places_.size()); }
  /// A face of the current material becomes the triangles from `first` up to `end`. They use its vertices, but may
  /// be put together otherwise later.
  void add_face(std::span<const ObjCorner> corners, uint64_t first, uint64_t end);

  /// Decides for all triangles, and collects their holes. The result has one for each, or none if all are solid.
  std::vector<TriangleAlpha> decide(std::span<const Triangle> triangles, HoleCollector& holes);

  /// Adds to the scene what was read and what became of it.
  void report(Scene& scene) const;

 private:
  struct Material {
    std::string name;
    double opacity = 1;        ///< "d", or else 1 less "Tr"
    bool has_opacity = false;  ///< "d"
    std::string picture{};     ///< "map_d": a file name; empty: none
    std::string unknown{};     ///< an option of it that changes the picture, and is not known; empty: none
    bool clamps = false;       ///< "-clamp on"
    std::array<double, 2> scale{1, 1}, offset{0, 0};  ///< "-s", "-o"
  };
  /// A face and its corners, in corners_.
  struct Face {
    uint64_t first_triangle, end_triangle;
    size_t first_corner, end_corner;
    size_t material;
  };

  std::optional<ByteBuffer> load(std::string_view name);
  void read_libraries(std::string_view line);
  bool read_library(std::string_view name);
  void read_material_line(std::string_view line, std::optional<Material>& current);
  static void read_map(std::string_view words, Material& material);
  void keep(std::optional<Material>& material);
  AlphaTest test_of(size_t material);
  /// Where a triangle of a face is in the picture.
  struct Placed {
    AlphaTest::Corners corners{};
    bool everywhere = true;  ///< otherwise some corner has no place, and the picture does not count
    bool ambiguous = false;  ///< some corner has several
  };
  Placed place(const Face& face, const Triangle& triangle, const AlphaPicture& picture) const;
  TriangleAlpha decide_one(const Face& face, const AlphaTest& test, const Triangle& triangle, size_t number,
                           HoleCollector& holes);

  const Input& input_;
  std::vector<Material> materials_;                                    ///< those that may let light through
  std::map<std::string, std::optional<size_t>, std::less<>> numbers_;  ///< of all; the solid ones have none
  std::optional<size_t> current_;
  std::vector<std::array<float, 2>> places_;
  std::vector<Face> faces_;
  std::vector<ObjCorner> corners_;
  std::map<std::string, ReadPicture> pictures_;
  uint64_t bytes_, texels_ = kMostTexels;  ///< that may still be read
  uint64_t steps_ = AlphaPicture::kMostSteps;
  HoleMaker holes_;
  std::map<std::string, bool> libraries_;  ///< that were tried: whether they can be read
  std::set<std::string> files_;
  std::set<std::string> missing_;  ///< libraries that cannot be read
  AlphaReport report_;
};

}  // namespace nif::mesh::detail
