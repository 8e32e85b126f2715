// The list of encodings that the baker makes, and what is built from it. To add one, add a file to
// bake/encodings, and its name to the list (docs/adding-a-part.md).
//
// That file has a structure for the list, with
// - Field: that of the kernels;
// - Options: the members that BakeOptions has for this encoding alone;
// - Report: what ObjectReport says about its objects alone;
// - kAutomatic: whether "auto" may choose it;
// - kStandsInFor: the encoding that this one replaces for an object if it counts less work, unless a
//   resolution is given; or none;
// - kGrids: whether it has grids, so that presets apply to it;
// - kKind: what kind of answers it gives (bake/choice.hpp);
// - kHelp: its description in `nif bake --help`;
// - kForHoles, if objects with holes get it unless the encoding that is asked for can have holes, and no others
//   do: it cannot be asked for itself;
// - make(const BakeOptions&): its Encoder (bake/encoder.hpp);
// and overloads of these functions, by its report:
// - add_report(report, json): for `nif bake --json`;
// - add_metadata(report, object report, object, json): for the asset's metadata.
#pragma once

#include <tuple>
#include <variant>

#include "bake/encodings/bake_bvh.hpp"
#include "bake/encodings/bake_cutout.hpp"
#include "bake/encodings/bake_exact.hpp"
#include "bake/encodings/bake_proof.hpp"
#include "bake/encodings/bake_segment.hpp"
#include "bake/spherical/spherical_encoder.hpp"

namespace nif::bake {

/// T<...> of all encodings, in the order in which people see them.
template <template <class...> class T>
using OfEncoders = T<SegmentBaking, ExactBaking, BvhBaking, ProofBaking, SphericalBaking, CutoutBaking>;

template <class... Baking>
struct OptionsOf : Baking::Options... {};
template <class... Baking>
using AnyReportOf = std::variant<typename Baking::Report...>;

/// Whether an encoding is for objects with holes.
template <class Baking>
inline constexpr bool kIsForHoles = requires {
  Baking::kForHoles;
};

/// The options of all encodings together.
using EncodingOptions = OfEncoders<OptionsOf>;
/// The report of one of them.
using AnyReport = OfEncoders<AnyReportOf>;

}  // namespace nif::bake
