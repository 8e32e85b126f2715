// What is visible of a batch of rays, in a scene.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"
#include "scene/scene.hpp"

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

/// From area.rays, and area.mask if `masked`, to area.answers, and area.probability where wanted. The answer to
/// a ray does not depend on the other rays of the batch, nor on what else is wanted.
void answer_batch(const NifSceneObject& scene, bool masked, const Wanted& wanted, WorkArea& area);

}  // namespace nif::runtime
