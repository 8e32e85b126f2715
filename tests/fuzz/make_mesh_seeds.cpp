// Writes the files that fuzz_mesh and fuzz_attach start with: a small one of each kind that they read.
//   make_mesh_seeds CORPUS      writes into CORPUS/mesh and CORPUS/attach
#include <meshoptimizer.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "tests/mesh/encode.hpp"
#include "tests/support/character.hpp"
#include "tests/support/pictures.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

void write(const fs::path& folder, const std::string& name, const std::string& bytes) {
  fs::create_directories(folder);
  std::ofstream(folder / name, std::ios::binary) << bytes;
}

/// A mesh with everything about appearance: a picture, a sampler, a texture transform, vertex colours.
Gltf coloured(const mesh::Mesh& shape) {
  Gltf gltf = gltf_of(shape);
  const size_t count = shape.positions.size();
  const std::vector<float> places(2 * count, 0.3f);
  const std::vector<uint8_t> colours(4 * count, 77);
  json& primitive = gltf.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_0"] = gltf.accessor(raw(places), 5126, "VEC2", count);
  const int colour = gltf.accessor(raw(colours), 5121, "VEC4", count);
  gltf.json["accessors"][size_t(colour)]["normalized"] = true;
  primitive["attributes"]["COLOR_0"] = colour;
  primitive["material"] = 0;
  std::vector<std::array<uint8_t, 3>> pixels(12, {200, 10, 30});
  gltf.json["images"] = {{{"bufferView", gltf.view(png(4, 3, pixels))}, {"mimeType", "image/png"}}};
  gltf.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};
  gltf.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  gltf.json["materials"] = {
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {1, 0.5, 0.25, 1}},
         {"baseColorTexture",
          {{"index", 0},
           {"extensions",
            {{"KHR_texture_transform", {{"offset", {0.5, 0}}, {"rotation", 1}, {"scale", {2, 2}}}}}}}}}}}};
  return gltf;
}

/// A hierarchy with a camera, a light, an animation, strips, sparse positions and narrow indices.
Gltf furnished(const mesh::Mesh& shape) {
  Gltf gltf = gltf_of(shape);
  gltf.json["accessors"][0]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", gltf.view(raw(std::vector<uint16_t>{2}))}, {"componentType", 5123}}},
      {"values", {{"bufferView", gltf.view(raw(std::vector<float>{0, 0, 2}))}}}};
  const int strip = gltf.mesh(0, gltf.indices16({0, 1, 2, 3, 4}), "strip", 5);
  gltf.json["nodes"][0]["children"] = {
      gltf.node({{"mesh", strip}, {"translation", {1, 2, 3}}, {"rotation", {0, 0, 1, 0}}, {"name", "s"}})};
  gltf.camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.1}}}});
  gltf.light({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.5}}}});
  gltf.json["animations"] = {{{"channels", {{{"target", {{"node", 0}, {"path", "translation"}}}}}}}};
  return gltf;
}

Gltf compressed(const mesh::Mesh& shape) {
  Gltf gltf;
  gltf.json["accessors"] = {{{"componentType", 5126}, {"type", "VEC3"}, {"count", shape.positions.size()}}};
  gltf.mesh(0, -1);
  gltf.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", gltf.view(draco(shape))}, {"attributes", {{"POSITION", 0}}}};
  gltf.scene({gltf.node({{"mesh", 0}, {"scale", {1, -1, 2}}})});
  return gltf;
}

/// A morphed mesh on two joints, its positions and indices compressed by meshopt.
Gltf posed(const mesh::Mesh& shape) {
  const size_t vertices = shape.positions.size();
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(vertices, sizeof(mesh::Float3)));
  packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), shape.positions.data(), vertices,
                                           sizeof(mesh::Float3)));
  std::vector<uint32_t> flat;
  for (const auto& t : shape.triangles) flat.insert(flat.end(), t.begin(), t.end());
  std::vector<unsigned char> corners(meshopt_encodeIndexBufferBound(flat.size(), vertices));
  corners.resize(meshopt_encodeIndexBuffer(corners.data(), corners.size(), flat.data(), flat.size()));
  Gltf gltf;
  const auto view = [&](const std::vector<unsigned char>& bytes, size_t count, size_t stride,
                        const char* mode) {
    const int number = gltf.view(raw(bytes));
    gltf.json["bufferViews"][size_t(number)] = {{"buffer", 1},
                                                {"byteLength", count * stride},
                                                {"extensions",
                                                 {{"EXT_meshopt_compression",
                                                   {{"buffer", 0},
                                                    {"byteOffset", gltf.data.size() - bytes.size()},
                                                    {"byteLength", bytes.size()},
                                                    {"byteStride", stride},
                                                    {"mode", mode},
                                                    {"count", count}}}}}};
    return number;
  };
  const int positions = view(packed, vertices, sizeof(mesh::Float3), "ATTRIBUTES"),
            triangles = view(corners, flat.size(), 4, "TRIANGLES");
  gltf.json["accessors"] = {
      {{"bufferView", positions}, {"componentType", 5126}, {"type", "VEC3"}, {"count", vertices}},
      {{"bufferView", triangles}, {"componentType", 5125}, {"type", "SCALAR"}, {"count", flat.size()}}};
  gltf.more_buffers = {{{"byteLength", 1000}}};
  gltf.mesh(0, 1);
  gltf.json["meshes"][0]["weights"] = {0.5};
  gltf.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", gltf.positions(shape.positions)}}};
  const std::vector<float> inverses{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1,
                                    1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  gltf.json["skins"] = {
      {{"joints", {1, 2}}, {"inverseBindMatrices", gltf.accessor(raw(inverses), 5126, "MAT4", 2)}}};
  gltf.scene({gltf.node({{"mesh", 0}, {"skin", 0}}), gltf.node({{"name", "a"}}), gltf.node({{"name", "b"}})});
  return gltf;
}

