// Colours of a character: a hit has the number of a triangle of the glTF, and where in it.
#pragma once

#include <string>
#include <vector>

#include "affine.hpp"
#include "gltf.hpp"

class Look {
 public:
  /// nodes: for each instance of the asset, the nodes whose meshes it has, in the order of its triangles.
  Look(const Gltf& file, const std::vector<std::vector<size_t>>& nodes);

  /// Linear; grey if the triangle has no number.
  Float3 colour(uint32_t instance, uint32_t triangle, float u, float v) const;

 private:
  struct Picture {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> texels;  ///< [height][width][4]
  };
  struct Material {
    Float3 factor{1, 1, 1};
    int picture = -1;
  };
  struct Triangle {
    size_t material;
    float at[3][2];  ///< of each corner in the picture
  };
  void add_mesh(const Gltf& file, const nlohmann::json& mesh, std::vector<Triangle>& triangles) const;

  std::vector<Picture> pictures_;
  std::vector<Material> materials_;  ///< the last is that of triangles without one
  std::vector<std::vector<Triangle>> triangles_;
};
