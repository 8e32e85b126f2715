// Sizes are compared with those of our own rays before anything is read, so that no file can make us allocate
// more than these. Answers that differ are asked again of rays beside them: where rounding decides, sound
// programs differ, too.
#include "tools/bench/entrants.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "bake/ground_truth/scene_truth.hpp"
#include "formats/base/json_text.hpp"
#include "formats/base/printable.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "tools/bench/bench_report.hpp"
#include "tools/query/input_stream.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;
using EntrantJson = nlohmann::json;

constexpr uint64_t kMaxFileBytes = 16 << 20;
constexpr size_t kMaxResults = 1000, kMaxPasses = 1000, kMaxName = 60;
constexpr uint32_t kMaxThreads = 1024, kNoNumber = 0xffffffff;
constexpr double kMaxSeconds = 1e6;

/// A value in a file, with its place there.
class Stated {
 public:
  Stated(const std::string& file, const EntrantJson& json, std::string place)
      : file_(file), json_(json), place_(std::move(place)) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Status::malformed_results,
                fmt::format("{}: {}: {}", file_, place_.empty() ? "the file" : place_, what));
  }
  const std::string& place() const { return place_; }
  bool has(const char* name) const { return json_.is_object() && json_.contains(name); }
  Stated operator[](const char* name) const {
    const Stated member(file_, has(name) ? json_[name] : json_, fmt::format("{}/{}", place_, name));
    if (!json_.is_object()) fail("must be an object");
    if (!has(name)) member.fail("is missing");
    return member;
  }
  std::vector<Stated> elements(size_t most) const {
    if (!json_.is_array() || json_.empty() || json_.size() > most)
      fail(fmt::format("must be an array of 1 to {} elements", most));
    std::vector<Stated> all;
    for (size_t i = 0; i < json_.size(); ++i)
      all.emplace_back(file_, json_[i], fmt::format("{}/{}", place_, i));
    return all;
  }
  /// Text for people.
  std::string name() const {
    if (json_.is_string()) {
      const auto text = json_.get<std::string>();
      if (!text.empty() && text.size() <= kMaxName && printable(text) == text) return text;
    }
    fail(fmt::format("must be text of 1 to {} bytes without control characters", kMaxName));
  }
  uint64_t whole(uint64_t least, uint64_t most) const {
    if (json_.is_number_unsigned()) {
      const auto number = json_.get<uint64_t>();
      if (number >= least && number <= most) return number;
    }
    fail(fmt::format("must be a whole number from {} to {}", least, most));
  }
  double seconds() const {
    if (json_.is_number()) {
      const auto number = json_.get<double>();
      if (number > 0 && number <= kMaxSeconds) return number;
    }
    fail(fmt::format("must be a number of seconds, above 0 and at most {:g}", kMaxSeconds));
  }
  /// One of these words.
  size_t one_of(const std::vector<std::string>& words) const {
    if (json_.is_string())
      for (size_t i = 0; i < words.size(); ++i)
        if (json_.get<std::string>() == words[i]) return i;
    fail(fmt::format("must be one of {}", fmt::join(words, ", ")));
  }
  /// The path of a file in the folder of this one or below.
  std::string file() const {
    if (json_.is_string()) {
      const fs::path path = json_.get<std::string>();
      const bool up = std::ranges::find(path, "..") != path.end();
      if (!path.empty() && path.is_relative() && !up && path.native().find('\0') == std::string::npos)
        return (fs::path(file_).parent_path() / path).string();
    }
    fail("must be the name of a file in the folder of this file, or below");
  }

 private:
  const std::string& file_;
  const EntrantJson& json_;
  std::string place_;
};

std::vector<std::string> set_names() {
  std::vector<std::string> names;
  for (const bake::RaySet set : bake::kAllRaySets) names.emplace_back(bake::name_of(set));
  return names;
}

