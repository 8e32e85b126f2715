// No file may crash the reader, hang it or make it allocate without bound: every truncation of a small file
// of each format, and thousands of random damages. Meant to run under the address sanitizer, too.
#include <gtest/gtest.h>
#include <meshoptimizer.h>
#include <zlib.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/image.hpp"
#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/pictures.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

/// std::mt19937 returns 32 bits in a wider type.
class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}
  uint32_t operator()() { return static_cast<uint32_t>(engine_()); }

 private:
  std::mt19937 engine_;
};

struct Sample {
  std::string name;
  std::string bytes;
  bool knows_its_end;  ///< every proper beginning of the file must be refused
};

/// A morphed mesh on two joints, its positions compressed by meshopt.
std::string posed_glb(const mesh::Mesh& shape) {
  const size_t vertices = shape.positions.size();
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(vertices, sizeof(mesh::Float3)));
  packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), shape.positions.data(), vertices,
                                           sizeof(mesh::Float3)));
  Gltf gltf;
  const int view = gltf.view(raw(packed));
  nlohmann::json& compressed = gltf.json["bufferViews"][size_t(view)];
  compressed = {{"buffer", 1},
                {"byteLength", vertices * sizeof(mesh::Float3)},
                {"extensions",
                 {{"EXT_meshopt_compression",
                   {{"buffer", 0},
                    {"byteOffset", 0},
                    {"byteLength", packed.size()},
                    {"byteStride", sizeof(mesh::Float3)},
                    {"mode", "ATTRIBUTES"},
                    {"count", vertices}}}}}};
  gltf.json["accessors"].push_back(
      {{"bufferView", view}, {"componentType", 5126}, {"type", "VEC3"}, {"count", vertices}});
  gltf.more_buffers = {{{"byteLength", 1000}}};
  gltf.mesh(0, -1);
  gltf.json["meshes"][0]["weights"] = {0.5};
  gltf.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", gltf.positions(shape.positions)}}};
  const std::vector<float> inverses{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1,
                                    1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  gltf.json["skins"] = {
      {{"joints", {1, 2}}, {"inverseBindMatrices", gltf.accessor(raw(inverses), 5126, "MAT4", 2)}}};
  gltf.scene({gltf.node({{"mesh", 0}, {"skin", 0}}), gltf.node({{"name", "a"}}), gltf.node({{"name", "b"}})});
  return gltf.glb();
}

std::vector<Sample> samples() {
  const mesh::Mesh shape = icosphere(0);
  const std::string draco_file = draco(shape);
  Gltf compressed;
  compressed.json["accessors"] = {{{"componentType", 5126}, {"type", "VEC3"}, {"count", 12}}};
  compressed.mesh(0, -1);
  compressed.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", compressed.view(draco_file)}, {"attributes", {{"POSITION", 0}}}};
  return {{"a.ply", ply_text(shape), false},           {"b.ply", ply_binary(shape), true},
          {"c.ply", ply_binary(shape, true), true},    {"a.stl", stl_text(shape), false},
          {"b.stl", stl_binary(shape), true},          {"a.obj", obj_text(shape), false},
          {"a.off", off_text(shape), false},           {"a.drc", draco_file, false},
          {"a.glb", gltf_of(shape).glb(), true},       {"a.gltf", gltf_of(shape).embedded(), true},
          {"b.glb", compressed.glb(), true},           {"c.glb", posed_glb(shape), true},
          {"a.ply.gz", gzip(ply_binary(shape)), true}, {"a.ply.zst", zstd(ply_binary(shape)), true}};
}

