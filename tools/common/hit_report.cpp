#include "tools/common/hit_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace nif::tools {
namespace {

constexpr std::array<const char*, kPercentiles.size()> kPercentileKeys{"median", "p90", "p95", "p99"};

double share_of(uint64_t count, uint64_t rays) { return rays ? double(count) / double(rays) : 0; }

/// One quantity, a row for each set that has some.
std::string percentile_table(const SetHits& sets, const std::string& title,
                             std::vector<float> HitAccuracy::*values, double unit) {
  std::string rows;
  for (const bake::RaySet set : bake::kRaySets) {
    const std::vector<float>& all = sets[size_t(set)].*values;
    if (all.empty()) continue;
    rows += fmt::format("{:<14}{:>10}", bake::name_of(set), all.size());
    for (const double value : percentiles_of(all)) rows += fmt::format("{:>11.3g}", unit * value);
    rows += "\n";
  }
  if (rows.empty()) return rows;
  std::string head = fmt::format("\n{}\n{:<14}{:>10}{:>11}", title, "", "hits", "median");
  for (size_t p = 1; p < kPercentiles.size(); ++p)
    head += fmt::format("{:>11}", fmt::format("{:.0f}%", 100 * kPercentiles[p]));
  return head + "\n" + rows;
}

/// Of the triangles that hits name, where they are those of the source mesh.
std::string triangle_table(const SetHits& sets) {
  std::string rows;
  for (const bake::RaySet set : bake::kRaySets) {
    const HitAccuracy& hits = sets[size_t(set)];
    if (hits.named > 0)
      rows += fmt::format("{:<14}{:>10}{:>10}{:>10}\n", bake::name_of(set), hits.named, hits.otherwise,
                          hits.misnamed);
  }
  if (rows.empty()) return rows;
  return fmt::format("\nTriangles of the source mesh\n{:<14}{:>10}{:>10}{:>10}\n", "", "hits", "other",
                     "wrong") +
         rows +
         "other: Embree names another one, which is as near unless the hit is displaced\n"
         "wrong: u and v on the triangle do not lead to the hit\n";
}

nlohmann::ordered_json percentiles_json(const std::vector<float>& values) {
  nlohmann::ordered_json json;
  const Percentiles percentiles = percentiles_of(values);
  for (size_t p = 0; p < percentiles.size(); ++p) json[kPercentileKeys[p]] = percentiles[p];
  return json;
}

}  // namespace

std::string hit_tables(const SetHits& sets) {
  std::string table = fmt::format("{:<14}{:>10}{:>9}{:>9}{:>10}{:>14}{:>14}\n", "first hits", "rays",
                                  "missed", "false", "certain", "bounds wrong", "displaced");
  for (const bake::RaySet set : bake::kRaySets) {
    const HitAccuracy& hits = sets[size_t(set)];
    if (hits.rays == 0) continue;
    const auto percent = [&](uint64_t count) { return 100 * share_of(count, hits.rays); };
    table += fmt::format("{:<14}{:>10}{:>8.3f}%{:>8.3f}%{:>9.1f}%{:>14}{:>14}\n", bake::name_of(set),
                         hits.rays, percent(hits.missed), percent(hits.false_hits), percent(hits.certain),
                         hits.bounds_wrong, hits.triangles ? fmt::format("{}", hits.displaced) : "-");
  }
  table += "bounds wrong: rays whose true hit is outside of what was proven\n";
  if (std::any_of(sets.begin(), sets.end(), [](const HitAccuracy& hits) { return hits.triangles > 0; }))
    table += fmt::format("displaced: hits on triangles that are more than {} diagonals from the true one\n",
                         kDisplaced);
  table += triangle_table(sets);
  table += percentile_table(sets, "Distance from the true hit, in percent of the object's diagonal",
                            &HitAccuracy::place, 100);
  table += percentile_table(sets, "Distance from the true hit, in voxels", &HitAccuracy::voxels, 1);
  table +=
      percentile_table(sets, "Angle between the normal and the true one, in degrees", &HitAccuracy::angle, 1);
  return table;
}

nlohmann::ordered_json to_json(const HitAccuracy& hits) {
  nlohmann::ordered_json json{{"missed", share_of(hits.missed, hits.rays)},
                              {"false_hits", share_of(hits.false_hits, hits.rays)},
                              {"certain", share_of(hits.certain, hits.rays)},
                              {"bounds_wrong", hits.bounds_wrong},
                              {"compared", hits.place.size()}};
  if (hits.triangles > 0) json["triangles"] = {{"compared", hits.triangles}, {"displaced", hits.displaced}};
  if (hits.named > 0)
    json["source_triangles"] = {
        {"compared", hits.named}, {"other", hits.otherwise}, {"wrong", hits.misnamed}};
  const auto add = [&](const char* name, const std::vector<float>& values) {
    if (!values.empty()) json[name] = percentiles_json(values);
  };
  add("diagonals", hits.place);
  add("voxels", hits.voxels);
  add("degrees", hits.angle);
  return json;
}

}  // namespace nif::tools
