// `nif export-shader`: writes what a shader needs to answer rays by an asset: the text of the functions, and the
// words that they read.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "kernels/shader/shader_tables.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/options.hpp"
#include "tools/common/runtime_handles.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/export_shader/shader_sections.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSchema = "nifkit.export_shader/1";

struct Arguments {
  std::string asset, folder;
  std::optional<uint32_t> object;
  bool whole = false, json = false, quiet = false;
};

struct Written {
  std::string file, what;
  uint64_t bytes;
};

/// An object that does not exist or that shaders cannot answer is the caller's choice, not a defect.
void check_usage(NifError error) {
  if (error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_NOT_AVAILABLE)
    throw Error(Status::usage, nifGetErrorMessage());
  check(error);
}

class Exporter {
 public:
  explicit Exporter(const Arguments& arguments) : arguments_(arguments) {
    check(nifNewDevice("shaders=on", nullptr, &device_.handle));
    check(nifLoadAssetFile(device_.handle, arguments.asset.c_str(), NIF_LOAD_COPY, &asset_.handle));
  }

  void run() {
    auto about = nifkit::sized<NifAssetInfo>();
    check(nifGetAssetInfo(asset_.handle, &about));
    uint32_t first = 0, end = about.object_count;
    if (arguments_.object) first = *arguments_.object, end = first + 1;
    const std::string stem = fs::path(arguments_.asset).stem().string();
    for (uint32_t i = first; i < end; ++i)
      add(fmt::format("{}.object-{}.words", stem, i), fmt::format("object {}", i),
          arguments_.object.has_value(), [&](uint32_t* words, uint64_t capacity, uint64_t* count) {
            return nifGetShaderTables(asset_.handle, i, words, capacity, count);
          });
    if (files_.empty()) check_usage(NIF_ERROR_NOT_AVAILABLE);  // with why of the last object
    for (const File& file : files_) sections_.add_object(file.words[kernels::shader::kFlags]);
    if (!arguments_.object && refused_.empty() && !is_one_object_at_rest(about)) {
      add_scene(stem);
      sections_.scenes = true;
    }
    if (arguments_.whole) sections_ = ShaderSections::all();

    std::error_code failed;
    fs::create_directories(arguments_.folder, failed);
    if (failed)
      throw Error(Status::output_not_writable,
                  fmt::format("{}: cannot be created: {}", arguments_.folder, failed.message()));
    for (const auto& [name, language] : {std::pair("nif.glsl", NIF_SHADER_GLSL),
                                         {"nif.hlsl", NIF_SHADER_HLSL},
                                         {"nif.metal", NIF_SHADER_METAL},
                                         {"nif.wgsl", NIF_SHADER_WGSL}}) {
      const std::string whole = nifGetShaderSource(language);
      const std::string text = arguments_.whole ? whole : cut_shader(whole, sections_);
      write(name, "functions", std::as_bytes(std::span(text)));
    }
    for (const File& file : files_) write(file.name, file.what, std::as_bytes(std::span(file.words)));
    if (arguments_.json)
      print_json();
    else if (!arguments_.quiet)
      print();
  }

 private:
  struct File {
    std::string name, what;
    std::vector<uint32_t> words;
  };

  template <class Get>
  void add(const std::string& name, const std::string& what, bool must, const Get& get) {
    uint64_t count = 0;
    const NifError error = get(nullptr, 0, &count);
    if (error != NIF_OK && (must || error != NIF_ERROR_NOT_AVAILABLE)) check_usage(error);
    if (error != NIF_OK) return refused_.push_back(nifGetErrorMessage());
    std::vector<uint32_t> words(count);
    check(get(words.data(), words.size(), &count));
    files_.push_back({name, what, std::move(words)});
  }

  /// Whether the asset is an object as it is: as a scene it would give the same answers.
  bool is_one_object_at_rest(const NifAssetInfo& about) const {
    if (about.object_count != 1 || about.instance_count != 1) return false;
    auto instance = nifkit::sized<NifAssetInstanceInfo>();
    check(nifGetAssetInstanceInfo(asset_.handle, 0, &instance));
    constexpr float kIdentity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    return std::ranges::equal(instance.transform, kIdentity) && instance.mask == 0xffffffffu &&
           instance.flags == 0;
  }

  /// All that the asset places.
  void add_scene(const std::string& stem) {
    Scene scene;
    check(nifNewScene(device_.handle, &scene.handle));
    check(nifAddAsset(scene.handle, asset_.handle, nullptr, nullptr, nullptr));
    check(nifCommitScene(scene.handle));
    add(stem + ".scene.words", "scene", true, [&](uint32_t* words, uint64_t capacity, uint64_t* count) {
      return nifGetSceneShaderTables(scene.handle, words, capacity, count);
    });
  }

  void write(const std::string& name, const std::string& what, std::span<const std::byte> bytes) {
    const std::string path = (fs::path(arguments_.folder) / name).string();
    refuse_overwriting(arguments_.asset, path);
    write_output(path, bytes);
    written_.push_back({path, what, bytes.size()});
  }

  void print() const {
    for (const Written& file : written_) fmt::print("{}: {}, {} bytes\n", file.file, file.what, file.bytes);
    fmt::print("sections of the functions: {}\n", sections_.listed());
    for (const std::string& sentence : refused_) fmt::print("left out: {}\n", sentence);
  }
  void print_json() const {
    nlohmann::ordered_json json = {{"schema", kSchema}, {"files", nlohmann::ordered_json::array()}};
    for (const Written& file : written_)
      json["files"].push_back({{"path", file.file}, {"what", file.what}, {"bytes", file.bytes}});
    json["sections"] = sections_.names();
    json["left_out"] = refused_;
    write_json(json);
  }

  const Arguments& arguments_;
  Device device_;
  Asset asset_;
  std::vector<File> files_;
  ShaderSections sections_;
  std::vector<std::string> refused_;
  std::vector<Written> written_;
};

}  // namespace

void add_export_shader(Command app) {
  const Command command =
      app.add_subcommand("export-shader", "Write what a shader of your own needs to answer rays");
  auto a = std::make_shared<Arguments>();
  command.add_option("ASSET", a->asset, "The .nif file").required();
  command.add_option("-o,--output", a->folder, "Folder for the texts and the words; it is created if missing")
      .required();
  command.add_option("--object", a->object, "Only this object of the asset. The first is 0");
  command.add_flag("--whole", a->whole, "Write whole texts, which answer any object and scene");
  add_json_option(command, a->json, kSchema);
  add_quiet_option(command, a->quiet);
  command.footer(
      "Writes nif.glsl, nif.hlsl, nif.metal and nif.wgsl, the functions to include, and for each object "
      "that\n"
      "shaders can answer NAME.object-N.words, 32-bit words to be bound as a read-only buffer. If they can\n"
      "answer all objects, NAME.scene.words has all that the asset places; not if that is one object as it "
      "is.\n"
      "The texts have only what these words need, of planes, network, triangles, scenes and first hits.\n"
      "docs/shaders.md explains all.\n\n"
      "Examples:\n"
      "  nif export-shader dragon.nif -o shaders\n"
      "  nif export-shader town.nif -o shaders --object 3 --json\n"
      "  nif export-shader crate.nif -o shaders --whole      # for objects of all kinds in one shader");
  command.callback([a] { Exporter(*a).run(); });
}

}  // namespace nif::tools
