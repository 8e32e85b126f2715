// Checks options by parsing them as `nif bake` does, and expands patterns to files. Paths are compared in
// canonical form, so that an output that is also a mesh is found however it is spelt.
#include "tools/batch/manifest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "formats/base/file_name.hpp"
#include "formats/base/printable.hpp"
#include "formats/base/status.hpp"
#include "formats/base/utf8.hpp"
#include "tools/batch/manifest_glob.hpp"
#include "tools/common/bake_options.hpp"
#include "tools/common/options.hpp"
#include "tools/common/toml_table.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOutput = "{folder}/{stem}.nif";

/// Maps an option's name to its value in the manifest, or to several words if it may be repeated.
using Words = std::vector<std::string>;
using Options = std::map<std::string, Words>;
/// Maps a placeholder's name to its replacement.
using Values = std::map<std::string, std::string>;

/// The options of `nif bake` that a manifest may set: those that decide an asset's bytes.
class BakeCommand {
 public:
  BakeCommand() { add_bake_options(command_, arguments_); }

  std::vector<std::string> names() { return command_.names(); }
  bool is_repeatable(const std::string& name) const { return command_.is_repeatable("--" + name); }

  /// Returns the options as arguments. Throws if they are invalid.
  std::vector<std::string> checked(const Options& options) {
    std::vector<std::string> words;
    for (const auto& [name, values] : options) {
      const bool flag = command_.is_flag("--" + name);
      if (flag && values != Words{"true"} && values != Words{"false"})
        throw Error(Status::usage, fmt::format("--{} must be true or false", name));
      for (const std::string& value : values)
        if (!flag || value == "true")
          words.push_back(flag ? "--" + name : fmt::format("--{}={}", name, value));
    }
    arguments_ = {};
    command_.parse(words);
    resolve_options(arguments_);
    return words;
  }

 private:
  BakeArguments arguments_;
  OwnCommand command_;
};

/// The file name without its format endings: "dragon" for "dragon.ply.gz".
std::string stem_of(const fs::path& file) { return unpacked_name(file).stem().string(); }

/// The pattern with {name} replaced by its value; nothing if there is no such value.
std::optional<std::string> filled_in(std::string_view pattern, const Values& values) {
  std::string text;
  while (!pattern.empty()) {
    const size_t open = pattern.find_first_of("{}");
    text += pattern.substr(0, open);
    if (open == std::string::npos) break;
    const size_t close = pattern.find('}', open);
    if (pattern[open] == '}' || close == std::string::npos) return std::nullopt;
    const auto value = values.find(std::string(pattern.substr(open + 1, close - open - 1)));
    if (value == values.end()) return std::nullopt;
    text += value->second;
    pattern.remove_prefix(close + 1);
  }
  return text;
}

/// The canonical path, with links resolved. The part that does not exist yet stays as it is spelt.
fs::path own_path(const fs::path& path) {
  const fs::path absolute = fs::absolute(path);
  std::error_code problem;
  const fs::path result = fs::weakly_canonical(absolute, problem);
  return problem ? absolute.lexically_normal() : result;
}

class ManifestReader {
 public:
  explicit ManifestReader(const std::string& file)
      : folder_(fs::path(file).parent_path()), own_folder_(own_path(folder_.empty() ? "." : folder_)) {
    manifest_.file = file;
    for (const std::string& name : command_.names()) option_names_.insert(name);
  }

  Manifest read() {
    const toml::table root = read_toml(manifest_.file, Status::malformed_manifest);
    TomlTable table(manifest_.file, "", root, Status::malformed_manifest);
    output_ = table.text("output", kOutput);
    manifest_.state = folder_ / table.text("state", ".nif-batch");
    table.table("defaults", [&](TomlTable& t) { defaults_ = options_of(t); });
    if (!table.has("asset")) table.fail("asset", "is missing: add an [[asset]] for each mesh to bake");
    table.tables("asset", [&](TomlTable& t) { add(t); });
    table.finish();
    check_inputs(table);
    return std::move(manifest_);
  }

