// Any bytes as a .glb or .gltf, and an asset attached to it and taken away again, as `nif attach` does: what
// comes out is glTF with the same source hash, and without the asset it is what went in, byte for byte. The
// asset's metadata is hostile, too.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "bake/report.hpp"
#include "formats/mesh/gltf/attach.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/writer.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/mutate_gltf.hpp"
#include "tests/support/random_asset.hpp"
#include "tools/attach/nodes.hpp"

namespace {

using nif::test::must;
namespace mesh = nif::mesh;
namespace format = nif::format;

/// Flags in the first byte of the input. The next two bytes are the size of the metadata.
constexpr size_t kPrefix = 3;
enum Flags : uint8_t { kReference = 1, kByName = 2, kOwnMetadata = 4 };

constexpr size_t kMostInstances = 12;

/// A small asset whose instances are named like the scene's.
std::vector<std::byte> asset_for(const mesh::Scene& scene, const std::string& metadata) {
  static const format::Asset one = nif::test::random_asset(1, {.objects = 0, .instances = 0, .bvhs = 1});
  format::Asset asset = one;
  for (const mesh::Instance& instance : scene.instances) {
    if (asset.instances.size() == kMostInstances) break;
    format::Instance placed;
    placed.name = format::clean_name(instance.name);
    asset.instances.push_back(placed);
  }
  asset.metadata = metadata;
  return format::encode(asset);
}

/// Metadata as the baker writes it.
std::string metadata_of(const mesh::Scene& scene) {
  nlohmann::json numbers = nlohmann::json::array();
  for (const mesh::Instance& instance : scene.instances) {
    if (numbers.size() == kMostInstances) break;
    numbers.push_back(instance.node == mesh::kNoNode ? nlohmann::json()
                                                     : nlohmann::json(scene.nodes[instance.node].number));
  }
  return nlohmann::json{{"source", {{"hash", nif::bake::source_hash_text(scene.source_hash)}}},
                        {"hierarchy", {{"instances", numbers}}}}
      .dump();
}

constexpr uint64_t kMostBytes = 1 << 24;

mesh::Scene read(const std::string& path, std::string_view bytes) {
  return mesh::read(path, bytes, {.max_decompressed_bytes = kMostBytes, .max_triangles = 1 << 18});
}

void attach(const mesh::GltfFile& file, const mesh::Scene& scene, uint8_t flags, const std::string& own) {
  std::vector<std::byte> asset;
  try {
    asset = asset_for(scene, flags & kOwnMetadata ? own : metadata_of(scene));
  } catch (const nif::Error&) {
    return;  // metadata that is not UTF-8
  }
  const format::AssetView view = format::read_asset(asset, "asset");
  const std::string path = file.file().string();
  nif::tools::NodeMatch match = flags & kByName ? nif::tools::match_names(view, scene, "asset", path)
                                                : nif::tools::match_nodes(view, scene, "asset", path);
  mesh::Attachment attachment;
  attachment.nodes = std::move(match.nodes);
  if (flags & kReference || !file.is_glb())
    attachment.uri = "a%20b.nif";
  else
    attachment.asset = asset;

  const std::string before = file.without().joined(), with = file.with(attachment).joined();
  const nif::test::MemoryFile written(with);
  const mesh::GltfFile again(written.path(), 2 * kMostBytes);
  must(again.has_attachment());
  must(again.without().joined() == before);
  must(read(written.path(), with).source_hash == scene.source_hash);
}

}  // namespace

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  if (size < kPrefix || seed % 4 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const size_t start = kPrefix + std::min<size_t>(size - kPrefix, size_t(data[1]) << 8 | data[2]);
  return start + nif::test::mutate_glb(data + start, size - start, max_size - start, seed, LLVMFuzzerMutate);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  nif::test::Choices choices(data, size);
  const uint8_t flags = choices.byte();
  const size_t length = size_t(choices.byte()) << 8 | choices.byte();
  const std::string_view metadata = choices.rest().substr(0, length),
                         bytes = choices.rest().substr(metadata.size());
  const nif::test::MemoryFile memory(bytes.starts_with("glTF") ? std::string(bytes)
                                                               : nif::test::spelled_out(bytes));
  try {
    const mesh::GltfFile file(memory.path(), kMostBytes);
    const mesh::Scene scene = read(memory.path(), file.bytes());
    file.relative_uris();
    file.has_attachment();
    attach(file, scene, flags, nif::test::spelled_out(metadata));
  } catch (const nif::Error& error) {
    if (error.status() != nif::Status::mesh_mismatch && error.status() != nif::Status::usage)
      nif::test::must_refuse_well(error, memory.path());
  }
  return 0;
}