void make(const fs::path& corpus) {
  // The first byte chooses the format, by its index in fuzz_mesh.cpp's list.
  enum Kind : char { kPly, kStl, kObj, kOff, kGlb, kGltf, kDrc, kGzip, kZstd, kAny, kPicture };
  const auto mesh = [&](const std::string& name, Kind kind, const std::string& bytes) {
    write(corpus / "mesh", name, std::string(1, kind) + bytes);
  };
  const mesh::Mesh shape = icosphere(0), box = cube();
  mesh("text-ply", kPly, ply_text(shape));
  mesh("binary-ply", kPly, ply_binary(shape));
  mesh("big-endian-ply", kPly, ply_binary(box, true));
  mesh("strips-ply", kPly,
       "ply\nformat ascii 1.0\ncomment strips and colours\nelement vertex 4\nproperty double x\n"
       "property float y\nproperty int z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
       "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
       "0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n1 1 1 0 0 0\n6 0 1 2 -1 1 2\n");
  mesh("text-stl", kStl, stl_text(box));
  mesh("binary-stl", kStl, stl_binary(shape));
  mesh("obj", kObj, obj_text(shape));
  mesh("objects-obj", kObj,
       "# two\no one\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3 \\\n 1\no two\n"
       "v 0 0 1e-3\nf -1 -2 -3 -4\nl 1 2\n");
  mesh("off", kOff, off_text(shape));
  mesh("colours-off", kOff,
       "COFF\n# c\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2 255 0 0\n");
  mesh("drc", kDrc, draco(shape));
  mesh("plain-glb", kGlb, gltf_of(box).glb());
  mesh("coloured-glb", kGlb, coloured(box).glb());
  mesh("furnished-glb", kGlb, furnished(shape).glb());
  mesh("draco-glb", kGlb, compressed(box).glb());
  mesh("posed-glb", kGlb, posed(shape).glb());
  mesh("character-glb", kGlb, tube_character(3, 2).glb());
  mesh("gltf", kGltf, furnished(box).embedded());
  mesh("ply-gz", kGzip, gzip(ply_binary(shape)));
  mesh("ply-zst", kZstd, zstd(ply_binary(shape)));
  std::vector<std::array<uint8_t, 3>> pixels;
  for (int i = 0; i < 20; ++i) pixels.push_back({uint8_t(i * 50), uint8_t(i * i), uint8_t(255 - i)});
  mesh("png", kPicture, png(5, 4, pixels));
  mesh("jpeg", kPicture, jpeg(5, 4, pixels));
  mesh("jpeg-cmyk", kPicture, cmyk_jpeg(9, 2, {18, {10, 200, 100, 250}}));
  mesh("jpeg-progressive", kPicture, jpeg_of_scans(16, 40));
  mesh("jpeg-large-factors", kPicture, jpeg_with_large_factors());

  // Flags, and the size of the metadata.
  const auto attach = [&](const std::string& name, char flags, const std::string& metadata,
                          const std::string& gltf) {
    const char prefix[3] = {flags, char(metadata.size() >> 8), char(metadata.size() & 255)};
    write(corpus / "attach", name, std::string(prefix, 3) + metadata + gltf);
  };
  const std::string metadata =
      R"({"source":{"hash":"xxh3-64:0"},"hierarchy":{"instances":[0,1]},"merge":null})";
  attach("embedded", 0, "", furnished(box).glb());
  attach("by-name", 2, metadata, gltf_of(box).glb());
  attach("metadata", 4, metadata, gltf_of(box).glb());
  attach("reference", 1, "", coloured(box).glb());
  attach("text", 0, "", furnished(box).embedded());
  Gltf bare = compressed(box);
  bare.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  bare.json["nodes"][0]["extensions"] = json::object();
  attach("extensions", 2, "", bare.glb());
}

}  // namespace
}  // namespace nif::test

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_mesh_seeds CORPUS\n");
    return 2;
  }
  nif::test::make(argv[1]);
}