EntrantResult to_result(const Stated& stated) {
  EntrantResult result{};
  result.place = stated.place();
  result.set = bake::kAllRaySets[stated["set"].one_of(set_names())];
  result.hash = stated["hash"].name();
  result.threads = uint32_t(stated["threads"].whole(1, kMaxThreads));
  result.hits = stated["query"].one_of({"visibility", "hits"}) == 1;
  if (stated.has("variant")) result.variant = stated["variant"].name();
  if (stated.has("bytes"))
    result.bytes = stated["bytes"].whole(1, uint64_t(std::numeric_limits<int64_t>::max()));
  for (const Stated& pass : stated["seconds"].elements(kMaxPasses)) result.seconds.push_back(pass.seconds());
  const Stated answers = stated["answers"];
  if (!result.hits) {
    result.visible = answers["visible"].file();
    return result;
  }
  result.t = answers["t"].file();
  if (answers.has("triangle")) result.triangle = answers["triangle"].file();
  if (answers.has("instance")) result.instance = answers["instance"].file();
  return result;
}

EntrantFile read_entrant(const std::string& path) {
  const mesh::detail::ByteBuffer text = mesh::detail::load_file(path, kMaxFileBytes);
  const auto json = parse_untrusted<EntrantJson>(text.view());
  const Stated root(path, json, "");
  if (!json.is_object()) root.fail("is not a JSON object, or too deeply nested");
  if (root["schema"].name() != kEntrantSchema) root["schema"].fail(fmt::format("must be {}", kEntrantSchema));
  EntrantFile file{path, root["program"].name(), root["version"].name(), "", {}};
  // An export on a machine that does not name its processor has an empty one.
  if (root.has("processor") && json["processor"] != "") file.processor = root["processor"].name();
  for (const Stated& result : root["results"].elements(kMaxResults)) {
    const EntrantResult& read = file.results.emplace_back(to_result(result));
    for (size_t i = 0; i + 1 < file.results.size(); ++i) {
      const EntrantResult& other = file.results[i];
      if (other.set == read.set && other.threads == read.threads && other.hits == read.hits &&
          other.variant == read.variant)
        result.fail("has the set, threads, query and variant of " + other.place);
    }
  }
  return file;
}

/// Consecutive rays of a set.
struct RayRange {
  size_t first, count, of;  ///< `of`: how many the set has
};

/// A part of a file that has a number for each ray.
template <class Number>
std::vector<Number> read_array(const std::string& path, const RayRange& rays) {
  if (path.empty()) return {};
  std::error_code ignored;
  // A pipe would be waited for.
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored))
    throw Error(Status::file_unreadable, path + ": is not a regular file");
  const InputStream file(path);
  const uint64_t bytes = rays.of * sizeof(Number), size = file.rest().value_or(0);
  if (size != bytes)
    throw Error(Status::malformed_results, fmt::format("{}: has {} bytes, but the answers to {} rays have {}",
                                                       path, size, rays.of, bytes));
  std::vector<Number> numbers(rays.count);
  const auto to = std::as_writable_bytes(std::span(numbers));
  if (file.read_at(rays.first * sizeof(Number), to) != to.size())
    throw Error(Status::file_unreadable, path + ": became shorter meanwhile");
  return numbers;
}

[[noreturn]] void no_answer(const std::string& path, size_t ray, const std::string& what) {
  throw Error(Status::malformed_results, fmt::format("{}: ray {}: {}", path, ray, what));
}

/// One scene's answers.
struct EntrantAnswers {
  std::vector<uint8_t> visible;
  std::vector<float> t;
  std::vector<uint32_t> triangle, instance;

  EntrantAnswers(const EntrantResult& result, const RayRange& rays)
      : visible(read_array<uint8_t>(result.visible, rays)),
        t(read_array<float>(result.t, rays)),
        triangle(read_array<uint32_t>(result.triangle, rays)),
        instance(read_array<uint32_t>(result.instance, rays)) {
    for (size_t i = 0; i < visible.size(); ++i)
      if (visible[i] > 1)
        no_answer(result.visible, rays.first + i, fmt::format("{} is neither 0 nor 1", visible[i]));
    for (size_t i = 0; i < t.size(); ++i)
      if (std::isnan(t[i]) || t[i] == -std::numeric_limits<float>::infinity())
        no_answer(result.t, rays.first + i, "t is not a number; a ray without a hit has infinity");
  }
};

bake::EmbreeTruth truth_of(const RaceData& race, const RacedScene& scene) {
  if (race.instanced) return {bake::embree_objects(race.objects), scene.instances};
  return bake::EmbreeTruth(race.objects[scene.instances.front().object]->surface);
}

