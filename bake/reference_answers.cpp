// Asks the scalar kernels, one ray after the other.
#include "bake/reference_answers.hpp"

#include <variant>

#include "kernels/reference/scene_hit.hpp"
#include "kernels/reference/scene_query.hpp"

namespace nif::bake {
namespace {

static_assert(FirstHits::kNoTriangle == kernels::kNoTriangle);

template <class Field>
double fineness_of(const Field& field) {
  if constexpr (requires { field.voxels_per_unit; })
    return double(field.voxels_per_unit);
  else if constexpr (requires { field.planes; })
    return fineness_of(field.planes);
  else
    return 0;
}

}  // namespace

Answerer reference_answerer(const kernels::AnyField& field) {
  return std::visit(
      [](const auto& own) -> Answerer {
        return [own](std::span<const Segment> segments, const Answers& answers) {
          for (size_t i = 0; i < segments.size(); ++i) {
            const kernels::Answer answer = kernels::query(own, segments[i]);
            answers.visible[i] = answer.visible;
            answers.certain[i] = answer.certain;
            answers.probability[i] = kernels::visible_probability(answer.logit, kernels::calibration(own));
          }
        };
      },
      field);
}

HitFinder reference_finder(const kernels::AnyField& field) {
  return std::visit(
      [](const auto& own) -> HitFinder {
        return [own](std::span<const Segment> segments) {
          FirstHits found(segments.size());
          for (size_t i = 0; i < segments.size(); ++i) {
            const kernels::Hit hit = kernels::intersect(own, segments[i]);
            found.hit[i] = hit.t < kernels::kNoHit;
            found.certain[i] = hit.certain();
            found.t[i] = hit.t;
            found.u[i] = hit.u;
            found.v[i] = hit.v;
            found.low[i] = hit.low;
            found.high[i] = hit.high;
            found.triangle[i] = hit.triangle;
            float normal[3];
            kernels::world_normal(nullptr, hit.normal, segments[i].direction, normal);
            found.normal[i] = std::to_array(normal);
          }
          return found;
        };
      },
      field);
}

double voxels_per_unit(const kernels::AnyField& field) {
  return std::visit([](const auto& own) { return fineness_of(own); }, field);
}

}  // namespace nif::bake
