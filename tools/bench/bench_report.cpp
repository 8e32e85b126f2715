// Builds the parts of JSON and text that the reports of an asset and of a scene share, so that both read
// alike. The JSON keys are an interface: if one changes or is removed, the schema needs a new version.
#include "tools/bench/bench_report.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/base/quantities.hpp"
#include "tools/common/asset_bytes.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;

struct CpuStageName {
  const char *key, *text;
};
/// Indexed by kernels::cpu::SphericalStage.
constexpr std::array<CpuStageName, kernels::cpu::kSphericalStages> kCpuStageNames{
    {{"ray_cast", "ray cast"},
     {"outer_grids", "outer grids"},
     {"outer_network", "outer network"},
     {"inner_grids", "inner grids"},
     {"inner_network", "inner network"}}};

Json rate_json(const Spread& rate, uint64_t bytes) {
  return {{"mrays_per_s", rate.median}, {"lowest", rate.lowest}, {"highest", rate.highest}, {"bytes", bytes}};
}

Json variant_json(const EmbreeVariant& variant, uint64_t rays, const BenchResult& result) {
  Json json{{"variant", name_of(variant)},         {"build", name_of(kEmbreeBuilds[variant.build])},
            {"call", bake::name_of(variant.call)}, {"coherent", variant.coherent},
            {"rounds", variant.rates.size()},      {"error", double(variant.wrong) / double(rays)}};
  const Spread rate = variant.rates.empty()
                          ? Spread{variant.fastest_heat, variant.fastest_heat, variant.fastest_heat}
                          : variant.rate();
  json.update(rate_json(rate, result.embree_bytes[variant.build]));
  return json;
}

/// Nanoseconds per ray, by stage.
Json stages_json(const StageTimes& times) {
  Json json = Json::object();
  for (size_t s = 0; s < times.size(); ++s)
    json[kCpuStageNames[s].key] = {
        {"ns", times[s].median}, {"lowest", times[s].lowest}, {"highest", times[s].highest}};
  return json;
}

/// For one of the assets; empty if it has no stages.
std::string stage_table(const ThreadRun& run, const std::string& asset,
                        const std::function<const std::optional<StageTimes>*(const SetSpeeds&)>& stages_of) {
  std::string rows;
  for (const SetSpeeds& speeds : run.sets) {
    const std::optional<StageTimes>* stages = stages_of(speeds);
    if (!stages || !*stages) continue;
    rows += fmt::format("{:<14}", bake::name_of(speeds.set));
    double all = 0;
    for (const Spread& time : **stages) {
      rows += fmt::format("{:>15.1f}", time.median);
      all += time.median;
    }
    rows += fmt::format("{:>8.1f}\n", all);
  }
  if (rows.empty()) return rows;
  std::string head = fmt::format("\nStages of {}, 1 thread, nanoseconds per ray\n{:<14}", asset, "ray set");
  for (const CpuStageName& name : kCpuStageNames) head += fmt::format("{:>15}", name.text);
  return head + fmt::format("{:>8}\n", "all") + rows;
}

std::string speed_table(const ThreadRun& run) {
  std::string table = fmt::format("{:<14}{:>8}{:>8}{:>9}{:>8}{:>19}{:>20}{:>18}\n", "ray set", "error",
                                  "leak", "spurious", "certain", "nif", "best Embree", "nif / Embree");
  for (const SetSpeeds& speeds : run.sets) {
    const bake::Accuracy& a = speeds.accuracy;
    const Spread ratio = speeds.ratio_to_best();
    table += fmt::format("{:<14}{:>7.3f}%{:>7.3f}%{:>8.3f}%{:>7.1f}%{:>19}{:>20}{:>18}\n",
                         bake::name_of(speeds.set), 100 * a.error(), 100 * a.rate(a.leak),
                         100 * a.rate(a.spurious), 100 * a.rate(a.certain), with_spread(speeds.rate()),
                         with_spread(speeds.best().rate()), with_spread(ratio));
  }
  return table;
}

/// The results of other programs on the same rays; empty if there are none.
std::string entrant_table(const ThreadRun& run) {
  std::string rows;
  bool hits = false;
  for (const SetSpeeds& speeds : run.sets) {
    for (const EntrantSpeed& one : speeds.entrants) {
      const auto share = [&](uint64_t count) {
        return fmt::format("{:.3f}%", 100 * double(count) / double(std::max<uint64_t>(1, one.rays)));
      };
      hits = one.hits;
      const std::string name =
          fmt::format("{}{}{}", one.program, one.variant.empty() ? "" : " ", one.variant);
      rows += fmt::format("{:<14}{:<30}{:>9}{:>9}{:>8}", bake::name_of(speeds.set), name,
                          one.bytes ? format_bytes(double(*one.bytes)) : "", share(one.differing), one.wrong);
      if (one.hits) rows += fmt::format("{:>10}{:>8}", share(one.displaced), one.misplaced);
      rows += fmt::format("{:>19}{:>11}{:>14}\n", with_spread(one.rate()), format_rate(speeds.ratio_to(one)),
                          format_rate(speeds.best().rate().median / one.rate().median));
    }
  }
  if (rows.empty()) return rows;
  std::string head =
      fmt::format("\nOther programs, which timed themselves at another time\n{:<14}{:<30}{:>9}{:>9}{:>8}",
                  "ray set", "program", "memory", "differ", "wrong");
  if (hits) head += fmt::format("{:>10}{:>8}", "t differs", "wrong");
  return head + fmt::format("{:>19}{:>11}{:>14}\n", "it", "nif / it", "Embree / it") + rows;
}

