#include "bake/oracle/evaluate.hpp"

#include <tbb/parallel_for.h>

#include <variant>

#include "kernels/reference/scene.hpp"

namespace nif::bake {

Accuracy& Accuracy::operator+=(const Accuracy& other) {
  rays += other.rays;
  leak += other.leak;
  spurious += other.spurious;
  certain += other.certain;
  certain_wrong += other.certain_wrong;
  squared_error += other.squared_error;
  return *this;
}

Accuracy evaluate(const LabelledRays& rays, const Answerer& answer, const Oracle& oracle) {
  constexpr size_t kChunk = 4096;
  const size_t count = rays.segments.size(), chunks = (count + kChunk - 1) / kChunk;
  std::vector<Accuracy> parts(chunks);
  tbb::parallel_for(size_t{0}, chunks, [&](size_t b) {
    const size_t first = b * kChunk, size = std::min(kChunk, count - first);
    uint8_t visible[kChunk], certain[kChunk];
    float probability[kChunk];
    answer(std::span(rays.segments).subspan(first, size), {visible, certain, probability});
    Accuracy& part = parts[b];
    part.rays = size;
    for (size_t i = 0; i < size; ++i) {
      const bool truth = rays.visible[first + i], wrong = (visible[i] != 0) != truth;
      part.leak += wrong && !truth;
      part.spurious += wrong && truth;
      part.certain += certain[i] != 0;
      part.certain_wrong += wrong && certain[i] && !oracle.in_doubt(rays.segments[first + i]);
      const double off = double(probability[i]) - (truth ? 1.0 : 0.0);
      part.squared_error += off * off;
    }
  });
  Accuracy all;
  for (const Accuracy& part : parts) all += part;
  return all;
}

Answerer reference_answerer(const kernels::AnyField& field) {
  return std::visit(
      [](const auto& own) -> Answerer {
        return [own](std::span<const Segment> segments, const Answers& answers) {
          for (size_t i = 0; i < segments.size(); ++i) {
            const kernels::Answer answer = kernels::query(own, segments[i]);
            answers.visible[i] = answer.visible;
            answers.certain[i] = answer.certain;
            answers.probability[i] = kernels::visible_probability(answer.logit, kernels::logit_scale(own));
          }
        };
      },
      field);
}

}  // namespace nif::bake
