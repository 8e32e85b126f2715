// The scheduler: starts one `nif bake` process for each asset as long as threads and estimated memory
// suffice, and stores a record when one is done. If a source changed during its bake, the bake counts as
// failed.
#include "tools/batch/baking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <list>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "formats/base/file_name.hpp"
#include "formats/base/status.hpp"
#include "formats/base/temporaries.hpp"
#include "tools/batch/claims.hpp"
#include "tools/batch/record.hpp"
#include "tools/common/child.hpp"
#include "tools/common/interruption.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Memory of a process that has loaded nothing to bake yet.
constexpr uint64_t kLeastMemory = 400'000'000;

/// Memory that is available without swapping, or no limit if the system does not report it.
uint64_t free_memory() {
  std::ifstream file("/proc/meminfo");
  std::string name, unit;
  for (uint64_t kilobytes; file >> name >> kilobytes; std::getline(file, unit))
    if (name == "MemAvailable:") return kilobytes * 1024;
  return UINT64_MAX;
}

/// The last line, without the program's name in front.
std::string sentence_of(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  text = text.substr(text.rfind('\n') + 1);
  constexpr std::string_view kProgram = "nif: ";
  return text.starts_with(kProgram) ? text.substr(kProgram.size()) : text;
}

fs::file_time_type change_of(const fs::path& file) {
  std::error_code problem;
  const auto time = fs::last_write_time(file, problem);
  return problem ? fs::file_time_type::max() : time;
}

/// A bake that is running.
struct Bake {
  BatchItem* item;
  uint32_t threads;
  uint64_t memory;
  fs::file_time_type started;
  /// Of the files that it is known to read, taken before it started.
  std::map<std::string, std::string> stamps;
  std::unique_ptr<Child> child;
};

class Batch {
 public:
  Batch(const Manifest& manifest, const BatchOptions& options)
      : manifest_(manifest),
        options_(options),
        records_(manifest),
        threads_(options.threads ? options.threads : std::max(1u, std::thread::hardware_concurrency())),
        memory_(options.memory ? options.memory : free_memory() / 5 * 4) {}