/// Reads the bytes and uses the result. Returns true if they were accepted.
bool survives(const TempDir& folder, const Sample& sample, std::string_view bytes) {
  try {
    const mesh::Scene scene = mesh::read(folder.write(sample.name, bytes),
                                         {.max_decompressed_bytes = 1 << 24, .max_triangles = 1 << 20});
    EXPECT_FALSE(scene.meshes.empty());
    std::vector<bool> placed(scene.meshes.size(), scene.instances.empty());
    for (const mesh::Instance& instance : scene.instances) placed.at(instance.mesh) = true;
    EXPECT_EQ(std::ranges::find(placed, false), placed.end());
    for (const mesh::Camera& camera : scene.cameras)
      EXPECT_TRUE(camera.vertical_fov > 0 && camera.vertical_fov < std::numbers::pi);
    for (const mesh::Light& light : scene.lights)
      EXPECT_TRUE(light.intensity >= 0 && light.inner_cone <= light.outer_cone);
    for (const mesh::Mesh& mesh : scene.meshes) {
      EXPECT_FALSE(mesh.triangles.empty());
      try {
        mesh::clean(mesh);
      } catch (const Error& error) {
        EXPECT_EQ(error.status(), Status::all_degenerate);
      }
    }
    return true;
  } catch (const Error& error) {
    EXPECT_NE(error.status(), Status::internal);
    EXPECT_NE(std::string(error.what()).find(sample.name), std::string::npos) << error.what();
    return false;
  }
}

TEST(Hostile, EveryTruncation) {
  const TempDir folder;
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(sample.name);
    EXPECT_TRUE(survives(folder, sample, sample.bytes));
    for (size_t length = 0; length < sample.bytes.size(); ++length) {
      const bool accepted = survives(folder, sample, std::string_view(sample.bytes).substr(0, length));
      EXPECT_FALSE(accepted && sample.knows_its_end) << length;
    }
  }
}

TEST(Hostile, RandomDamage) {
  const TempDir folder;
  Random random(20);
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(sample.name);
    for (int round = 0; round < 400; ++round) {
      std::string bytes = sample.bytes;
      for (uint32_t n = 1 + random() % 4; n != 0; --n) {
        const size_t at = random() % bytes.size();
        switch (random() % 5) {
          case 0:
            bytes[at] = static_cast<char>(random());
            break;
          case 1:
            bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
            break;
          case 2:
            bytes.erase(at, 1 + random() % 8);
            break;
          case 3:
            bytes.insert(at, 1 + random() % 4, "09-e\xFF"[random() % 5]);
            break;
          default:
            bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 32));
            break;
        }
        if (bytes.empty()) bytes.push_back('x');
      }
      survives(folder, sample, bytes);
    }
  }
}

/// Found by fuzzing: if the type of an attribute becomes "bool" (11), Draco loads the bytes of floats as
/// bools. The position of the type depends on the encoder, so every byte is tried.
TEST(Hostile, DracoPositionsOfImpossibleTypes) {
  const TempDir folder;
  const std::string whole = draco(icosphere(1));
  for (size_t at = 0; at < whole.size(); ++at) {
    for (const char type : {'\x0B', '\x05', '\x00', '\xFF'}) {
      std::string bytes = whole;
      bytes[at] = type;
      survives(folder, {"a.drc", "", false}, bytes);
    }
  }
}

/// Status of reading it as a mesh.
Status status_of(const TempDir& folder, const std::string& name, std::string_view bytes) {
  try {
    mesh::read(folder.write(name, bytes));
    return Status::ok;
  } catch (const Error& error) {
    return error.status();
  }
}

TEST(Hostile, DracoCountsBeyondWhatItsBytesCanHold) {
  // Draco allocates memory for all triangles that the header claims, about 40 bytes each, before it reads
  // one.
  const TempDir folder;
  const auto file = [](char method, const std::string& counts) {
    return std::string("DRACO\x02\x02\x01", 8) + method + std::string(2, '\0') + counts +
           std::string(200, '\x55');
  };
  const std::string many = "\xff\xff\xff\xef\x01", few("\x04", 1);  // variable length, 7 bits a byte
  const std::string standard(1, '\0');
  EXPECT_EQ(status_of(folder, "a.drc", file(1, standard + many + many)), Status::too_large);
  EXPECT_EQ(status_of(folder, "a.drc", file(1, standard + few + many)), Status::too_large);
  EXPECT_EQ(status_of(folder, "a.drc", file(0, few + many)), Status::too_large);
  EXPECT_EQ(status_of(folder, "a.drc", file(1, standard + few + few)), Status::malformed_mesh);
  EXPECT_EQ(status_of(folder, "a.drc", file(0, "\xff")), Status::malformed_mesh);
}