 private:
  Options options_of(TomlTable& table) const {
    Options options;
    for (const std::string& name : option_names_) {
      if (!table.has(name)) continue;
      options[name] = command_.is_repeatable(name) ? table.words(name) : Words{table.word(name)};
      if (name == "view") options[name] = {(folder_ / table.word(name)).string()};
    }
    return options;
  }

  void add(TomlTable& table) {
    Options options = defaults_;
    for (const auto& [name, values] : options_of(table)) options[name] = values;
    const std::string pattern = table.text("output", output_);
    const std::vector<std::string> meshes = table.texts("mesh"), exceptions = table.texts("exclude");
    table.finish();
    if (meshes.empty()) table.fail("mesh", "is missing: give a file or a pattern");
    std::vector<std::string> words;
    try {
      words = command_.checked(options);
    } catch (const Error& error) {
      table.fail("mesh", std::string("has invalid options: ") + error.what());
    }
    std::set<fs::path> excluded;
    for (const std::string& text : exceptions)
      for (const fs::path& file : files_matching(folder_, text)) excluded.insert(file);
    for (const std::string& text : meshes) {
      const std::vector<fs::path> files = files_matching(folder_, text);
      if (files.empty())
        table.fail(
            "mesh",
            fmt::format("{}: {}", is_pattern(text) ? "matches no file" : "names a file that does not exist",
                        text));
      for (const fs::path& mesh : files)
        if (!excluded.contains(mesh)) add(table, mesh, pattern, words);
    }
  }

  void add(TomlTable& table, const fs::path& mesh, const std::string& pattern,
           const std::vector<std::string>& words) {
    const fs::path below = mesh.lexically_relative(folder_.empty() ? fs::path() : folder_);
    const fs::path relative = below.empty() ? mesh : below;
    const Values values{{"folder", relative.has_parent_path() ? relative.parent_path().string() : "."},
                        {"stem", stem_of(mesh)},
                        {"name", mesh.filename().string()}};
    const std::optional<std::string> text = filled_in(pattern, values);
    if (!text)
      table.fail(
          "output",
          fmt::format("'{}' has an unknown placeholder; use {{folder}}, {{stem}} and {{name}}", pattern));
    const fs::path output = folder_ / *text, own = own_path(output);
    // Records and reports are JSON, which cannot hold other names.
    for (const std::string& name : {mesh.string(), output.string()})
      if (!is_utf8(name))
        table.fail("mesh", fmt::format("matches '{}', whose name is not UTF-8; rename it", printable(name)));
    const std::string name = own.lexically_relative(own_folder_).string();
    const auto [known, fresh] = outputs_.emplace(own, mesh.string());
    if (!fresh)
      table.fail("mesh", fmt::format("gives two meshes the same output: {} and {} would both become {}",
                                     known->second, mesh.string(), output.string()));
    manifest_.assets.push_back({mesh.string(), output.lexically_normal().string(), name, words});
  }

  /// A bake must not write a file that another one reads.
  void check_inputs(const TomlTable& table) const {
    for (const BatchAsset& asset : manifest_.assets) {
      const auto written = outputs_.find(own_path(asset.mesh));
      if (written != outputs_.end())
        table.fail("asset", fmt::format("contains a cycle: {} is both an output and a mesh of this manifest",
                                        asset.mesh));
    }
    const auto written = outputs_.find(own_path(manifest_.file));
    if (written != outputs_.end())
      table.fail("asset", fmt::format("makes the asset of {} be the manifest itself", written->second));
    if (manifest_.assets.empty())
      table.fail("asset", "leaves nothing to bake: everything that matches is excluded");
  }

  fs::path folder_, own_folder_;
  BakeCommand command_;
  std::set<std::string> option_names_;
  std::string output_;
  Options defaults_;
  std::map<fs::path, std::string> outputs_;  ///< output to the mesh that it is made from
  Manifest manifest_;
};

}  // namespace

Manifest read_manifest(const std::string& file) { return ManifestReader(file).read(); }

}  // namespace nif::tools