  void run(std::vector<BatchItem>& items, const std::function<void(double, const std::string&)>& progress) {
    const std::atomic<bool>& cancel = interruption();
    std::list<BatchItem*> waiting;
    for (BatchItem& item : items)
      if (!item.reason.empty()) waiting.push_back(&item);
    const size_t all = waiting.size();
    size_t done = 0;
    remove_left_overs();
    if (all) {
      make_folder(manifest_.state);
      claims_.emplace(manifest_);
    }
    while (!waiting.empty() || !running_.empty()) {
      if (cancel) stop_all();
      if (stopped_) waiting.clear();
      done += start_some(waiting);
      if (running_.empty() && waiting.empty()) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(running_.empty() ? 50 : 5));
      for (auto bake = running_.begin(); bake != running_.end();) {
        const std::optional<int> code = bake->child->ended();
        if (code) {
          end(*bake, *code);
          bake = running_.erase(bake);
          ++done;
        } else {
          ++bake;
        }
      }
      if (running_.empty() && !waiting.empty())
        progress(double(done) / double(all), fmt::format("{} of {}; another process is baking {}", done, all,
                                                         waiting.front()->asset.name));
      if (!running_.empty())
        progress(double(done) / double(all),
                 fmt::format("{} of {}; baking {}{}", done, all, running_.front().item->asset.name,
                             running_.size() > 1 ? fmt::format(" and {} more", running_.size() - 1) : ""));
    }
    if (cancel)
      throw Error(Status::interrupted,
                  "the batch was cancelled; finished assets are kept, and the next run continues");
  }

 private:
  /// Removes temporaries also for assets that are up to date: an earlier run may have been killed while it
  /// baked them.
  void remove_left_overs() const {
    std::set<fs::path> folders, targets;
    for (const BatchAsset& asset : manifest_.assets) {
      folders.insert(fs::path(asset.output).parent_path());
      targets.insert({asset.output, asset.output + ".checkpoint"});
    }
    for (const fs::path& folder : folders)
      remove_abandoned(folder, [&](const std::string& name) { return targets.contains(folder / name); });
    remove_abandoned(manifest_.state, [](const std::string&) { return true; });
  }

  void make_folder(const fs::path& folder) {
    std::error_code problem;
    fs::create_directories(folder.empty() ? "." : folder, problem);
    if (problem)
      throw Error(Status::output_not_writable, folder.string() + ": cannot be created: " + problem.message());
  }

  /// Starts as many bakes as there is room for. Returns how many assets turned out to need none.
  size_t start_some(std::list<BatchItem*>& waiting) {
    size_t done = 0;
    for (size_t tries = waiting.size(); tries > 0 && !stopped_; --tries) {
      BatchItem& item = *waiting.front();
      const size_t running = running_.size();
      if (!claims_->claim(item.asset)) {  // another process bakes it: look again later
        waiting.splice(waiting.end(), waiting, waiting.begin());
        continue;
      }
      const bool settled = is_done_by_another(item) || start(item, waiting.size());
      const bool started = running_.size() > running;
      if (!started) claims_->release(item.asset);
      if (!settled) break;
      waiting.pop_front();
      done += !started;
    }
    return done;
  }

  /// Whether another process has baked the asset since the plan was made.
  bool is_done_by_another(BatchItem& item) {
    const std::string seen = std::exchange(item.record, records_.version_of(item.asset));
    if (options_.force || seen == item.record) return false;
    const std::optional<BakeRecord> record = records_.load(item.asset);
    if (!records_.why_stale(item.asset, record).empty()) return false;
    item.outcome = BatchItem::Outcome::current;
    item.report = record->report;
    return true;
  }

  /// Returns false if the asset has to wait for threads or memory. `waiting` is the number of assets from
  /// this one on.
  bool start(BatchItem& item, size_t waiting) {
    uint32_t free_threads = threads_;
    uint64_t taken = 0;
    for (const Bake& bake : running_) {
      free_threads -= std::min(free_threads, bake.threads);
      taken += bake.memory;
    }
    if (free_threads == 0) return false;
    // If nothing else runs, the asset is baked, whatever it needs.
    const std::optional<BakeRecord> record = records_.load(item.asset);
    const uint64_t memory = needs_of(item.asset, record).memory;
    if (!running_.empty() && (taken > memory_ || memory > memory_ - taken)) return false;

    const auto threads =
        uint32_t(std::max<size_t>(1, free_threads / std::min<size_t>(waiting, free_threads)));
    try {
      make_folder(fs::path(item.asset.output).parent_path());
    } catch (const Error& error) {
      fail(item, int(error.status()), error.what());
      return true;
    }
    // A file name may begin with a dash, like an option.
    const auto word = [](const std::string& name) { return name.starts_with('-') ? "./" + name : name; };
    std::vector<std::string> arguments{"bake",
                                       word(item.asset.mesh),
                                       "-o",
                                       word(item.asset.output),
                                       "--json",
                                       "--quiet",
                                       "--resume-if-possible",
                                       fmt::format("--threads={}", threads)};
    arguments.insert(arguments.end(), item.asset.options.begin(), item.asset.options.end());
    Bake bake{&item, threads, memory, fs::file_time_type::clock::now(), {}, nullptr};
    bake.stamps[item.asset.mesh] = stamp_of(item.asset.mesh);
    if (record && record->report.contains("sources"))
      for (const Json& source : record->report["sources"])
        bake.stamps[source.get<std::string>()] = stamp_of(source.get<std::string>());
    bake.child = std::make_unique<Child>(arguments);
    running_.push_back(std::move(bake));
    return true;
  }

  void end(Bake& bake, int code) {
    BatchItem& item = *bake.item;
    const Released released{*claims_, item.asset};
    if (interruption()) return;
    if (code != 0) {
      const std::string sentence = sentence_of(bake.child->err());
      return fail(item, code,
                  !sentence.empty() ? sentence
                  : code > 128      ? fmt::format("its bake was killed by signal {}", code - 128)
                                    : fmt::format("its bake failed with exit code {}", code));
    }
    try {
      Json report = Json::parse(bake.child->out());
      for (const Json& source : report.at("sources"))
        if (has_changed(bake, source.get<std::string>()))
          throw Error(Status::file_unreadable, fmt::format("{}: changed while it was baked; bake it again",
                                                           source.get<std::string>()));
      const BakeRecord record = records_.make(item.asset, std::move(report));
      records_.store(item.asset, record);
      std::error_code ignored;
      fs::remove(records_.path_for(item.asset, ".png"), ignored);
      item.report = record.report;
      item.outcome = BatchItem::Outcome::baked;
    } catch (const Error& error) {
      fail(item, int(error.status()), error.what());
    } catch (const Json::exception&) {
      fail(item, int(Status::internal), "its bake printed no report");
    }
  }

  static bool has_changed(const Bake& bake, const std::string& file) {
    const auto known = bake.stamps.find(file);
    if (known != bake.stamps.end()) return known->second != stamp_of(file);
    // The file was not known to be a source before the bake, so its time decides.
    const auto time = change_of(file);
    // some files have a time in the future
    return time >= bake.started && time <= fs::file_time_type::clock::now();
  }

  /// Releases the claim at the end of a scope.
  struct Released {
    Claims& claims;
    const BatchAsset& asset;
    ~Released() { claims.release(asset); }
  };

  void fail(BatchItem& item, int code, const std::string& sentence) {
    item.outcome = BatchItem::Outcome::failed;
    item.code = code;
    item.error = sentence;
    if (!options_.keep_going) stopped_ = true;
  }

  void stop_all() {
    stopped_ = true;
    for (Bake& bake : running_) bake.child->stop();
  }

  const Manifest& manifest_;
  const BatchOptions& options_;
  Records records_;
  std::optional<Claims> claims_;
  uint32_t threads_;
  uint64_t memory_;
  std::list<Bake> running_;
  bool stopped_ = false;
};

}  // namespace

