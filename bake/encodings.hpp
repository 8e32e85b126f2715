// The encodings that the baker makes: this list, and what is built from it. A new encoding adds a file to
// bake/encodings, and its name to the list (docs/adding-a-part.md).
//
// That file has a structure for the list, with
// - Field: the kernels';
// - Options: the members that BakeOptions has for it alone;
// - Report: what ObjectReport says of its objects alone;
// - kAutomatic: whether "auto" may choose it;
// - kStandsInFor: the encoding in whose place an object gets this one where it counts less work, unless a
//   resolution is asked for; or none;
// - kGrids: whether it has grids, so that presets mean something to it;
// - kKind: what its answers are (bake/choice.hpp);
// - kHelp: what it is, for `nif bake --help`;
// - make(const BakeOptions&): its Encoder (bake/encoder.hpp);
// and overloads of these functions, by its report:
// - add_report(report, json): for `nif bake --json`;
// - add_metadata(report, object report, object, json): for the asset's metadata.
#pragma once

#include <tuple>
#include <variant>

#include "bake/encodings/bvh.hpp"
#include "bake/encodings/exact.hpp"
#include "bake/encodings/proof.hpp"
#include "bake/encodings/segment.hpp"
#include "bake/spherical/encoder.hpp"

namespace nif::bake {

/// T<...> of all encodings, in the order in which they are named to people.
template <template <class...> class T>
using OfEncoders = T<SegmentBaking, ExactBaking, BvhBaking, ProofBaking, SphericalBaking>;

template <class... Baking>
struct OptionsOf : Baking::Options... {};
template <class... Baking>
using AnyReportOf = std::variant<typename Baking::Report...>;

/// The options of all encodings together.
using EncodingOptions = OfEncoders<OptionsOf>;
/// The report of one of them.
using AnyReport = OfEncoders<AnyReportOf>;

}  // namespace nif::bake
