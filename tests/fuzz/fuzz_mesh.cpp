// Any bytes given to the readers of meshes and pictures: refused with a sentence, or a scene in which every
// index is in range and every used position finite. The first byte of the input chooses the format.
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/decompress.hpp"
#include "formats/mesh/image.hpp"
#include "formats/mesh/poser.hpp"
#include "formats/mesh/read.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/mutate_gltf.hpp"

namespace {

using nif::test::must;
namespace mesh = nif::mesh;

/// In a folder that does not exist, so that no other file is found.
constexpr const char* kFolder = "/no/such/folder/";
constexpr const char* kNames[] = {"a.ply",  "a.stl", "a.obj",    "a.off",     "a.glb",
                                  "a.gltf", "a.drc", "a.ply.gz", "a.ply.zst", "a"};
/// The number after the formats: pictures alone, as in glTF.
constexpr uint32_t kPicture = std::size(kNames), kKinds = kPicture + 1;
constexpr uint32_t kGlb = 4;
/// Formats that may be text.
constexpr uint32_t kTexts[] = {0, 1, 2, 3, 5};

const mesh::ReadLimits& limits() {
  static const mesh::ReadLimits limits{.max_decompressed_bytes = 1 << 24,
                                       .max_triangles = 1 << 20,
                                       .colors = true,
                                       .alpha = {.read = true},
                                       .clips = true};
  return limits;
}

void use(const mesh::Skin& skin, size_t vertices) {
  must(skin.influences == 0 ? skin.joint_count == 0 && skin.number == mesh::kNoSkin
                            : (skin.influences == 4 || skin.influences == 8) && skin.joint_count > 0);
  must(skin.joints.size() == vertices * skin.influences && skin.weights.size() == skin.joints.size());
  for (const uint16_t joint : skin.joints) must(joint < skin.joint_count);
  for (size_t v = 0; skin.influences > 0 && v < vertices; ++v) {
    double total = 0;
    for (size_t k = 0; k < skin.influences; ++k) {
      const float weight = skin.weights[v * skin.influences + k];
      must(weight >= 0);
      total += double{weight};
    }
    must(std::abs(total - 1) < 1e-5);
  }
  must(skin.rest_weights.size() == skin.targets.size());
  for (const auto& target : skin.targets) {
    must(target.size() == vertices);
    for (const mesh::Float3& move : target)
      for (const float x : move) must(std::isfinite(x));
  }
}

void use(const std::vector<mesh::PosedInstance>& posed, const mesh::Scene& scene) {
  must(posed.size() == scene.instances.size());
  for (size_t i = 0; i < posed.size(); ++i) {
    const mesh::Mesh& one = scene.meshes[scene.instances[i].mesh];
    must(posed[i].joints.size() == (one.skin ? one.skin->joint_count : 0));
    must(posed[i].weights.size() == (one.skin ? one.skin->targets.size() : 0));
    for (const double x : posed[i].transform) must(std::isfinite(float(x)));
    for (const mesh::JointMatrix& joint : posed[i].joints)
      for (const float x : joint) must(std::isfinite(x));
    for (const float weight : posed[i].weights) must(std::isfinite(weight));
    constexpr size_t kBent = 8;  // there may be millions
    if (i < kBent) must(mesh::bent(one, posed[i].joints, posed[i].weights).size() == one.positions.size());
  }
}

void use(const mesh::Scene& scene) {
  must(!scene.meshes.empty());
  std::vector<bool> placed(scene.meshes.size(), scene.instances.empty());
  for (const mesh::Instance& instance : scene.instances) {
    must(instance.mesh < scene.meshes.size());
    placed[instance.mesh] = true;
    must(instance.node == mesh::kNoNode || instance.node < scene.nodes.size());
    for (const float x : instance.transform) must(std::isfinite(x));
  }
  for (const bool one : placed) must(one);
  for (const mesh::Camera& camera : scene.cameras)
    must(camera.vertical_fov > 0 && camera.vertical_fov < std::numbers::pi);
  for (const mesh::Light& light : scene.lights)
    must(light.intensity >= 0 && light.inner_cone <= light.outer_cone);
  for (const mesh::Texture& texture : scene.textures)
    must(texture.texels.size() == size_t(3) * texture.width * texture.height);
  for (const mesh::Mesh& one : scene.meshes) {
    must(!one.triangles.empty());
    for (const mesh::Triangle& triangle : one.triangles)
      for (const uint32_t v : triangle) {
        must(v < one.positions.size());
        for (const float x : one.positions[v]) must(std::isfinite(x));
      }
    if (one.skin) use(*one.skin, one.positions.size());
    must(one.holes.empty() || one.holes.size() == one.triangles.size());
    for (size_t t = 0; t < one.holes.size(); ++t) {
      const mesh::TriangleHoles& holes = one.holes[t];
      if (!holes.any()) continue;
      must(one.alpha[t] == mesh::TriangleAlpha::cut && holes.map < one.alpha_maps.size() &&
           holes.shift <= mesh::TriangleHoles::kFraction);
    }
    for (const uint32_t material : one.look.materials) must(material < scene.materials.size());
    try {
      mesh::clean(one);
    } catch (const nif::Error& error) {
      must(error.status() == nif::Status::all_degenerate);
    }
  }
}

/// Skins are kept, and posed as the file has them and by its first clip.
void bend(const std::string& file, std::string_view bytes) {
  try {
    mesh::ReadLimits keeping = limits();
    keeping.skins = true;
    const mesh::Scene scene = mesh::read(file, bytes, keeping);
    use(scene);
    const mesh::Poser poser(file, bytes, scene, keeping);
    use(poser.rest(), scene);
    use(poser.at({"0", 0.3}), scene);
  } catch (const nif::Error& error) {
    nif::test::must_refuse_well(error, file);
  }
}

void read(std::string_view name, std::string_view bytes) {
  const std::string file = std::string(kFolder) + std::string(name);
  try {
    if (name.ends_with("gz") || name.ends_with("zst")) {
      mesh::detail::ByteBuffer packed;
      packed.reserve(bytes.size() + 1);
      std::memcpy(packed.data(), bytes.data(), bytes.size());
      packed.set_size(bytes.size());
      const mesh::detail::ByteBuffer plain = mesh::detail::decompress(std::move(packed), file, limits());
      must(plain.size() <= std::max<uint64_t>(limits().max_decompressed_bytes, bytes.size()));
      use(mesh::read(file, plain.view(), limits()));
    } else {
      const mesh::Scene scene = mesh::read(file, bytes, limits());
      use(scene);
      bend(file, bytes);
      if (scene.clips.empty()) return;
      mesh::ReadLimits moved = limits();
      moved.moment = {"0", 0.3};
      use(mesh::read(file, bytes, moved));
    }
  } catch (const nif::Error& error) {
    nif::test::must_refuse_well(error, file);
  }
}

void decode(std::string_view bytes) {
  constexpr uint64_t kMostTexels = 1 << 20;
  uint64_t texels = kMostTexels;
  std::string why;
  const auto picture = mesh::detail::decode_image(bytes, texels, why);
  must(picture.has_value() == why.empty());
  if (picture)
    must(texels == kMostTexels - uint64_t(picture->width) * picture->height &&
         picture->texels.size() == size_t(3) * picture->width * picture->height);
}

/// Corrects the checksums of a PNG's chunks, as far as their lengths are valid.
void seal_png(uint8_t* data, size_t size) {
  constexpr size_t kSignature = 8, kAround = 12;  // length and name before a chunk, checksum after it
  for (size_t at = kSignature; size - at >= kAround;) {
    const size_t length = size_t{data[at]} << 24 | data[at + 1] << 16 | data[at + 2] << 8 | data[at + 3];
    if (length > size - at - kAround) return;
    const uLong checksum = crc32(0, data + at + 4, uInt(4 + length));
    at += kAround + length;
    for (size_t i = 1; i <= 4; ++i) data[at - i] = uint8_t(checksum >> (8 * (i - 1)));
  }
}

}  // namespace

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

/// glTF is changed value by value, because most bit flips break its JSON. Lengths in a GLB and checksums in a
/// PNG are corrected.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  if (size > 1 && data[0] % kKinds == kGlb && seed % 4 != 0)
    return 1 + nif::test::mutate_glb(data + 1, size - 1, max_size - 1, seed, LLVMFuzzerMutate);
  size = LLVMFuzzerMutate(data, size, max_size);
  constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";
  if (size > kPng.size() && data[0] % kKinds == kPicture && seed % 8 != 1 &&
      std::string_view(reinterpret_cast<const char*>(data) + 1, kPng.size()) == kPng)
    seal_png(data + 1, size - 1);
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  nif::test::Choices choices(data, size);
  const uint32_t kind = choices.below(kKinds);
  if (kind == kPicture)
    decode(choices.rest());
  else if (std::ranges::find(kTexts, kind) != std::end(kTexts))
    read(kNames[kind], nif::test::spelled_out(choices.rest()));
  else
    read(kNames[kind], choices.rest());
  return 0;
}
