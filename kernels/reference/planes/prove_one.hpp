// Answers one segment of a batch by proofs alone.
#pragma once

#include "kernels/reference/batch.hpp"
#include "kernels/reference/planes/open.hpp"

namespace nif::kernels {

/// Field: as for follow_segment().
template <class Field>
void prove_one(const Field& field, const SegmentBatch& batch, uint32_t i, AnswerBatch& answers,
               OpenBatch& open) {
  OpenInterval part;
  const Answer answer = prove(field, segment_of(batch, i), part);
  answers.logit[i] = answer.logit;
  answers.certain[i] = answer.certain;
  open.begin[i] = part.begin;
  open.end[i] = part.end;
}

}  // namespace nif::kernels