Json entrant_json(const SetSpeeds& speeds, const EntrantSpeed& one) {
  const Spread rate = one.rate();
  Json json{{"program", one.program},     {"file", one.file},      {"passes", one.rates.size()},
            {"mrays_per_s", rate.median}, {"lowest", rate.lowest}, {"highest", rate.highest},
            {"differing", one.differing}, {"wrong", one.wrong},    {"ratio", speeds.ratio_to(one)}};
  if (!one.variant.empty()) json["variant"] = one.variant;
  if (one.bytes) json["bytes"] = *one.bytes;
  if (one.hits)
    json["hits"] = {{"compared", one.compared}, {"displaced", one.displaced}, {"misplaced", one.misplaced}};
  if (one.named) json["hits"]["other"] = one.other;
  return json;
}

/// The fastest call of each Embree build, to show its bytes beside its speed.
std::string build_table(const ThreadRun& run, const BenchResult& result) {
  const auto resident = double(result.info.resident_bytes);
  std::string table = fmt::format("{:<16}{:>9}{:>7}", "", "memory", "");
  for (const SetSpeeds& speeds : run.sets) table += fmt::format("{:>9}{:<15}", "", bake::name_of(speeds.set));
  table += fmt::format("\n{:<16}{:>9}{:>7}", "nif", format_bytes(resident), "1 x");
  for (const SetSpeeds& speeds : run.sets)
    table += fmt::format("{:>8}{:16}", format_rate(speeds.rate().median), "");
  for (size_t b = 0; b < kEmbreeBuilds.size(); ++b) {
    const auto bytes = double(result.embree_bytes[b]);
    table += fmt::format("\nEmbree {:<9}{:>9}{:>5.0f} x", name_of(kEmbreeBuilds[b]), format_bytes(bytes),
                         bytes / resident);
    for (const SetSpeeds& speeds : run.sets) {
      const EmbreeVariant& best = speeds.best(b);
      table += fmt::format("{:>8} {:<15}", format_rate(best.rate().median),
                           fmt::format("{}{}", bake::name_of(best.call), best.coherent ? "*" : ""));
    }
  }
  std::string trimmed;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);)
    trimmed += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  return trimmed;
}

}  // namespace

Json sets_json(const ThreadRun& run, const BenchResult& result) {
  Json sets = Json::object();
  for (const SetSpeeds& speeds : run.sets) {
    const bake::Accuracy& accuracy = speeds.accuracy;
    const Spread ratio = speeds.ratio_to_best();
    Json variants = Json::array();
    for (const EmbreeVariant& variant : speeds.embree)
      variants.push_back(variant_json(variant, accuracy.rays, result));
    sets[std::string(bake::name_of(speeds.set))] = {
        {"rays", accuracy.rays},
        {"error", accuracy.error()},
        {"leak", accuracy.rate(accuracy.leak)},
        {"spurious", accuracy.rate(accuracy.spurious)},
        {"certain", accuracy.rate(accuracy.certain)},
        {"certain_wrong", accuracy.certain_wrong},
        {"embree", variant_json(speeds.best(), accuracy.rays, result)},
        {"nif", rate_json(speeds.rate(), result.info.resident_bytes)},
        {"ratio", ratio.median},
        {"ratio_lowest", ratio.lowest},
        {"ratio_highest", ratio.highest},
        {"cores", speeds.cores},
        {"variants", std::move(variants)}};
    if (speeds.behind) sets[std::string(bake::name_of(speeds.set))]["behind"] = name_of(*speeds.behind);
    if (speeds.stages) sets[std::string(bake::name_of(speeds.set))]["stages"] = stages_json(*speeds.stages);
    for (const EntrantSpeed& one : speeds.entrants)
      sets[std::string(bake::name_of(speeds.set))]["entrants"].push_back(entrant_json(speeds, one));
    if (!speeds.against) continue;
    const Spread to_other = speeds.ratio_to_other();
    Json against = rate_json(speeds.against->rate(), result.against.resident_bytes);
    against.update({{"error", speeds.against->accuracy.error()},
                    {"ratio", to_other.median},
                    {"ratio_lowest", to_other.lowest},
                    {"ratio_highest", to_other.highest}});
    if (speeds.against->stages) against["stages"] = stages_json(*speeds.against->stages);
    sets[std::string(bake::name_of(speeds.set))]["against"] = std::move(against);
  }
  return sets;
}

