// The second step of a bake: an encoding for each object. A named one is taken, with those that stand in for
// it. "auto" takes exact ones or not, by the options (docs/model.md); it trains and times nothing.
#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <thread>

#include "bake/steps.hpp"
#include "formats/base/quantities.hpp"

namespace nif::bake {
namespace {

/// Calls lay_out(candidate) for each object; only the calling thread reports progress.
template <class LayOut>
void lay_out_each(BakeRun& run, const LayOut& lay_out) {
  const std::thread::id caller = std::this_thread::get_id();
  const size_t count = run.candidates.size();
  std::atomic<size_t> done = 0;
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    Candidate& candidate = run.candidates[i];
    if (run.callback && std::this_thread::get_id() == caller)
      run.callback({BakeProgress::Stage::preparing, candidate.report.name, done, count, 0, 0, 0});
    // Isolated, so that parallel work inside waits only for itself, not for another object.
    tbb::this_task_arena::isolate([&] { lay_out(candidate); });
    ++done;
  });
}

/// What "auto" takes for an object that is not exact.
struct Alternative {
  std::optional<size_t> encoding;  ///< none if all objects must be exact
  std::string_view word;           ///< for reasons
};
Alternative alternative_for(const BakeRequest& request) {
  Alternative other{{}, request.options.open_rays ? "proof" : "learned"};
  for (size_t e = request.encoders.size(); e-- > 0;)
    if (request.encoders[e]->kind() != AnswerKind::exact) other.encoding = e;
  return other;
}

/// If no option decides: exact if the object has few triangles and, unless speed is preferred, takes no more
/// memory than Embree would.
bool lay_out_exact_if_small(const BakeOptions& options, Candidate& candidate, std::string_view otherwise) {
  ObjectReport& report = candidate.report;
  if (report.triangles >= kMostExactTriangles) {
    report.reason = fmt::format("{}: it has {} triangles or more", otherwise, kMostExactTriangles);
    return false;
  }
  if (options.prefer == Preference::speed) {
    if (!candidate.lay_out_exact(kNoBudget)) return false;
    report.reason =
        fmt::format("exact: it has fewer than {} triangles, and may take any memory", kMostExactTriangles);
    return true;
  }
  // A few triangles have a tree of some hundred bytes, Embree's takes more.
  constexpr uint64_t kLeast = 4096;
  const uint64_t embree = std::max(kLeast, kEmbreeBytesPerTriangle * report.triangles);
  const bool is_exact = candidate.lay_out_exact(embree);
  if (is_exact)
    report.reason = fmt::format(
        "exact: it has fewer than {} triangles, and takes no more memory than a compact BVH of Embree, {}",
        kMostExactTriangles, format_bytes(double(embree)));
  else if (report.reason.empty())
    report.reason = fmt::format("{}: exact, it would take more memory than a compact BVH of Embree, {}",
                                otherwise, format_bytes(double(embree)));
  return is_exact;
}

bool lay_out_exact_if_preferred(const BakeOptions& options, Candidate& candidate,
                                std::string_view otherwise) {
  if (!options.max_bytes && options.max_error != 0.0)
    return lay_out_exact_if_small(options, candidate, otherwise);
  const bool is_exact = candidate.lay_out_exact(kNoBudget);
  if (is_exact)
    candidate.report.reason =
        options.max_bytes ? "exact: the size limit leaves room for it" : "exact: no answer may be wrong";
  return is_exact;
}

/// Replaces exact forms by others, for the objects that save most by it, until the file fits or no exact form
/// is left.
void make_room(BakeRun& run, const Alternative& other) {
  if (!other.encoding || run.fits()) return;
  std::vector<std::pair<int64_t, size_t>> savings;
  for (Candidate& candidate : run.candidates) {
    if (candidate.chosen() == *other.encoding || !candidate.suits(*other.encoding)) continue;
    candidate.lay_out(*other.encoding, 1);
    const int64_t saved =
        int64_t(candidate.form().cost.bytes) - int64_t(candidate.form_in(*other.encoding).cost.bytes);
    if (saved > 0) savings.emplace_back(-saved, candidate.index);
  }
  std::sort(savings.begin(), savings.end());
  for (const auto& [saved, i] : savings) {
    if (run.fits()) return;
    Candidate& candidate = run.candidates[i];
    candidate.report.reason =
        fmt::format("{}: the size limit leaves no room for {} of {}", other.word, candidate.encoder().noun(),
                    format_bytes(double(candidate.form().cost.bytes)));
    candidate.choose(*other.encoding);
  }
}

}  // namespace

void choose_forms(BakeRun& run) {
  if (run.options.encoding != kAutomatic)
    return lay_out_each(run, [&](Candidate& candidate) {
      for (size_t e = 0; e < run.encoders.size(); ++e)
        if (candidate.suits(e)) candidate.lay_out(e, 1);
    });
  const Alternative other = alternative_for(run);
  lay_out_each(run, [&](Candidate& candidate) {
    if (candidate.prepared.has_holes() || candidate.prepared.bends) {
      candidate.lay_out_exact(kNoBudget);
      return;
    }
    if (lay_out_exact_if_preferred(run.options, candidate, other.word)) {
      candidate.report.reason += why_without_planes(run.options);
      return;
    }
    candidate.choose(*other.encoding);
    candidate.lay_out(*other.encoding, 1);
  });
  make_room(run, other);
}

}  // namespace nif::bake
