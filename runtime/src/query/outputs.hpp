// Lists the outputs of a query in one place, for code that treats all of them alike.
#pragma once

#include <cstdint>

namespace nif::runtime {

struct OutputArray {
  const char* name;      ///< in messages
  uint32_t bits_of_ray;  ///< bits per ray; the array is dense, and its last byte is padded

  constexpr uint64_t bytes(uint64_t rays) const {
    return bits_of_ray >= 8 ? rays * (bits_of_ray / 8) : (rays * bits_of_ray + 7) / 8;
  }
};

/// Calls visit(about, array...) for each output, with its array in each of the structures: NifAnswers, or any
/// structure with members of the same names. An array is null if it is not asked for. Arrays of words come
/// first: laid out one after the other, all are aligned.
template <class Visit, class... Answers>
constexpr void visit_outputs(const Visit& visit, Answers&&... answers) {
  visit(OutputArray{"probability", 32}, answers.probability...);
  visit(OutputArray{"logit", 32}, answers.logit...);
  visit(OutputArray{"visible", 8}, answers.visible...);
  visit(OutputArray{"certain", 8}, answers.certain...);
  visit(OutputArray{"visible_bits", 1}, answers.visible_bits...);
}

/// The same for the outputs of first hits: NifHits, or any structure with members of the same names.
template <class Visit, class... Hits>
constexpr void visit_hit_outputs(const Visit& visit, Hits&&... hits) {
  visit(OutputArray{"hit", 8}, hits.hit...);
  visit(OutputArray{"t", 32}, hits.t...);
  visit(OutputArray{"normal", 96}, hits.normal...);
  visit(OutputArray{"instance", 32}, hits.instance...);
  visit(OutputArray{"object", 32}, hits.object...);
  visit(OutputArray{"triangle", 32}, hits.triangle...);
  visit(OutputArray{"u", 32}, hits.u...);
  visit(OutputArray{"v", 32}, hits.v...);
  visit(OutputArray{"certain", 8}, hits.certain...);
  visit(OutputArray{"t_low", 32}, hits.t_low...);
  visit(OutputArray{"t_high", 32}, hits.t_high...);
  visit(OutputArray{"color", 96}, hits.color...);
  visit(OutputArray{"user", 64}, hits.user...);
}

/// Bytes of all outputs of a query together.
constexpr uint64_t output_bytes(uint64_t rays) {
  struct {
    int probability, logit, visible, certain, visible_bits;
  } constexpr kAny{};
  uint64_t bytes = 0;
  visit_outputs([&](const OutputArray& about, int) { bytes += about.bytes(rays); }, kAny);
  return bytes;
}

}  // namespace nif::runtime