std::string other_table(const ThreadRun& run, const std::string& against, const BenchResult& result) {
  if (against.empty()) return "";
  std::string table = fmt::format("\nagainst {}, {}\n{:<14}{:>8}{:>19}{:>20}\n", against,
                                  format_bytes(double(result.against.resident_bytes)), "ray set", "error",
                                  "it", "nif / other");
  for (const SetSpeeds& speeds : run.sets)
    table += fmt::format("{:<14}{:>7.3f}%{:>19}{:>20}\n", bake::name_of(speeds.set),
                         100 * speeds.against->accuracy.error(), with_spread(speeds.against->rate()),
                         with_spread(speeds.ratio_to_other()));
  return table;
}

std::string with_spread(const Spread& spread) {
  return fmt::format("{} ({}-{})", format_rate(spread.median), format_rate(spread.lowest),
                     format_rate(spread.highest));
}

std::string gain_line(const ThreadRun& first, const ThreadRun& more) {
  std::string nif, embree;
  for (size_t s = 0; s < more.sets.size(); ++s) {
    const auto gain = [&](const std::vector<double>& from, const std::vector<double>& to) {
      return fmt::format("{}{}", s ? ", " : "", with_spread(ratio_by_round(to, from)));
    };
    nif += gain(first.sets[s].rates, more.sets[s].rates);
    embree += gain(first.sets[s].best().rates, more.sets[s].best().rates);
  }
  return fmt::format("\nSpeedup over {}, by ray set:\n  nif          {}\n  best Embree  {}\n",
                     count_of(first.threads, "thread"), nif, embree);
}

std::string run_tables(const ThreadRun& run, const BenchResult& result) {
  return speed_table(run) + "\n" + build_table(run, result) + entrant_table(run);
}

nlohmann::ordered_json embree_bytes_json(const BenchResult& result) {
  Json json = Json::object();
  for (size_t b = 0; b < kEmbreeBuilds.size(); ++b)
    json[std::string(name_of(kEmbreeBuilds[b]))] = result.embree_bytes[b];
  return json;
}

std::string on_processor() {
  const std::string name = processor_name();
  return name.empty() ? "" : " on " + name;
}

nlohmann::ordered_json to_json(const BenchOptions& options, const BenchResult& result) {
  Json scaling = Json::array();
  for (const ThreadRun& run : result.runs)
    scaling.push_back({{"threads", run.threads}, {"sets", sets_json(run, result)}});
  Json json{{"schema", kBenchSchema},
            {"file", options.asset},
            {"threads", result.runs.front().threads},
            {"isa", result.isa},
            {"configuration", options.configuration},
            {"sets", sets_json(result.runs.front(), result)},
            {"scaling", std::move(scaling)},
            {"processor", processor_name()},
            {"embree_version", bake::embree_version()},
            {"triangles", result.triangles},
            {"objects", result.objects},
            {"seed", options.seed},
            {"rounds", options.schedule.rounds},
            {"bytes",
             {{"file", result.info.file_bytes},
              {"resident", result.info.resident_bytes},
              {"parts", parts_json(result.parts)},
              {"embree", embree_bytes_json(result)}}}};
  if (!options.against.empty()) json["against"] = options.against;
  if (!options.compare.empty()) json["compare"] = options.compare;
  if (options.fallback) json["fallback"] = "embree";
  if (options.hits) json["hits"] = true;
  return json;
}

std::string bench_tables(const BenchOptions& options, const BenchResult& result) {
  std::string text = fmt::format(
      "{}: {}, isa {}, against Embree {}{}\n"
      "Millions of rays per second: the median of {} (lowest-highest). *: Embree is told that the rays are "
      "coherent.\n",
      options.asset, count_of(result.triangles, "triangle"), result.isa, bake::embree_version(),
      on_processor(), count_of(options.schedule.rounds, "round"));
  if (options.fallback)
    text +=
        "nif: proofs first, and for rays that they leave open rtcOccluded1 of the build that is fastest for "
        "that. "
        "certain: "
        "proven.\n";
  if (options.hits) text += kFirstHitsLine;
  for (const ThreadRun& run : result.runs) {
    text += fmt::format("\n{}\n\n{}{}", count_of(run.threads, "thread"), run_tables(run, result),
                        other_table(run, options.against, result));
    if (&run != &result.runs.front()) text += gain_line(result.runs.front(), run);
  }
  const ThreadRun& first = result.runs.front();
  text += stage_table(first, options.asset, [](const SetSpeeds& speeds) { return &speeds.stages; });
  text += stage_table(first, options.against, [](const SetSpeeds& speeds) {
    return speeds.against ? &speeds.against->stages : nullptr;
  });
  return text;
}

std::string format_rate(double rate) {
  return fmt::format("{:.{}f}", rate, rate < 9.995 ? 2 : rate < 99.95 ? 1 : 0);
}

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "";
}

}  // namespace nif::tools
