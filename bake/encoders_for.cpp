// Makes the encoders that a bake may use, from the list of all encodings and the options.
#include <fmt/format.h>

#include "bake/encoder.hpp"

namespace nif::bake {
namespace {

bool may_choose(AnswerKind kind, const BakeOptions& options) {
  switch (kind) {
    case AnswerKind::exact:
      break;
    case AnswerKind::learned:
      return !options.open_rays && options.max_error != 0.0;
    case AnswerKind::open:
      return options.open_rays;
  }
  return true;
}

template <class Baking>
void add_encoder(const BakeOptions& options, Encoders& encoders) {
  if (kIsForHoles<Baking>) return;  // added below
  const bool keeps_colors = Baking::kGrids || !options.colors;
  const bool wanted =
      options.encoding == kAutomatic
          ? Baking::kAutomatic && keeps_colors && may_choose(Baking::kKind, options)
          : options.encoding == kernels::encoding_of_field<typename Baking::Field>().name ||
                (options.encoding == Baking::kStandsInFor && keeps_colors && !options.resolution);
  if (wanted) encoders.push_back(Baking::make(options));
}
template <class... Baking>
struct EncodersOf {
  static Encoders make(const BakeOptions& options) {
    Encoders encoders;
    (add_encoder<Baking>(options, encoders), ...);
    return encoders;
  }
};

}  // namespace

Encoders encoders_for(const BakeOptions& options, bool any_holes) {
  Encoders encoders = OfEncoders<EncodersOf>::make(options);
  if (encoders.empty())
    throw Error(Status::usage, fmt::format("no encoding is called '{}'", options.encoding));
  if (any_holes && (options.encoding == kAutomatic || encoders.front()->holes() == Encoder::Holes::none))
    encoders.push_back(CutoutBaking::make(options));
  return encoders;
}

}  // namespace nif::bake
