// `nif farm`: bakes a manifest on a cluster.
#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "formats/base/json_text.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "tools/batch/baking.hpp"
#include "tools/batch/batch_report.hpp"
#include "tools/batch/slurm.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "nifkit.farm/1";

struct Arguments {
  std::string manifest;
  bool slurm = false;
  std::vector<std::string> merge;
  SlurmOptions options;
  bool dry_run = false, json = false, quiet = false;
};

std::string describe(const TaskClass& of) {
  return fmt::format("{}, {}, at most {} and {} minutes each", count_of(of.names.size(), "asset"),
                     count_of(of.tasks, "task"), format_bytes(double(of.memory)), of.minutes) +
         fmt::format(", {}", count_of(of.cores, "core"));
}

void run_slurm(const Arguments& arguments) {
  if (!arguments.options.report.empty()) check_output(arguments.options.report);
  const Manifest manifest = read_manifest(arguments.manifest);
  const std::vector<BatchItem> items = plan(manifest, {});
  const std::vector<TaskClass> classes = classify(manifest, items, arguments.options);
  if (classes.empty() || arguments.dry_run) {
    for (const TaskClass& of : classes) fmt::print("{}\n", describe(of));
    if (classes.empty())
      fmt::print("{}: all of {} up to date\n", manifest.file, count_of(items.size(), "asset"));
    return;
  }
  const Submitted jobs = submit(manifest, classes, arguments.options);
  if (arguments.json) {
    write_json(Json{{"schema", kSchema},
                    {"manifest", manifest.file},
                    {"arrays", jobs.arrays},
                    {"merge", jobs.merge},
                    {"summary", (jobs.folder / "summary.json").string()}});
    return;
  }
  for (size_t i = 0; i < classes.size(); ++i)
    fmt::print("job {}: {}\n", jobs.arrays[i], describe(classes[i]));
  fmt::print("job {} writes the summary after them, to {}\n", jobs.merge,
             (jobs.folder / "summary.json").string());
}

/// What the summaries of the tasks report about each failed or baked asset, by output.
std::map<std::string, Json> read_summaries(const std::vector<std::string>& files) {
  std::map<std::string, Json> assets;
  for (const std::string& file : files) {
    try {
      const mesh::detail::ByteBuffer text = mesh::detail::load_file(file, uint64_t{1} << 30);
      if (too_large_at(text.view(), kMostOrderedMembers) != std::string_view::npos)
        throw Error(
            Status::malformed_manifest,
            file + ": is not a batch summary: it is nested too deep, or an object has too many members");
      const Json summary = Json::parse(text.view());
      if (summary.at("schema") != kBatchSchema)
        throw Error(Status::malformed_manifest, file + ": is not a batch summary");
      for (const Json& asset : summary.at("assets")) {
        const std::string outcome = asset.at("outcome");
        if (outcome == "baked" || outcome == "failed")
          assets
              [std::filesystem::absolute(asset.at("output").get<std::string>()).lexically_normal().string()] =
                  asset;
      }
    } catch (const Json::exception& problem) {
      throw Error(Status::malformed_manifest,
                  fmt::format("{}: is not a batch summary: {}", file, problem.what()));
    }
  }
  return assets;
}

void run_merge(const Arguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  if (!arguments.options.report.empty()) check_output(arguments.options.report);
  Progress progress(arguments.quiet);
  const Manifest manifest = read_manifest(arguments.manifest);
  const std::map<std::string, Json> assets = read_summaries(arguments.merge);
  std::vector<BatchItem> items = plan(manifest, {});
  size_t lost = 0;
  const BatchItem* first_failed = nullptr;
  for (BatchItem& item : items) {
    const auto said = assets.find(std::filesystem::absolute(item.asset.output).lexically_normal().string());
    const bool known = said != assets.end();
    const bool baked = known && said->second.at("outcome") == "baked";
    if (item.reason.empty()) {
      if (baked) item.outcome = BatchItem::Outcome::baked;
    } else if (known && !baked) {
      item.outcome = BatchItem::Outcome::failed;
      item.code = said->second.value("code", 1);
      item.error = said->second.value("error", "");
      if (!first_failed) first_failed = &item;
    } else {
      ++lost;
    }
  }
  if (!arguments.options.report.empty()) {
    make_thumbnails(manifest, items,
                    [&](double fraction, const std::string& text) { progress.update(fraction, text); });
    const std::string html = to_html(manifest, items);
    write_output(arguments.options.report, std::as_bytes(std::span(html)));
  }
  progress.finish();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Json summary = to_json(manifest, items, seconds);
  if (arguments.json) {
    write_json(summary);
  } else {
    fmt::print("{}: {}: {} baked, {} up to date, {} failed, {} not baked\n", manifest.file,
               count_of(items.size(), "asset"), summary["baked"].get<size_t>(),
               summary["current"].get<size_t>(), summary["failed"].get<size_t>(), lost);
  }
  if (first_failed) throw failure_of(*first_failed);
  if (lost)
    throw Error(Status::farm_failed,
                fmt::format("{}: {} not baked, because tasks were lost; submit again to continue",
                            manifest.file, count_of(lost, "asset")));
}

}  // namespace

void add_farm(Command app) {
  const Command command = app.add_subcommand("farm", "Bake a manifest on a cluster");
  auto a = std::make_shared<Arguments>();
  command.add_option("MANIFEST", a->manifest, "The manifest, as for nif bake --manifest (docs/batches.md)")
      .required();
  const Option slurm = command.add_flag(
      "--slurm", a->slurm,
      "Submit the assets that have changed to Slurm, as array jobs and a final job for the summary");
  const Option merge = command.add_option(
      "--merge", a->merge,
      "Combine the --json outputs of a manifest's parts, in these files, into one summary");
  slurm.excludes(merge);
  command.add_option("--cores", a->options.cores, "Cores per task (default: 1, and 4 for large meshes)")
      .range(1u, 1024u);
  command
      .add_option(
          "--time", a->options.minutes,
          "Time limit per task in minutes (default: three times the last bake, or by the mesh's size)")
      .range(1u, 1'000'000u);
  command
      .add_option("--most-tasks", a->options.most_tasks,
                  "Most tasks of an array job; with more assets, tasks bake several")
      .range(1u, 1'000'000u)
      .capture_default_str();
  command
      .add_option("--sbatch", a->options.sbatch,
                  "An extra option for sbatch, e.g. --sbatch=--partition=night; may be repeated")
      .one_word_each();
  command.add_option("--report", a->options.report,
                     "Also write an HTML report with a picture of each asset to this file");
  command.add_flag("--dry-run", a->dry_run,
                   "With --slurm: print what would be submitted, but submit nothing");
  add_json_option(command, a->json, fmt::format("{}; with --merge {}", kSchema, kBatchSchema));
  add_quiet_option(command, a->quiet);
  command.footer(
      "Examples:\n"
      "  nif farm library.toml --slurm --sbatch=--partition=night --report library.html\n"
      "  nif farm library.toml --merge part1.json part2.json");
  command.callback([a] {
    if (a->slurm) return run_slurm(*a);
    if (!a->merge.empty()) return run_merge(*a);
    throw Error(Status::usage, "give --slurm or --merge; see --help");
  });
}

}  // namespace nif::tools
