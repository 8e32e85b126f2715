// Any bytes as what a person or a program writes beside meshes: a manifest of bakes, a record of an earlier
// bake, a checkpoint of a bake, a scene to render, an environment map. Each is refused with a sentence, or
// read. The first byte of the input chooses which.
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "bake/checkpoint.hpp"
#include "formats/nif/crc32c.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tools/batch/manifest.hpp"
#include "tools/batch/record.hpp"
#include "tools/render/image_file.hpp"
#include "tools/render/scene_file.hpp"

namespace {

using nif::test::must, nif::test::spelled_out;
namespace fs = std::filesystem;

/// A folder of this process with meshes for patterns to match, and the state of earlier bakes.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "nif-fuzz-XXXXXX").string();
    must(::mkdtemp(name.data()) != nullptr);
    path_ = name;
    fs::create_directories(path_ / "b" / "c");
    fs::create_directories(path_ / "state");
    for (const char* mesh : {"a.ply", "b/d.glb", "b/c/e.obj.gz"}) write(mesh, "x");
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  fs::path write(const std::string& name, std::string_view bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};
const Folder& folder() {
  static const Folder folder;
  return folder;
}

/// Patterns must stay in the folder; otherwise they could search the whole disk.
bool leads_away(std::string_view text) {
  for (const char* way : {"..", "\"/", "'/", "\\", "\"\"\"", "'''"})
    if (text.find(way) != std::string_view::npos) return true;
  return false;
}

void read_manifest(std::string_view text) {
  if (leads_away(text)) return;
  const std::string file = folder().write("m.toml", text).string();
  try {
    const nif::tools::Manifest manifest = nif::tools::read_manifest(file);
    must(!manifest.assets.empty());
    for (const nif::tools::BatchAsset& asset : manifest.assets)
      must(!asset.mesh.empty() && !asset.output.empty() && !asset.name.empty());
  } catch (const nif::Error& error) {
    // Messages name a folder that cannot be listed, and not the manifest.
    if (error.status() != nif::Status::file_unreadable) nif::test::must_refuse_well(error, file);
  }
}

void read_record(std::string_view text) {
  nif::tools::Manifest manifest;
  manifest.file = (folder().path() / "m.toml").string();
  manifest.state = folder().path() / "state";
  const nif::tools::BatchAsset asset{
      (folder().path() / "a.ply").string(), (folder().path() / "a.nif").string(), "a.nif", {}};
  const nif::tools::Records records(manifest);
  std::ofstream(records.path_for(asset, ".json"), std::ios::binary) << text;
  const std::string why = records.why_stale(asset, records.load(asset));
  must(!why.empty());  // there is no asset that it belongs to
}

void read_scene(std::string_view text) {
  const nif::test::MemoryFile file(text);
  try {
    const nif::render::SceneDescription scene = nif::render::read_scene(file.path());
    must(!scene.objects.empty());
    must(scene.picture.width >= 1 && scene.picture.width <= nif::render::kMaxPictureSide);
  } catch (const nif::Error& error) {
    nif::test::must_refuse_well(error, file.path());
  }
}

void read_environment(std::string_view bytes) {
  const nif::test::MemoryFile file(bytes);
  try {
    const nif::render::Image image = nif::render::read_environment(file.path());
    must(image.values.size() == size_t(3) * image.width * image.height);
    for (const float x : image.values) must(x >= 0 && std::isfinite(x));
  } catch (const nif::Error& error) {
    nif::test::must_refuse_well(error, file.path());
  }
}

/// A checkpoint with the right key and checksum; the input is everything after the key.
void read_checkpoint(std::string_view text) {
  using namespace nif::bake;
  const BakeKey key{"program", "mesh", "options"};
  std::vector<std::byte> file = encode_checkpoint(key, {});
  file.resize(file.size() - sizeof(uint64_t) - sizeof(uint32_t));  // the count of trainings, and the checksum
  const auto add = [&](std::string_view bytes) {
    const auto more = std::as_bytes(std::span(bytes));
    file.insert(file.end(), more.begin(), more.end());
  };
  add(text);
  const uint32_t sum = nif::format::crc32c(file);
  add({reinterpret_cast<const char*>(&sum), sizeof(sum)});
  try {
    const std::vector<KeptTraining> trainings = decode_checkpoint(file, key);
    size_t bytes = 0;
    for (const KeptTraining& training : trainings) bytes += training.object.size() + training.state.size();
    must(bytes <= text.size());
    must(encode_checkpoint(key, trainings).size() == file.size());
  } catch (const nif::Error& error) {
    must(error.status() == nif::Status::checkpoint_refused);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  nif::test::Choices choices(data, size);
  switch (choices.below(5)) {
    case 0:
      read_manifest(spelled_out(choices.rest()));
      break;
    case 1:
      read_record(spelled_out(choices.rest()));
      break;
    case 2:
      read_scene(spelled_out(choices.rest()));
      break;
    case 3:
      read_environment(choices.rest());
      break;
    default:
      read_checkpoint(choices.rest());
  }
  return 0;
}