struct JudgedScene {
  const bake::EmbreeTruth& truth;
  const bake::RaysWithTruth& rays;
  double diagonal;
  size_t first_instance;
};

void judge_hit(const JudgedScene& scene, const EntrantAnswers& answers, size_t i, EntrantCounts& counts) {
  const bake::Segment& ray = scene.rays.segments[i];
  const std::optional<bake::EmbreeTruth::Hit> hit = scene.truth.first_hit(ray);
  if (!hit) return;  // rounding decides whether there is one
  ++counts.compared;
  const double t = answers.t[i];
  const double length =
      std::hypot(double(ray.direction[0]), double(ray.direction[1]), double(ray.direction[2]));
  const double tolerance = kSameHit * std::max(std::abs(double(hit->t)), scene.diagonal / length);
  if (std::abs(t - double(hit->t)) <= tolerance) {
    const bool other =
        (!answers.triangle.empty() && answers.triangle[i] != hit->triangle) ||
        (!answers.instance.empty() && answers.instance[i] != scene.first_instance + hit->instance);
    counts.other += other;
    return;
  }
  ++counts.displaced;
  // The hits of rays beside it enclose what rounding may do.
  double low = hit->t, high = hit->t;
  for (const bake::Segment& beside : scene.truth.beside(ray)) {
    const std::optional<bake::EmbreeTruth::Hit> near = scene.truth.first_hit(beside);
    if (!near) return;
    low = std::min(low, double(near->t));
    high = std::max(high, double(near->t));
  }
  counts.misplaced += t < low - tolerance || t > high + tolerance;
}

EntrantCounts judge_scene(const JudgedScene& scene, const EntrantAnswers& answers) {
  constexpr size_t kShare = 4096;
  const size_t rays = scene.rays.segments.size();
  std::vector<EntrantCounts> shares((rays + kShare - 1) / kShare);
  tbb::parallel_for(size_t{0}, shares.size(), [&](size_t share) {
    EntrantCounts& counts = shares[share];
    for (size_t i = share * kShare; i < std::min(rays, (share + 1) * kShare); ++i) {
      const bool visible = answers.t.empty() ? answers.visible[i] != 0 : std::isinf(answers.t[i]);
      if (visible != (scene.rays.visible[i] != 0)) {
        ++counts.differing;
        counts.wrong += !scene.truth.in_doubt(scene.rays.segments[i]);
      } else if (!answers.t.empty() && !visible) {
        judge_hit(scene, answers, i, counts);
      }
    }
  });
  EntrantCounts all;
  for (const EntrantCounts& share : shares) all += share;
  return all;
}

/// Whether the hits refer to what there is. Rays without a hit may have any numbers.
void check_numbers(const EntrantResult& result, const EntrantAnswers& answers, const RaceData& race,
                   const RacedScene& scene, size_t first_instance, size_t first_ray) {
  size_t most = 0;
  const auto triangles_of = [&](size_t instance) {
    return race.objects[scene.instances[instance].object]->surface.triangles.size();
  };
  for (size_t i = 0; i < scene.instances.size(); ++i) most = std::max(most, triangles_of(i));
  for (size_t i = 0; i < answers.t.size(); ++i) {
    if (std::isinf(answers.t[i])) continue;
    size_t triangles = most;
    if (!answers.instance.empty()) {
      const size_t instance = answers.instance[i];
      if (instance < first_instance || instance - first_instance >= scene.instances.size())
        no_answer(result.instance, first_ray + i,
                  fmt::format("instance {} is none of its scene, which has {} from {}", instance,
                              scene.instances.size(), first_instance));
      triangles = triangles_of(instance - first_instance);
    }
    if (!answers.triangle.empty() && answers.triangle[i] >= triangles)
      no_answer(result.triangle, first_ray + i,
                fmt::format("triangle {} of {} does not exist", answers.triangle[i], triangles));
  }
}

/// A result that takes part, with its answers.
struct TakingPart {
  const EntrantFile& file;
  const EntrantResult& result;
  size_t set;  ///< in RaceData::sets
};

