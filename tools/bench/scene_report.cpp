// Takes the tables for rays from bench_report.hpp, and adds those for moved instances: milliseconds to set
// transforms, to commit, and for both.
#include "tools/bench/scene_report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/base/quantities.hpp"
#include "tools/bench/bench_report.hpp"

namespace nif::tools {
namespace {

using SceneJson = nlohmann::ordered_json;

SceneJson move_json(const MoveTime& time) {
  const Spread whole = time.whole();
  return {{"ms", whole.median},
          {"lowest", whole.lowest},
          {"highest", whole.highest},
          {"transforms_ms", spread_of(time.transforms).median},
          {"commit_ms", spread_of(time.commit).median}};
}

double ratio_to_best(const MovedRun& moved) {
  return moved.embree[moved.best()].whole().median / moved.nif.whole().median;
}

SceneJson moved_json(const MovedRun& moved, const BenchResult& result) {
  SceneJson builds = SceneJson::object();
  for (size_t b = 0; b < kEmbreeBuilds.size(); ++b)
    builds[std::string(name_of(kEmbreeBuilds[b]))] = move_json(moved.embree[b]);
  SceneJson best{{"build", name_of(kEmbreeBuilds[moved.best()])}};
  best.update(move_json(moved.embree[moved.best()]));
  return {{"threads", moved.run.threads}, {"nif", move_json(moved.nif)},
          {"embree", std::move(best)},    {"ratio", ratio_to_best(moved)},
          {"builds", std::move(builds)},  {"sets", sets_json(moved.run, result)}};
}

std::string move_table(const MovedRun& moved) {
  std::string table =
      fmt::format("{:<16}{:>12}{:>12}{:>24}\n", "milliseconds", "transforms", "commit", "both");
  const auto row = [&](const std::string& name, const MoveTime& time) {
    table += fmt::format("{:<16}{:>12}{:>12}{:>24}\n", name, format_rate(spread_of(time.transforms).median),
                         format_rate(spread_of(time.commit).median), with_spread(time.whole()));
  };
  row("nif", moved.nif);
  for (size_t b = 0; b < kEmbreeBuilds.size(); ++b)
    row(fmt::format("Embree {}", name_of(kEmbreeBuilds[b])), moved.embree[b]);
  return table;
}

}  // namespace

nlohmann::ordered_json to_json(const SceneBenchOptions& options, const SceneBenchResult& result) {
  const BenchResult& still = result.still;
  SceneJson scaling = SceneJson::array();
  for (const ThreadRun& run : still.runs)
    scaling.push_back({{"threads", run.threads}, {"sets", sets_json(run, still)}});
  SceneJson json{{"schema", kSceneBenchSchema}, {"file", options.scene}};
  if (!options.asset.empty()) json["asset"] = options.asset;
  json.update({{"threads", still.runs.front().threads},
               {"isa", still.isa},
               {"configuration", options.configuration},
               {"sets", sets_json(still.runs.front(), still)},
               {"scaling", std::move(scaling)}});
  if (options.hits) json["hits"] = true;
  if (!options.against.empty()) json["against"] = options.against;
  if (!options.compare.empty()) json["compare"] = options.compare;
  if (!result.moved.empty()) {
    SceneJson runs = SceneJson::array();
    for (const MovedRun& moved : result.moved) runs.push_back(moved_json(moved, still));
    json["moved"] = {{"instances", result.moved_instances}, {"scaling", std::move(runs)}};
  }
  json.update({{"processor", processor_name()},
               {"embree_version", bake::embree_version()},
               {"objects", still.objects},
               {"instances", result.instances},
               {"triangles", still.triangles},
               {"placed_triangles", result.placed_triangles},
               {"seed", options.seed},
               {"rounds", options.schedule.rounds},
               {"bytes",
                {{"file", still.info.file_bytes},
                 {"resident", still.info.resident_bytes},
                 {"scene", result.scene_bytes},
                 {"embree", embree_bytes_json(still)}}}});
  return json;
}

std::string scene_bench_tables(const SceneBenchOptions& options, const SceneBenchResult& result) {
  const BenchResult& still = result.still;
  std::string text = fmt::format(
      "{}: {} of {} with {} ({} as placed), isa {}, against Embree {}{}\n"
      "Millions of rays per second: the median of {} (lowest-highest). *: Embree is told that the rays are "
      "coherent.\n",
      options.scene, count_of(result.instances, "instance"), count_of(still.objects, "object"),
      count_of(still.triangles, "triangle"), result.placed_triangles, still.isa, bake::embree_version(),
      on_processor(), count_of(options.schedule.rounds, "round"));
  if (options.hits) text += kFirstHitsLine;
  for (const ThreadRun& run : still.runs) {
    text += fmt::format("\n{}\n\n{}{}", count_of(run.threads, "thread"), run_tables(run, still),
                        other_table(run, options.against, still));
    if (&run != &still.runs.front()) text += gain_line(still.runs.front(), run);
  }
  for (const MovedRun& moved : result.moved)
    text +=
        fmt::format("\n{} moved, {}\n\n{}\n{}", count_of(result.moved_instances, "instance"),
                    count_of(moved.run.threads, "thread"), move_table(moved), run_tables(moved.run, still));
  return text;
}

}  // namespace nif::tools
