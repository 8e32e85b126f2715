// The order of steps: read the manifest, plan, refuse outputs that would overwrite an input, bake, then
// write the dependency file and the report. Also escapes file names for make.
#include "tools/batch/batch_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <set>
#include <string_view>

#include "formats/base/output_file.hpp"
#include "formats/base/printable.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "tools/batch/baking.hpp"
#include "tools/batch/batch_report.hpp"
#include "tools/common/amounts.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/progress.hpp"

namespace nif::tools {
namespace {

/// "2/8" means the second of eight parts.
void parse_shard(const std::string& text, BatchOptions& options) {
  unsigned number = 0, count = 0;
  int used = 0;
  if (std::sscanf(text.c_str(), "%9u/%9u%n", &number, &count, &used) != 2 || size_t(used) != text.size() ||
      number < 1 || number > count)
    throw Error(Status::usage,
                fmt::format("--shard '{}' is not a valid part: write i/n, e.g. 1/8 to 8/8", text));
  options.shard = number - 1;
  options.shards = count;
}

/// Throws nif::Error if the file cannot be read or lists nothing.
std::set<std::string> lines_of(const std::string& file) {
  const mesh::detail::ByteBuffer text = mesh::detail::load_file(file, 64 << 20);
  std::set<std::string> lines;
  for (std::string_view rest = text.view(); !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    if (!line.empty()) lines.emplace(line);
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
  }
  if (lines.empty()) throw Error(Status::file_empty, file + ": lists no outputs");
  return lines;
}

void print_plan(std::span<const BatchItem> items) {
  size_t stale = 0;
  for (const BatchItem& item : items) {
    if (item.reason.empty()) continue;
    ++stale;
    fmt::print("{} from {}: {}\n", item.asset.output, item.asset.mesh, item.reason);
  }
  fmt::print("{} of {} would be baked\n", stale, count_of(items.size(), "asset"));
}

/// Everything that the outputs depend on, including the manifest itself.
std::vector<std::string> files_of(const Manifest& manifest, std::span<const BatchItem> items) {
  std::set<std::string> files;
  for (const BatchItem& item : items) {
    files.insert(item.asset.mesh);
    if (!item.report.is_object()) continue;
    for (const auto& source : item.report.value("sources", nlohmann::ordered_json::array()))
      files.insert(source.get<std::string>());
  }
  files.erase(manifest.file);
  std::vector<std::string> list{manifest.file};
  list.insert(list.end(), files.begin(), files.end());
  return list;
}

std::filesystem::path own_name(const std::string& path) {
  return std::filesystem::absolute(path).lexically_normal();
}

void write_text(const std::string& path, const std::string& text) {
  write_output(path, std::as_bytes(std::span(text)));
}

}  // namespace

const char* BatchArguments::first_given() const {
  return !memory.empty()    ? "--memory"
         : !shard.empty()   ? "--shard"
         : !outputs.empty() ? "--outputs"
         : dry_run          ? "--dry-run"
         : keep_going       ? "--keep-going"
         : force            ? "--force"
                            : nullptr;
}

void add_batch_options(Command command, BatchArguments& arguments) {
  command.add_option(
      "--manifest", arguments.manifest,
      "Bake all assets listed in this TOML file that have changed (docs/batches.md), instead of MESH");
  command.add_option("--memory", arguments.memory,
                     "With --manifest: memory for all bakes that run at the same time, e.g. 8GB (default: "
                     "four fifths of the free memory)");
  command.add_option(
      "--report", arguments.report,
      "Also write an HTML page to this file: pictures, where answers are wrong, sizes, and settings; "
      "with --manifest a table of all assets, each with a picture");
  command.add_option(
      "--shard", arguments.shard,
      "With --manifest: bake only part i of n, written i/n, e.g. 2/8, to share the work between machines");
  command.add_option("--outputs", arguments.outputs,
                     "With --manifest: bake only the outputs listed in this text file, one per line, "
                     "relative to the manifest's folder");
  command.add_flag("--dry-run", arguments.dry_run,
                   "With --manifest: print what would be baked and why, but bake nothing");
  command.add_flag("--keep-going", arguments.keep_going,
                   "With --manifest: if one asset fails, bake the others");
  command.add_flag("--force", arguments.force, "With --manifest: also bake assets that are up to date");
}

void run_batch(const BatchArguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  BatchOptions options;
  options.threads = arguments.threads;
  options.keep_going = arguments.keep_going;
  options.force = arguments.force;
  if (!arguments.memory.empty()) options.memory = parse_bytes(arguments.memory, "--memory");
  if (!arguments.shard.empty()) parse_shard(arguments.shard, options);
  if (!arguments.outputs.empty()) options.only = lines_of(arguments.outputs);
  for (const std::string& path : {arguments.report, arguments.depfile})
    if (!path.empty()) check_output(path);
  interruption();
  Progress progress(arguments.quiet);
  const auto show = [&](double fraction, const std::string& text) { progress.update(fraction, text); };
  progress.update(0, "reading " + arguments.manifest);
  const Manifest manifest = read_manifest(arguments.manifest);
  std::vector<BatchItem> items = plan(manifest, options);
  const std::vector<std::string> read = files_of(manifest, items);
  std::set<std::filesystem::path> written;
  for (const BatchItem& item : items) written.insert(own_name(item.asset.output));
  for (const std::string& path : {arguments.report, arguments.depfile}) {
    if (path.empty()) continue;
    for (const std::string& file : read) refuse_overwriting(file, path);
    if (!written.insert(own_name(path)).second)
      throw Error(Status::usage, path + ": two outputs cannot be the same file");
  }
  if (arguments.dry_run) {
    progress.finish();
    if (arguments.json)
      write_json(to_json(manifest, items, 0));
    else
      print_plan(items);
    return;
  }
  bake_batch(manifest, options, items, show);
  if (!arguments.depfile.empty()) {
    std::vector<std::string> outputs;
    for (const BatchItem& item : items) outputs.push_back(item.asset.output);
    write_text(arguments.depfile, dependency_rule(outputs, files_of(manifest, items)));
  }
  if (!arguments.report.empty()) {
    make_thumbnails(manifest, items, show);
    write_text(arguments.report, to_html(manifest, items));
  }
  progress.finish();

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const BatchItem* first_failed = nullptr;
  size_t counts[4] = {};
  for (const BatchItem& item : items) {
    ++counts[size_t(item.outcome)];
    if (item.outcome != BatchItem::Outcome::failed) continue;
    if (first_failed)
      fmt::print(stderr, "nif: {}\n", printable(item.error));
    else
      first_failed = &item;
  }
  if (arguments.json) {
    write_json(to_json(manifest, items, seconds));
  } else if (!arguments.quiet) {
    fmt::print("{}: {}: {} baked, {} up to date", manifest.file, count_of(items.size(), "asset"),
               counts[size_t(BatchItem::Outcome::baked)], counts[size_t(BatchItem::Outcome::current)]);
    if (first_failed) fmt::print(", {} failed", counts[size_t(BatchItem::Outcome::failed)]);
    if (counts[size_t(BatchItem::Outcome::left)])
      fmt::print(", {} not started after that; --keep-going bakes them",
                 counts[size_t(BatchItem::Outcome::left)]);
    fmt::print("; {:.1f} s\n", seconds);
  }
  if (first_failed) throw failure_of(*first_failed);
}

std::string dependency_rule(const std::vector<std::string>& targets, const std::vector<std::string>& files) {
  std::string rule;
  const auto add = [&](const std::string& path) {
    // Characters that would end the rule or begin a command in it. A mesh may refer to files with any names.
    for (const char c : path)
      if (c == ';' || c == 0x7f || (c >= 0 && c < ' '))
        throw Error(Status::usage,
                    fmt::format("--depfile: a makefile cannot contain the file name '{}'", printable(path)));
    for (char c : path) {
      if (c == ' ' || c == '#' || c == '\\') rule += '\\';
      if (c == '$') rule += '$';
      rule += c;
    }
  };
  for (const std::string& target : targets) {
    if (!rule.empty()) rule += ' ';
    add(target);
  }
  rule += ':';
  for (const std::string& file : files) {
    rule += " \\\n  ";
    add(file);
  }
  return rule + '\n';
}

}  // namespace nif::tools