/// Why a picture is refused; empty if it is not.
std::string refusal_of(std::string_view picture) {
  uint64_t texels = mesh::detail::kMostTexels;
  std::string why;
  mesh::detail::decode_image(picture, texels, why);
  return why;
}

/// Found by fuzzing in an earlier decoder: tables with more codes than possible.
TEST(Hostile, HuffmanTablesOfPicturesThatAreTooLong) {
  std::string picture = "\xFF\xD8\xFF\xC4";
  picture.push_back(char((19 + 300) >> 8)), picture.push_back(char((19 + 300) & 255));
  picture += '\0' + std::string(14, '\0') + std::string(2, '\x96') + std::string(300, '\x01');  // 300 codes
  EXPECT_NE(refusal_of(picture).find("Bogus Huffman table"), std::string::npos) << refusal_of(picture);
  // Bytes of ones may precede a marker.
  picture.insert(size_t{3}, 40, '\xFF');
  EXPECT_NE(refusal_of(picture).find("Bogus Huffman table"), std::string::npos) << refusal_of(picture);
}

/// Found by fuzzing in an earlier decoder: missing parts of a picture were filled with old heap memory.
TEST(Hostile, PicturesWithoutTheirTables) {
  std::string picture = test::jpeg(8, 8, std::vector<std::array<uint8_t, 3>>(64, {200, 40, 90}));
  for (size_t at; (at = picture.find("\xFF\xDB")) != std::string::npos;)
    picture.erase(at, 2 + (size_t{uint8_t(picture[at + 2])} << 8 | uint8_t(picture[at + 3])));
  EXPECT_NE(refusal_of(picture).find("Quantization table"), std::string::npos) << refusal_of(picture);
}

/// Found by fuzzing in an earlier decoder: 16-bit factors made integers overflow.
TEST(Hostile, PicturesWithLargeFactors) { EXPECT_EQ(refusal_of(test::jpeg_with_large_factors()), ""); }

TEST(Hostile, PicturesThatEndTooEarly) {
  Random random(8);
  std::vector<std::array<uint8_t, 3>> pixels(40 * 30);
  for (std::array<uint8_t, 3>& pixel : pixels)
    for (uint8_t& value : pixel) value = uint8_t(random());
  for (const std::string& whole : {test::png(40, 30, pixels), test::jpeg(40, 30, pixels)}) {
    ASSERT_EQ(refusal_of(whole), "");
    for (size_t size = 0; size + 16 < whole.size(); size += 7)
      EXPECT_NE(refusal_of(std::string_view(whole).substr(0, size)), "") << size;
  }
}

/// A damaged picture costs as much memory and time as a valid one.
TEST(Hostile, DamagedPicturesCountAsRead) {
  const std::string whole = test::png(40, 30, std::vector<std::array<uint8_t, 3>>(40 * 30, {1, 2, 3}));
  uint64_t texels = 2000;
  std::string why;
  EXPECT_FALSE(mesh::detail::decode_image(std::string_view(whole).substr(0, whole.size() / 2), texels, why));
  EXPECT_EQ(texels, 800u) << why;
}

/// Each scan of a few bytes visits all blocks of the picture.
TEST(Hostile, PicturesOfManyScans) {
  const std::string picture = test::jpeg_of_scans(64, 501);
  EXPECT_NE(refusal_of(picture).find("more than 500 scans"), std::string::npos) << refusal_of(picture);
  EXPECT_EQ(refusal_of(test::jpeg_of_scans(64, 20)), "");
}

