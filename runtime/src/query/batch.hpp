// Batches of a query: copied from the caller's arrays, in any layout, to columns, and answers copied back.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"

namespace nif::runtime {

/// Which answers a query asks for.
struct Wanted {
  explicit Wanted(const NifAnswers& answers)
      : probability(answers.probability != nullptr),
        details(answers.probability || answers.certain || answers.logit) {}

  static Wanted everything() { return Wanted(); }
  /// Proofs alone, and what they leave open.
  static Wanted proofs() {
    Wanted wanted;
    wanted.open = true;
    return wanted;
  }

  bool probability = true;
  bool details = true;  ///< more than the visible bit: then a learned "occluded" does not end the search
  bool open = false;    ///< no network is asked; area.open has the parts of rays that are not certain

 private:
  Wanted() = default;
};

/// Reads rays first .. first + count - 1, and their masks if they have any; count <= kBatchRays.
void read_rays(const NifRays& rays, uint64_t first, uint32_t count, WorkArea& area);

/// Adds the rays of the batch that are not certain to the caller's lists, and lets their answers say that
/// they are open. `first`: the batch's first ray in the query. Threads may do so at the same time.
void list_open_rays(const NifOpenRays& lists, uint64_t first, WorkArea& area);

/// Writes the area's answers to each output that is asked for. first is a multiple of 8.
void write_answers(const NifAnswers& answers, uint64_t first, uint32_t count, WorkArea& area);

}  // namespace nif::runtime
