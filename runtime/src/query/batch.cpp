// Takes one batch through all steps of a query: reads its rays, answers them, offers uncertain ones to the
// fallback, and writes the answers.
#include "query/batch.hpp"

#include <algorithm>
#include <cmath>

#include "query/first_hits.hpp"
#include "query/read_rays.hpp"
#include "query/visibility.hpp"
#include "query/write_answers.hpp"

namespace nif::runtime {
namespace {

/// Passes the batch's rays that are neither certain nor confident enough to the fallback, and treats its
/// answers as proven.
void ask_fallback(const Request& request, uint64_t first, WorkArea& area) {
  uint32_t asked = 0;
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    const float p = area.probability[i];
    if (area.answers.certain[i] || std::max(p, 1 - p) >= request.confidence) continue;
    area.visible[asked] = area.answers.logit[i] >= 0;
    area.fallback_rays[asked++] = first + i;
  }
  if (asked == 0) return;
  request.fallback(request.fallback_user, asked, area.fallback_rays, area.visible);
  for (uint32_t k = 0; k < asked; ++k) {
    const auto i = uint32_t(area.fallback_rays[k] - first);
    const bool visible = area.visible[k] != 0;
    area.answers.logit[i] = visible ? kernels::kCertainLogit : -kernels::kCertainLogit;
    area.answers.certain[i] = 1;
    area.probability[i] = visible ? 1.0f : 0.0f;
  }
}

}  // namespace

void answer_batch_of(const NifSceneObject& scene, const Request& request, uint64_t batch, WorkArea& area) {
  const NifRays& rays = request.rays;
  const uint64_t first = batch * request.batch_rays;
  const auto count = uint32_t(std::min<uint64_t>(request.batch_rays, rays.count - first));
  read_rays(rays, first, count, area);
  const bool masked = rays.mask != nullptr;
  if (request.hits) {
    intersect_batch(scene, masked, request.hits->normal != nullptr, area);
    write_hits(scene, *request.hits, first, area);
    return;
  }
  answer_batch(scene, masked,
               request.open       ? Wanted::proofs()
               : request.fallback ? Wanted::everything()
                                  : Wanted(request.answers),
               area);
  if (request.fallback) ask_fallback(request, first, area);
  if (request.open) list_open_rays(*request.open, first, area);
  write_answers(request.answers, first, count, area);
}

}  // namespace nif::runtime
