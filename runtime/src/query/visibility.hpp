// Finds which rays of a batch are visible in a scene.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// The answers that a query asks for.
struct Wanted {
  explicit Wanted(const NifAnswers& answers)
      : probability(answers.probability != nullptr),
        details(answers.probability || answers.certain || answers.logit) {}

  static Wanted everything() { return Wanted(); }
  /// Only proofs, and the parts of rays that they leave open.
  static Wanted proofs() {
    Wanted wanted;
    wanted.open = true;
    return wanted;
  }

  bool probability = true;
  bool details = true;  ///< more than the visible bit: a learned "occluded" does not end the search
  bool open = false;    ///< evaluates no network; area.open gets the intervals that are not certain

 private:
  Wanted() = default;
};

/// Answers area.rays (with area.mask if `masked`) in area.answers, and in area.probability if wanted. The
/// answer for a ray depends neither on the other rays of the batch nor on what else is wanted.
void answer_batch(const NifSceneObject& scene, bool masked, const Wanted& wanted, WorkArea& area);

}  // namespace nif::runtime
