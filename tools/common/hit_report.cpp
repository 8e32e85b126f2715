// Misses and false hits come first, then how far off hits are, by percentiles. The short form states
// distances in voxels if the object has a grid, otherwise in percent of its diagonal.
#include "tools/common/hit_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace nif::tools {
namespace {

using bake::HitFigures;
using bake::Percentiles;

/// One quantity, with a row for each set that has it.
std::string percentile_table(const bake::SetHitFigures& sets, const std::string& title,
                             std::optional<Percentiles> HitFigures::*values, double unit) {
  std::string rows;
  for (const bake::RaySet set : bake::kAllRaySets) {
    const HitFigures& hits = sets[size_t(set)];
    const std::optional<Percentiles>& percentiles = hits.*values;
    if (!percentiles) continue;
    rows += fmt::format("{:<14}{:>10}", bake::name_of(set), hits.compared);
    for (const double value : *percentiles) rows += fmt::format("{:>11.3g}", unit * value);
    rows += "\n";
  }
  if (rows.empty()) return rows;
  std::string head = fmt::format("\n{}\n{:<14}{:>10}{:>11}", title, "", "hits", "median");
  for (size_t p = 1; p < bake::kPercentiles.size(); ++p)
    head += fmt::format("{:>11}", fmt::format("{:.0f}%", 100 * bake::kPercentiles[p]));
  return head + "\n" + rows;
}

/// Statistics of the reported triangles, if they are those of the source mesh.
std::string triangle_table(const bake::SetHitFigures& sets) {
  std::string rows;
  for (const bake::RaySet set : bake::kAllRaySets) {
    const HitFigures& hits = sets[size_t(set)];
    if (hits.named > 0)
      rows += fmt::format("{:<14}{:>10}{:>10}{:>10}\n", bake::name_of(set), hits.named, hits.otherwise,
                          hits.misnamed);
  }
  if (rows.empty()) return rows;
  return fmt::format("\nTriangles of the source mesh\n{:<14}{:>10}{:>10}{:>10}\n", "", "hits", "other",
                     "wrong") +
         rows +
         "other: Embree names another one, which is equally near unless the hit is displaced\n"
         "wrong: u and v on the triangle do not lead to the hit\n";
}

}  // namespace

std::string hit_tables(const bake::SetHitFigures& sets) {
  std::string table = fmt::format("{:<14}{:>10}{:>9}{:>9}{:>10}{:>14}{:>14}\n", "first hits", "rays",
                                  "missed", "false", "certain", "bounds wrong", "displaced");
  for (const bake::RaySet set : bake::kAllRaySets) {
    const HitFigures& hits = sets[size_t(set)];
    if (hits.rays == 0) continue;
    const auto percent = [&](uint64_t count) { return 100 * hits.rate(count); };
    table += fmt::format("{:<14}{:>10}{:>8.3f}%{:>8.3f}%{:>9.1f}%{:>14}{:>14}\n", bake::name_of(set),
                         hits.rays, percent(hits.missed), percent(hits.false_hits), percent(hits.certain),
                         hits.bounds_wrong, hits.triangles ? fmt::format("{}", hits.displaced) : "-");
  }
  table += "bounds wrong: rays whose true hit is outside of what was proven\n";
  if (std::any_of(sets.begin(), sets.end(), [](const HitFigures& hits) { return hits.triangles > 0; }))
    table += fmt::format("displaced: hits on triangles that are more than {} diagonals from the true one\n",
                         bake::kDisplaced);
  table += triangle_table(sets);
  table += percentile_table(sets, "Distance from the true hit, in percent of the object's diagonal",
                            &HitFigures::place, 100);
  table += percentile_table(sets, "Distance from the true hit, in voxels", &HitFigures::voxels, 1);
  table +=
      percentile_table(sets, "Angle between the normal and the true one, in degrees", &HitFigures::angle, 1);
  return table;
}

std::string hit_lines(const bake::SetHitFigures& sets) {
  std::string lines;
  for (const bake::RaySet set : bake::kAllRaySets) {
    const HitFigures& hits = sets[size_t(set)];
    if (hits.rays == 0) continue;
    // If available, distances in voxels say more.
    const std::optional<Percentiles>& off = hits.voxels ? hits.voxels : hits.place;
    const double unit = hits.voxels ? 1 : 100;
    lines += fmt::format("{:<14}{:>10}{:>8.3f}%{:>8.3f}%", bake::name_of(set), hits.rays,
                         100 * hits.rate(hits.missed), 100 * hits.rate(hits.false_hits));
    if (off && hits.angle)
      lines += fmt::format("{:>10.2g}{:>9.2g}{:>9.2g} {:<10}{:>8.2g}{:>9.2g} degrees", unit * (*off)[0],
                           unit * (*off)[2], unit * (*off)[3], hits.voxels ? "voxels" : "% diagonal",
                           (*hits.angle)[0], (*hits.angle)[1]);
    lines += "\n";
  }
  if (lines.empty()) return lines;
  return fmt::format("{:<14}{:>10}{:>9}{:>9}{:>10}{:>9}{:>9} {:<10}{:>8}{:>9}\n", "first hits", "rays",
                     "missed", "false", "off: 50%", "95%", "99%", "", "normal", "90%") +
         lines;
}

}  // namespace nif::tools