const char* name_of(BatchItem::Outcome outcome) {
  switch (outcome) {
    case BatchItem::Outcome::current:
      return "current";
    case BatchItem::Outcome::baked:
      return "baked";
    case BatchItem::Outcome::failed:
      return "failed";
    case BatchItem::Outcome::left:
      return "left";
  }
  return "";
}

Error failure_of(const BatchItem& item) {
  return {item.code > 0 && item.code < 128 ? Status(item.code) : Status::internal, item.error};
}

std::vector<BatchItem> plan(const Manifest& manifest, const BatchOptions& options) {
  const Records records(manifest);
  const std::atomic<bool>& cancel = interruption();
  std::vector<BatchItem> items;
  std::set<std::string> unknown = options.only;
  for (const BatchAsset& asset : manifest.assets) unknown.erase(asset.name);
  if (!unknown.empty())
    throw Error(Status::malformed_manifest,
                fmt::format("{}: has no output '{}'", manifest.file, *unknown.begin()));
  size_t number = 0;
  for (const BatchAsset& asset : manifest.assets) {
    if (!options.only.empty() && !options.only.contains(asset.name)) continue;
    if (number++ % options.shards != options.shard) continue;
    if (cancel) throw Error(Status::interrupted, "the batch was cancelled");
    BatchItem& item = items.emplace_back();
    item.asset = asset;
    item.record = records.version_of(item.asset);
    const std::optional<BakeRecord> record = records.load(item.asset);
    item.reason = records.why_stale(item.asset, record);
    if (item.reason.empty() && options.force) item.reason = "--force";
    if (!item.reason.empty()) continue;
    item.outcome = BatchItem::Outcome::current;
    item.report = record->report;
  }
  return items;
}

void bake_batch(const Manifest& manifest, const BatchOptions& options, std::vector<BatchItem>& items,
                const std::function<void(double, const std::string&)>& progress) {
  Batch(manifest, options).run(items, progress);
}

Needs needs_of(const BatchAsset& asset, const std::optional<BakeRecord>& last) {
  if (last && last->options == asset.options && last->report.contains("peak_memory")) {
    const double seconds = last->report.value("seconds", 0.0);
    return {last->report["peak_memory"].get<uint64_t>() / 5 * 6, uint32_t(5 + seconds * 3 / 60)};
  }
  std::error_code problem;
  uint64_t size = fs::file_size(asset.mesh, problem);
  if (problem) size = 0;
  const fs::path name = unpacked_name(asset.mesh);
  const bool packed = name != fs::path(asset.mesh).filename();
  // Baking takes some 500 bytes per triangle. A triangle takes 20 bytes in binary PLY, not much less in the
  // other formats, and some 2 in Draco.
  uint64_t factor = ending_of(name) == ".drc" ? 250 : 25;
  if (packed) factor *= 3;
  const uint64_t memory = kLeastMemory + size * factor;
  return {memory, uint32_t(15 + memory / 200'000'000)};
}

}  // namespace nif::tools