std::vector<TakingPart> taking_part(const std::vector<EntrantFile>& files, const RaceData& race,
                                    const std::vector<uint32_t>& threads, bool hits) {
  const std::vector<std::string> hashes = hashes_of(race);
  std::vector<TakingPart> all;
  for (const EntrantFile& file : files) {
    const size_t before = all.size();
    for (const EntrantResult& result : file.results) {
      const size_t set = size_t(std::ranges::find(race.sets, result.set) - race.sets.begin());
      if (set == race.sets.size() || result.hits != hits ||
          std::ranges::find(threads, result.threads) == threads.end())
        continue;
      if (result.hash != hashes[set])
        throw Error(Status::malformed_results,
                    fmt::format("{}: {}/hash: {} is of other rays than these, which have {}: use the mesh, "
                                "--rays and --seed of the export",
                                file.path, result.place, result.hash, hashes[set]));
      all.push_back({file, result, set});
    }
    if (all.size() == before)
      throw Error(Status::malformed_results,
                  fmt::format("{}: /results: has none for {} of these ray sets with {} {}", file.path,
                              hits ? "first hits" : "visibility", fmt::join(threads, " or "),
                              threads == std::vector<uint32_t>{1} ? "thread" : "threads"));
  }
  return all;
}

}  // namespace

std::vector<EntrantFile> read_entrants(const std::vector<std::string>& paths) {
  std::vector<EntrantFile> files;
  for (const std::string& path : paths) files.push_back(read_entrant(path));
  return files;
}

std::vector<JudgedEntrant> judge_entrants(const std::vector<EntrantFile>& files, const RaceData& race,
                                          const std::vector<uint32_t>& threads, bool hits,
                                          const std::function<void(const std::string&)>& step) {
  if (files.empty()) return {};
  const std::vector<TakingPart> all = taking_part(files, race, threads, hits);
  std::vector<JudgedEntrant> judged;
  for (const TakingPart& one : all) {
    const EntrantResult& result = one.result;
    EntrantSpeed speed;
    speed.program = one.file.program + " " + one.file.version;
    speed.variant = result.variant;
    speed.file = one.file.path;
    speed.bytes = result.bytes;
    speed.rays = race.rays(one.set);
    speed.hits = hits;
    speed.named = !result.triangle.empty() || !result.instance.empty();
    for (const double seconds : result.seconds) speed.rates.push_back(double(speed.rays) / seconds * 1e-6);
    judged.push_back({result.set, result.threads, std::move(speed)});
  }
  std::vector<size_t> first_ray(race.sets.size());
  size_t first_instance = 0;
  for (const RacedScene& scene : race.scenes) {
    step("building the ground truth");
    const bake::EmbreeTruth truth = truth_of(race, scene);
    const double diagonal = bake::bounds_of(race.objects, scene.instances).diagonal();
    for (size_t i = 0; i < all.size(); ++i) {
      const TakingPart& one = all[i];
      step(fmt::format("{}: {}", one.file.path, bake::name_of(one.result.set)));
      const bake::RaysWithTruth& rays = (*scene.rays)[one.set];
      const EntrantAnswers answers(one.result,
                                   {first_ray[one.set], rays.segments.size(), race.rays(one.set)});
      check_numbers(one.result, answers, race, scene, first_instance, first_ray[one.set]);
      judged[i].speed += judge_scene({truth, rays, diagonal, first_instance}, answers);
    }
    for (size_t s = 0; s < race.sets.size(); ++s) first_ray[s] += (*scene.rays)[s].segments.size();
    first_instance += scene.instances.size();
  }
  return judged;
}

void add_entrants(const std::vector<JudgedEntrant>& judged, std::vector<ThreadRun>& runs) {
  for (ThreadRun& run : runs)
    for (SetSpeeds& speeds : run.sets)
      for (const JudgedEntrant& one : judged)
        if (one.threads == run.threads && one.set == speeds.set) speeds.entrants.push_back(one.speed);
}

std::vector<std::string> entrant_notes(const std::vector<EntrantFile>& files) {
  std::vector<std::string> notes;
  for (const EntrantFile& file : files)
    if (!file.processor.empty() && file.processor != processor_name())
      notes.push_back(fmt::format("{}: was measured on another processor, {}", file.path, file.processor));
  return notes;
}

}  // namespace nif::tools