/// Its data has 64 MB for 8 x 8 texels. The excess is not decompressed.
TEST(Hostile, PicturesThatUnpackToMoreThanTheyShow) {
  std::string packed(64 << 20, '\0'), data(packed.size() / 100, '\0');
  uLongf length = data.size();
  ASSERT_EQ(compress2(reinterpret_cast<Bytef*>(data.data()), &length,
                      reinterpret_cast<const Bytef*>(packed.data()), packed.size(), 9),
            Z_OK);
  data.resize(length);
  EXPECT_EQ(refusal_of(test::png_that_claims(8, 8, data)), "");
  EXPECT_NE(refusal_of(test::png_that_claims(20000, 20000, data)).find("more than the limit"),
            std::string::npos);
  std::string damaged = test::png_that_claims(8, 8, data);
  damaged[16] = 1;  // the highest byte of the width; the checksum is now wrong
  EXPECT_NE(refusal_of(damaged).find("CRC error"), std::string::npos) << refusal_of(damaged);
}

/// Replaces a value or subtree of the JSON, because random bytes rarely leave it valid. Returns its pointer.
std::string damage(Gltf& gltf, Random& random) {
  const nlohmann::json flat = gltf.json.flatten();
  const std::vector<nlohmann::json> values{-1,
                                           0,
                                           1,
                                           3,
                                           5121,
                                           4294967295u,
                                           1e300,
                                           "x",
                                           nullptr,
                                           true,
                                           nlohmann::json::array(),
                                           nlohmann::json::object(),
                                           {0, 1, 2},
                                           18446744073709551615u};
  auto entry = flat.begin();
  std::advance(entry, static_cast<std::ptrdiff_t>(random() % flat.size()));
  std::string pointer = entry.key();
  for (uint32_t up = random() % 3; up != 0 && pointer.rfind('/') > 0; --up)
    pointer.resize(pointer.rfind('/'));
  gltf.json[nlohmann::json::json_pointer(pointer)] = values[random() % values.size()];
  return pointer;
}

TEST(Hostile, DamagedStructureOfGltf) {
  const TempDir folder;
  Random random(21);
  const Gltf whole = gltf_of(icosphere(0));
  for (int round = 0; round < 1500; ++round) {
    Gltf damaged = whole;
    damage(damaged, random);
    survives(folder, {"a.glb", "", false}, damaged.glb());
  }
}

TEST(Hostile, DamagedCamerasAndLightsOfGltfCostNoMesh) {
  const TempDir folder;
  Random random(23);
  Gltf whole = gltf_of(icosphere(0));
  whole.json["cameras"] = {{{"type", "perspective"}, {"name", "c"}, {"perspective", {{"yfov", 1}}}}};
  whole.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "spot"},
       {"name", "l"},
       {"color", {1, 1, 1}},
       {"intensity", 5},
       {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}}};
  const nlohmann::json of_light = {{"KHR_lights_punctual", {{"light", 0}}}};
  whole.node({{"name", "n"}, {"camera", 0}, {"extensions", of_light}});
  whole.json["scenes"][0]["nodes"].push_back(1);
  for (int round = 0; round < 1500; ++round) {
    Gltf damaged = whole;
    const std::string place = damage(damaged, random);
    const bool accepted = survives(folder, {"a.glb", "", false}, damaged.glb());
    const bool of_fixtures = place.starts_with("/cameras") || place.starts_with("/extensions") ||
                             place.starts_with("/nodes/1/camera") ||
                             place.starts_with("/nodes/1/extensions/");
    EXPECT_TRUE(accepted || !of_fixtures) << place << ' ' << damaged.json.dump();
  }
}

TEST(Hostile, RandomBytesOfEveryExtension) {
  const TempDir folder;
  Random random(22);
  for (const char* start :
       {"", "ply\n", "solid ", "OFF\n", "glTF", "DRACO", "{", "\x1f\x8b\x08", "\x28\xb5\x2f\xfd"}) {
    for (const char* name : {"a.ply", "a.stl", "a.obj", "a.off", "a.glb", "a.gltf", "a.drc", "a"}) {
      std::string bytes = start;
      for (uint32_t n = random() % 300; n != 0; --n) bytes.push_back(static_cast<char>(random()));
      survives(folder, {name, "", false}, bytes);
    }
  }
}

}  // namespace
}  // namespace nif::test
