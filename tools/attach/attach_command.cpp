// `nif attach`: attaches a baked asset to the glTF that it was baked from, or removes it.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "formats/base/file_name.hpp"
#include "formats/base/memory.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/gltf/attach.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "tools/attach/nodes.hpp"
#include "tools/common/baked_scene.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/notes.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSchema = "nifkit.attach/1";

struct Arguments {
  std::string gltf, asset, output;
  bool reference = false, remove = false, force = false, json = false, quiet = false;
};

void check_arguments(const Arguments& arguments) {
  if (arguments.remove) {
    const char* idle = !arguments.asset.empty() ? "an ASSET"
                       : arguments.reference    ? "--reference"
                       : arguments.force        ? "--force"
                                                : nullptr;
    if (idle)
      throw Error(Status::usage,
                  fmt::format("--remove and {} cannot be used together: --remove attaches nothing", idle));
  } else if (arguments.asset.empty()) {
    throw Error(Status::usage, "give an ASSET to attach, or --remove; see --help");
  }
  refuse_overwriting(arguments.gltf, arguments.output);
  refuse_overwriting(arguments.asset, arguments.output);
  check_output(arguments.output);
}

fs::path folder_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : "."; }

/// A GLB must stay a GLB, and relative references of the file must still resolve from the output's folder.
void check_kind(const mesh::GltfFile& file, const std::string& output) {
  const std::string wanted = file.is_glb() ? ".glb" : ".gltf";
  if (ending_of(output) != wanted) {
    throw Error(Status::usage, fmt::format("{0}: {1} is a {2} file, so the output's name must end in {2}",
                                           output, file.file().string(), wanted));
  }
  std::error_code unknown;
  const std::vector<std::string> uris = file.relative_uris();
  if (!uris.empty() && !fs::equivalent(folder_of(file.file()), folder_of(output), unknown)) {
    throw Error(
        Status::usage,
        fmt::format("{}: {} refers to '{}' in its own folder, so the output must be in that folder, too",
                    output, file.file().string(), uris[0]));
  }
}

