// The trees as a game's file has them: triangles with pictures of leaves, placed many times. Embree needs all of this; the
// asset has its own copy of what rays need.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

using Float3 = std::array<float, 3>;
using Transform = std::array<float, 12>;  // rows of a 3 x 4 matrix

/// Where a picture blocks light: one bit for each texel, as the asset has it, so that Embree's side needs no more than that.
struct Mask {
  uint32_t width = 0, height = 0;
  std::vector<uint8_t> bits;  // [height * width / 8, rounded up], row by row from the top

  /// The texel at texture coordinates, which repeat.
  bool blocks(float u, float v) const;
};

struct Part {
  std::vector<Float3> positions;
  std::vector<std::array<float, 2>> places;  // [positions], texture coordinates
  std::vector<std::array<uint32_t, 3>> triangles;
  int mask = -1;  // index into Trees::masks; -1: it blocks everywhere
};

struct Model {
  std::string name;
  std::vector<Part> parts;  // one for each material
};

struct Placed {
  uint32_t model;
  Transform transform;
};

struct Trees {
  std::vector<Mask> masks;
  std::vector<Model> models;
  std::vector<Placed> placed;
  bool planted = false;  // by plant(): models and places are no longer those of the file
  Float3 low, high;      // box of all that is placed
};

/// Reads a .glb or a .gltf with as much of the format as the sample needs: nodes with matrices, triangles with 32-bit or
/// 16-bit indices, PNG pictures. Throws std::exception.
Trees read_trees(const std::string& path);

/// Makes one model of all that the file places, and places it `copies` times, in rows that chance moves.
void plant(Trees& trees, uint32_t copies);

/// Applies b, then a.
Transform multiply(const Transform& a, const Transform& b);
Float3 transformed(const Transform& t, const Float3& p);
