// Compares files by size and time first, and by an XXH3 hash only if these differ. A time that was less
// than two seconds old when it was recorded proves nothing, so such a file is hashed again.
#include "tools/batch/record.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "formats/base/json_text.hpp"
#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "nifkit.batch-record/1";
/// The coarsest file systems store times in steps of two seconds.
constexpr int64_t kFresh = 2'000'000'000;

std::string hash_of(const void* bytes, size_t size) {
  const XXH128_hash_t hash = XXH3_128bits(bytes, size);
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

int64_t now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::optional<std::string> hash_of_file(const fs::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              &XXH3_freeState);
  if (!file || !state) return std::nullopt;
  XXH3_128bits_reset(state.get());
  std::vector<char> buffer(1 << 20);
  while (const size_t count = std::fread(buffer.data(), 1, buffer.size(), file.get()))
    XXH3_128bits_update(state.get(), buffer.data(), count);
  if (std::ferror(file.get())) return std::nullopt;
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

Json to_json(const FileState& state) {
  return {{"path", state.path}, {"size", state.size}, {"modified", state.modified}, {"hash", state.hash}};
}

/// An integer of the requested type. get() would convert any number, and converting 1e75 is undefined.
template <class T>
T whole(const Json& json) {
  const bool fits = std::is_unsigned_v<T> ? json.is_number_unsigned() : json.is_number_integer();
  if (!fits) throw Error(Status::file_unreadable, json.dump() + " is not a whole number");
  return json.get<T>();
}

FileState state_from(const Json& json) {
  return {json.at("path").get<std::string>(), whole<uint64_t>(json.at("size")),
          whole<int64_t>(json.at("modified")), json.at("hash").get<std::string>()};
}

/// Above what any bake takes; needs are computed from these numbers, so they must not overflow.
constexpr uint64_t kMostMemory = uint64_t{1} << 50;
constexpr double kMostSeconds = 1e9;

/// Whether the members that are read from a report later are there: the files, the time and the memory of the
/// bake.
bool is_report(const Json& report) {
  return report.is_object() && report.contains("sources") && report["sources"].is_array() &&
         std::ranges::all_of(report["sources"], &Json::is_string) &&
         (!report.contains("peak_memory") || (report["peak_memory"].is_number_unsigned() &&
                                              report["peak_memory"].get<uint64_t>() <= kMostMemory)) &&
         (!report.contains("seconds") ||
          (report["seconds"].is_number() && report["seconds"].get<double>() >= 0 &&
           report["seconds"].get<double>() <= kMostSeconds));
}

}  // namespace

std::optional<FileState> state_of(const fs::path& folder, const std::string& path, const FileState* known) {
  struct stat status {};
  const fs::path file = folder / path;
  if (stat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  FileState state{path,
                  uint64_t(status.st_size),
                  int64_t(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec,
                  {}};
  if (known && known->modified != 0 && known->size == state.size && known->modified == state.modified) {
    state.hash = known->hash;
    return state;
  }
  const int64_t before = now();
  std::optional<std::string> hash = hash_of_file(file);
  if (!hash) return std::nullopt;
  state.hash = std::move(*hash);
  if (state.modified > before - kFresh) state.modified = 0;
  return state;
}

std::string stamp_of(const fs::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return {};
  return fmt::format("{} {} {} {}.{}", status.st_dev, status.st_ino, status.st_size, status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec);
}

Records::Records(const Manifest& manifest)
    : folder_(fs::path(manifest.file).parent_path()), state_(manifest.state) {}

fs::path Records::path_for(const BatchAsset& asset, const std::string& ending) const {
  return state_ / (hash_of(asset.name.data(), asset.name.size()) + ending);
}

std::optional<BakeRecord> Records::load(const BatchAsset& asset) const {
  try {
    const mesh::detail::ByteBuffer text = mesh::detail::load_file(path_for(asset, ".json"), 64 << 20);
    const Json json = parse_untrusted<Json>(text.view());
    if (json.at("schema") != kSchema || json.at("name") != asset.name || !is_report(json.at("report")))
      return std::nullopt;
    BakeRecord record{
        json.at("version"), json.at("options"), {}, state_from(json.at("asset")), json.at("report")};
    for (const Json& source : json.at("sources")) record.sources.push_back(state_from(source));
    return record;
  } catch (const Error&) {
  } catch (const Json::exception&) {
  }
  return std::nullopt;
}

std::string Records::version_of(const BatchAsset& asset) const { return stamp_of(path_for(asset, ".json")); }

void Records::store(const BatchAsset& asset, const BakeRecord& record) const {
  Json json{{"schema", kSchema},
            {"name", asset.name},
            {"version", record.version},
            {"options", record.options},
            {"asset", to_json(record.asset)},
            {"sources", Json::array()},
            {"report", record.report}};
  for (const FileState& source : record.sources) json["sources"].push_back(to_json(source));
  const std::string text = json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  write_output(path_for(asset, ".json").string(), std::as_bytes(std::span(text)));
}

std::string Records::why_stale(const BatchAsset& asset, const std::optional<BakeRecord>& record) const {
  if (!record) return "new";
  if (record->version != NIF_VERSION_STRING)
    return fmt::format("baked by version {}, and this is {}", record->version, NIF_VERSION_STRING);
  if (record->options != asset.options) return "its options have changed";
  for (const FileState& source : record->sources) {
    const std::optional<FileState> state = state_of(folder_, source.path, &source);
    if (!state) return source.path + " is missing";
    if (state->hash != source.hash) return source.path + " has changed";
  }
  if (record->sources.empty() ||
      fs::path(asset.mesh).lexically_normal() != (folder_ / record->sources.front().path).lexically_normal())
    return "it was baked from another mesh";
  const std::optional<FileState> state = state_of(folder_, record->asset.path, &record->asset);
  if (!state) return "the asset is missing";
  if (state->hash != record->asset.hash) return "the asset has changed since its bake";
  return "";
}

BakeRecord Records::make(const BatchAsset& asset, Json report) const {
  const auto seen = [&](const std::string& path) {
    // Paths below the manifest's folder are stored relative to it, so that everything can be moved together.
    const fs::path relative = fs::path(path).lexically_relative(folder_.empty() ? fs::path() : folder_);
    const bool below = fs::path(path).is_relative() == folder_.is_relative() && !relative.empty();
    const std::string own = below ? relative.string() : fs::absolute(path).string();
    std::optional<FileState> state = state_of(folder_, own);
    if (!state) throw Error(Status::file_unreadable, path + ": can no longer be read");
    return *state;
  };
  BakeRecord record{NIF_VERSION_STRING, asset.options, {}, seen(asset.output), std::move(report)};
  for (const Json& source : record.report.at("sources"))
    record.sources.push_back(seen(source.get<std::string>()));
  return record;
}

}  // namespace nif::tools
