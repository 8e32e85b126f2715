// One row for each ray set that has rays. `sun` gets a second row: the largest error and the smallest share
// of certain answers of any one sun.
#include "tools/common/accuracy_table.hpp"

#include <fmt/format.h>

namespace nif::tools {

std::string accuracy_table(const bake::SetAccuracies& sets) {
  std::string table =
      fmt::format("{:<14}{:>10}{:>9}{:>9}{:>10}{:>10}{:>15}{:>9}{:>13}\n", "ray set", "rays", "error", "leak",
                  "spurious", "certain", "certain wrong", "Brier", "calibration");
  for (bake::RaySet set : bake::kAllRaySets) {
    const bake::Accuracy& a = sets[size_t(set)];
    if (a.rays == 0) continue;
    table += fmt::format("{:<14}{:>10}{:>8.3f}%{:>8.3f}%{:>9.3f}%{:>9.1f}%{:>15}{:>9.5f}{:>13}\n",
                         bake::name_of(set), a.rays, 100 * a.error(), 100 * a.rate(a.leak),
                         100 * a.rate(a.spurious), 100 * a.rate(a.certain), a.certain_wrong, a.brier(),
                         a.uncertain() ? fmt::format("{:.3f}%", 100 * a.calibration_error()) : "-");
    if (set == bake::RaySet::sun)
      table += fmt::format("{:<14}{:>10}{:>8.3f}%{:>38.1f}%\n", "  worst sun", "", 100 * a.worst_error,
                           100 * a.least_certain);
  }
  return table;
}

std::string calibration_table(const bake::SetAccuracies& sets) {
  std::string table =
      fmt::format("{:<14}{:>14}{:>10}{:>10}{:>10}\n", "ray set", "probability", "rays", "mean", "visible");
  for (const bake::RaySet set : bake::kAllRaySets) {
    const bake::Accuracy& a = sets[size_t(set)];
    if (a.uncertain() == 0) continue;
    for (size_t b = 0; b < a.bins.size(); ++b) {
      const bake::CalibrationBin& bin = a.bins[b];
      const double step = 1.0 / double(a.bins.size());
      table += fmt::format("{:<14}{:>14}{:>10}", b == 0 ? bake::name_of(set) : "",
                           fmt::format("{:.1f} to {:.1f}", double(b) * step, double(b + 1) * step), bin.rays);
      table += bin.rays ? fmt::format("{:>9.2f}%{:>9.2f}%\n", 100 * bin.mean(), 100 * bin.share())
                        : fmt::format("{:>10}{:>10}\n", "-", "-");
    }
  }
  return table;
}

}  // namespace nif::tools
