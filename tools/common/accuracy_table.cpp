// One row for each ray set that has rays. `sun` gets a second row: the largest error and the smallest share
// of certain answers of any one sun.
#include "tools/common/accuracy_table.hpp"

#include <fmt/format.h>

namespace nif::tools {

std::string accuracy_table(const bake::SetAccuracies& sets) {
  std::string table = fmt::format("{:<14}{:>10}{:>9}{:>9}{:>10}{:>10}{:>15}{:>9}\n", "ray set", "rays",
                                  "error", "leak", "spurious", "certain", "certain wrong", "Brier");
  for (bake::RaySet set : bake::kAllRaySets) {
    const bake::Accuracy& a = sets[size_t(set)];
    if (a.rays == 0) continue;
    table += fmt::format("{:<14}{:>10}{:>8.3f}%{:>8.3f}%{:>9.3f}%{:>9.1f}%{:>15}{:>9.5f}\n",
                         bake::name_of(set), a.rays, 100 * a.error(), 100 * a.rate(a.leak),
                         100 * a.rate(a.spurious), 100 * a.rate(a.certain), a.certain_wrong, a.brier());
    if (set == bake::RaySet::sun)
      table += fmt::format("{:<14}{:>10}{:>8.3f}%{:>38.1f}%\n", "  worst sun", "", 100 * a.worst_error,
                           100 * a.least_certain);
  }
  return table;
}

}  // namespace nif::tools