/// A path as a relative URI. Everything but letters, digits and characters that are always literal is
/// percent-encoded.
std::string uri_of(const std::string& file, const std::string& output) {
  const std::string path = fs::relative(file, folder_of(output)).generic_string();
  std::string uri;
  for (const char c : path) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("-._~/").find(c) != std::string_view::npos;
    if (plain)
      uri += c;
    else
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

uint64_t write(const std::string& path, const mesh::FilePieces& file) {
  const std::atomic<bool>& cancel = interruption();
  constexpr size_t kStep = size_t{1} << 24;  // small enough that Ctrl-C takes effect soon
  OutputFile out(path);
  for (std::string_view piece : file.pieces()) {
    while (!piece.empty()) {
      if (cancel) throw Error(Status::interrupted, "interrupted; nothing was written");
      const std::string_view step = piece.substr(0, kStep);
      out.write(std::as_bytes(std::span(step)));
      piece.remove_prefix(step.size());
    }
  }
  out.commit();
  return file.size();
}

struct Result {
  const char* how = "removed";
  size_t nodes = 0, instances = 0;
  uint64_t asset_bytes = 0, bytes = 0;
  std::string uri;
  std::vector<std::string> notes;
};

Result remove(const Arguments& arguments, const mesh::GltfFile& file) {
  if (!file.has_attachment())
    throw Error(Status::usage,
                fmt::format("{}: has no attached asset for --remove to remove", arguments.gltf));
  Result result;
  result.bytes = write(arguments.output, file.without());
  return result;
}

Result attach(const Arguments& arguments, const mesh::GltfFile& file, const mesh::Scene& scene,
              const format::FileMemory& memory) {
  const format::AssetView view = format::read_asset(memory.bytes(), arguments.asset);
  if (!arguments.force) check_alpha(scene, view.metadata, arguments.asset, arguments.gltf);
  const bool reference = arguments.reference || !file.is_glb();
  NodeMatch match = arguments.force ? match_names(view, scene, arguments.asset, arguments.gltf)
                                    : match_nodes(view, scene, arguments.asset, arguments.gltf);
  mesh::Attachment attachment;
  attachment.nodes = std::move(match.nodes);
  if (reference)
    attachment.uri = uri_of(arguments.asset, arguments.output);
  else
    attachment.asset = memory.bytes();
  Result result{reference ? "referenced" : "embedded",
                attachment.nodes.size(),
                view.instances.size(),
                memory.bytes().size(),
                0,
                attachment.uri,
                std::move(match.notes)};
  result.bytes = write(arguments.output, file.with(attachment));
  return result;
}

void print(const Arguments& arguments, const Result& result) {
  if (arguments.json) {
    nlohmann::ordered_json json{
        {"schema", kSchema}, {"file", arguments.output}, {"how", result.how}, {"bytes", result.bytes}};
    if (!arguments.remove) {
      json["asset"] = {
          {"file", arguments.asset}, {"bytes", result.asset_bytes}, {"instances", result.instances}};
      if (!result.uri.empty()) json["asset"]["uri"] = result.uri;
      json["nodes"] = result.nodes;
      json["notes"] = result.notes;
    }
    write_json(json);
  } else if (arguments.remove) {
    fmt::print("{}: {}, without an asset\n", arguments.output, format_bytes(double(result.bytes)));
  } else {
    fmt::print("{}: {}, with an asset of {} {}, at {}\n", arguments.output,
               format_bytes(double(result.bytes)), format_bytes(double(result.asset_bytes)),
               result.uri.empty() ? "in it" : fmt::format("beside it, '{}'", result.uri),
               count_of(result.nodes, "node"));
  }
}

void run(const Arguments& arguments) {
  check_arguments(arguments);
  Progress progress(arguments.quiet);
  interruption();  // from here on, Ctrl-C leaves no partial file behind
  std::error_code unknown;
  const uint64_t bytes = fs::file_size(arguments.gltf, unknown);
  if (!unknown) require_memory(2 * bytes, arguments.gltf + ": reading it");
  progress.update(0, "reading " + arguments.gltf);
  const mesh::GltfFile file(arguments.gltf, mesh::ReadLimits{}.max_decompressed_bytes);
  const mesh::ReadLimits limits =
      arguments.remove || arguments.force ? mesh::ReadLimits{} : limits_of_asset(arguments.asset);
  mesh::Scene scene = mesh::read(arguments.gltf, file.bytes(), limits);
  scene.meshes.clear();
  check_kind(file, arguments.output);
  Result result;
  if (arguments.remove) {
    result = remove(arguments, file);
  } else {
    progress.update(0.5, "reading " + arguments.asset);
    const format::FileMemory memory =
        format::FileMemory::load(arguments.asset, format::FileMemory::Mode::read);
    result = attach(arguments, file, scene, memory);
  }
  progress.finish();
  print_notes(result.notes, arguments.quiet);
  if (arguments.json || !arguments.quiet) print(arguments, result);
}

}  // namespace

void add_attach(Command app) {
  const Command command =
      app.add_subcommand("attach", "Make a baked asset part of the glTF that it was baked from");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command.add_option("GLTF", a.gltf, "The .glb or .gltf file to attach the asset to").required();
  command.add_option("ASSET", a.asset, "The .nif file that was baked from it");
  command.add_option("-o,--output", a.output, "The file to write: .glb or .gltf, like the input").required();
  command.add_flag(
      "--reference", a.reference,
      "Refer to the asset by a relative URI instead of copying it into the .glb; a .gltf always does");
  command.add_flag("--force", a.force,
                   "Accept an asset that was baked from another file, and match nodes by their names");
  command.add_flag("--remove", a.remove,
                   "Remove an attached asset: the file becomes byte for byte what it was before");
  add_json_option(command, a.json, kSchema);
  add_quiet_option(command, a.quiet);
  command.footer(
      "The asset is attached with the glTF extension NIF_visibility (docs/gltf-extension.md), which other "
      "programs\n"
      "ignore. Nothing else in the file changes. An asset that is already attached is replaced. nif bake "
      "ignores an\n"
      "attached asset.\n"
      "Examples:\n"
      "  nif bake crate.glb -o crate.nif && nif attach crate.glb crate.nif -o both.glb\n"
      "  nif attach hall.gltf hall.nif -o hall_nif.gltf       # refers to hall.nif\n"
      "  nif attach both.glb --remove -o crate.glb");
  command.callback([arguments] { run(*arguments); });
}

}  // namespace nif::tools
