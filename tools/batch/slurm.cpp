// Writes a list of assets and a shell script for each class of need, and submits them with sbatch. The last
// job depends on all others. Memory and time limits come from needs_of() in baking.hpp.
#include "tools/batch/slurm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <map>
#include <thread>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "tools/batch/record.hpp"
#include "tools/common/child.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kGigabyte = 1'000'000'000;

/// Quotes a text as one shell word.
std::string quoted(const std::string& text) {
  std::string word = "'";
  for (char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

/// sbatch expands patterns that start with a per cent sign in file names.
std::string without_patterns(const std::string& path) {
  std::string text;
  for (char c : path) text += c == '%' ? std::string("%%") : std::string(1, c);
  return text;
}

void write_script(const fs::path& path, const std::string& text) {
  write_output(path.string(), std::as_bytes(std::span(text)));
}

/// Runs a program of Slurm and returns what it prints.
std::string ask(const std::vector<std::string>& words) {
  Child child(words, words.front());
  std::optional<int> code;
  while (!(code = child.ended())) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  if (*code == Child::kNoProgram)
    throw Error(Status::farm_failed,
                fmt::format("{} is not on the PATH: submit from a machine of a Slurm cluster, or use nif "
                            "bake --manifest --shard i/n with another scheduler",
                            words.front()));
  std::string text = *code == 0 ? child.out() : child.err();
  while (text.ends_with('\n')) text.pop_back();
  if (*code != 0) throw Error(Status::farm_failed, fmt::format("{} failed: {}", words.front(), text));
  return text;
}

/// A new folder: run-1, run-2, ...
fs::path new_folder(const fs::path& state) {
  std::error_code problem;
  fs::create_directories(state / "farm", problem);
  for (int number = 1; !problem; ++number) {
    const fs::path folder = state / "farm" / fmt::format("run-{}", number);
    if (fs::create_directory(folder, problem)) return fs::absolute(folder);
  }
  throw Error(Status::output_not_writable,
              (state / "farm").string() + ": cannot be created: " + problem.message());
}

}  // namespace

std::vector<TaskClass> classify(const Manifest& manifest, std::span<const BatchItem> items,
                                const SlurmOptions& options) {
  const Records records(manifest);
  std::map<std::pair<uint64_t, uint32_t>, TaskClass> classes;
  for (const BatchItem& item : items) {
    if (item.reason.empty()) continue;
    const Needs needs = needs_of(item.asset, records.load(item.asset));
    const uint64_t memory = std::bit_ceil((needs.memory + kGigabyte - 1) / kGigabyte) * kGigabyte;
    const uint32_t cores = options.cores ? options.cores : memory > 4 * kGigabyte ? 4 : 1;
    TaskClass& of = classes[{memory, cores}];
    of.memory = memory;
    of.cores = cores;
    of.minutes = std::max(of.minutes, needs.minutes);
    of.names.push_back(item.asset.name);
  }
  std::vector<TaskClass> list;
  for (auto& [key, of] : classes) {
    of.tasks = uint32_t(std::min<size_t>(of.names.size(), options.most_tasks));
    of.minutes *= uint32_t((of.names.size() + of.tasks - 1) / of.tasks);
    if (options.minutes) of.minutes = options.minutes;
    list.push_back(std::move(of));
  }
  return list;
}

Submitted submit(const Manifest& manifest, std::span<const TaskClass> classes, const SlurmOptions& options) {
  ask({"sbatch", "--version"});  // checks for Slurm before anything is written
  Submitted jobs;
  jobs.folder = new_folder(manifest.state);
  const std::string nif = quoted(fs::read_symlink("/proc/self/exe").string()),
                    manifest_file = quoted(fs::absolute(manifest.file).string());
  const auto sbatch = [&](std::vector<std::string> words, const fs::path& script) {
    words.insert(words.begin(), {"sbatch", "--parsable", "--chdir=" + fs::current_path().string(),
                                 "--requeue", "--open-mode=append"});
    words.insert(words.end(), options.sbatch.begin(), options.sbatch.end());
    words.push_back(script.string());
    const std::string said = ask(words);  // "17", or "17;cluster"
    return said.substr(0, said.find(';'));
  };
  const std::string name = "nif-" + fs::path(manifest.file).stem().string();
  try {
    for (size_t i = 0; i < classes.size(); ++i) {
      const TaskClass& of = classes[i];
      const fs::path stem = jobs.folder / fmt::format("class-{}", i);
      std::string list;
      for (const std::string& asset : of.names) list += asset + '\n';
      write_script(stem.string() + ".txt", list);
      // A task that Slurm restarts continues where it was, and its summary replaces the earlier one.
      write_script(
          stem.string() + ".sh",
          fmt::format(
              "#!/bin/sh\nout={}\"$SLURM_ARRAY_TASK_ID\"\n{} bake --manifest {} --outputs {} --shard "
              "\"$((SLURM_ARRAY_TASK_ID + 1))/{}\" --threads {} --memory {} --keep-going --json --quiet "
              ">\"$out.new\"\ncode=$?\nmv \"$out.new\" \"$out.json\"\nexit $code\n",
              quoted(stem.string() + "-"), nif, manifest_file, quoted(stem.string() + ".txt"), of.tasks,
              of.cores, of.memory));
      jobs.arrays.push_back(sbatch(
          {"--job-name=" + name, fmt::format("--array=0-{}", of.tasks - 1),
           fmt::format("--mem={}M", of.memory / 1'000'000), fmt::format("--cpus-per-task={}", of.cores),
           fmt::format("--time={}", of.minutes), "--output=" + without_patterns(stem.string()) + "-%a.log"},
          stem.string() + ".sh"));
    }
    const fs::path script = jobs.folder / "merge.sh", out = jobs.folder / "summary.json";
    std::string report;
    if (!options.report.empty()) report = " --report " + quoted(fs::absolute(options.report).string());
    write_script(
        script,
        fmt::format("#!/bin/sh\n{} farm {} --merge {}/class-*.json --json --quiet{} >{}\ncode=$?\nmv {} {}\n"
                    "exit $code\n",
                    nif, manifest_file, quoted(jobs.folder.string()), report, quoted(out.string() + ".new"),
                    quoted(out.string() + ".new"), quoted(out.string())));
    std::string after = "--dependency=afterany";
    for (const std::string& job : jobs.arrays) after += ":" + job;
    jobs.merge = sbatch({"--job-name=" + name + "-merge", after, "--mem=2000M", "--time=60",
                         "--output=" + without_patterns((jobs.folder / "merge.log").string())},
                        script);
  } catch (const Error&) {
    for (const std::string& job : jobs.arrays) {
      try {
        ask({"scancel", job});
      } catch (const Error&) {  // the user needs to know what was refused first
      }
    }
    throw;
  }
  return jobs;
}

}  // namespace nif::tools
