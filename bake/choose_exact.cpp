// Which exact form an object gets if it has several, and objects that become exact because no learned form is
// good enough.
#include <fmt/format.h>

#include <algorithm>

#include "bake/steps.hpp"

namespace nif::bake {

std::string_view why_without_planes(const BakeOptions& options) {
  const bool without = options.prefer == Preference::bytes && !options.colors;
  return without ? "; bytes are preferred, so it has no planes" : "";
}

void choose_least_work(BakeRun& run, Candidate& candidate, const RaySource& source) {
  run.show(BakeProgress::Stage::choosing, candidate, 0.5);
  std::vector<std::pair<double, size_t>> works;
  for (const size_t e : candidate.exact_forms()) works.emplace_back(candidate.count_work(e, source), e);
  std::sort(works.begin(), works.end());
  const size_t before = candidate.chosen();
  for (const auto& [work, e] : works) {
    candidate.choose(e);
    if (e == before || run.fits()) break;
  }
  const auto& [least, best] = works[0];
  const auto& [more, other] = works[1];
  const bool is_least = candidate.chosen() == best, prefers = run.options.prefer.has_value(),
             automatic = run.options.encoding == kAutomatic;
  if (!is_least && !prefers) return;
  if (!automatic && best == before) return;
  std::string why = fmt::format("less work as {} than as {}: {:.0f} and {:.0f} ns a ray, counted",
                                run.encoders[best]->noun(), run.encoders[other]->noun(), least, more);
  if (!is_least) why += ", but the size limit leaves no room for it";
  if (prefers) why = "speed is preferred; " + why;
  std::string& reason = candidate.report.reason;
  reason = automatic ? reason + "; " + why : why;
}

bool make_exact(BakeRun& run, Candidate& candidate, const RaySource& source, const std::string& why) {
  const size_t learned = candidate.chosen();
  if (candidate.exact_forms().empty() && !candidate.lay_out_exact(kNoBudget)) return false;
  candidate.choose(*candidate.smallest_exact());
  if (!run.fits()) {
    candidate.choose(learned);
    return false;
  }
  candidate.report.reason = fmt::format("exact: {}{}", why, why_without_planes(run.options));
  if (candidate.exact_forms().size() > 1) choose_least_work(run, candidate, source);
  return true;
}

}  // namespace nif::bake
