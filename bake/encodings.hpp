// The encodings that the baker makes: this list, and what is built from it. A new encoding adds a folder here
// with its encoder.hpp, and its name to the list (docs/adding-an-encoding.md).
//
// A folder's encoder.hpp has a structure for the list, with
// - Data: the format's;
// - Options: the members that BakeOptions has for it alone;
// - Report: what ObjectReport says of its objects alone;
// - kAutomatic: whether "auto" may choose it;
// - kStandsInFor: the encoding in whose place an object gets this one where it counts less work, unless a
//   resolution is asked for; or none;
// - kGrids: whether it has grids, so that presets mean something to it;
// - kKind: what its answers are (bake/choice.hpp);
// - kHelp: what it is, for `nif bake --help`;
// - make(const BakeOptions&): its Encoder (bake/encoder.hpp);
// and overloads of these functions, by its report and by the format's views:
// - add_report(report, json): for `nif bake --json`;
// - add_metadata(report, object report, object, json): for the asset's metadata;
// - describe(view, json), summary(view), details(view): for `nif info`, as JSON, in a few words, and as lines
//   for people.
#pragma once

#include <tuple>
#include <variant>

#include "bake/bvh/encoder.hpp"
#include "bake/exact/encoder.hpp"
#include "bake/proof/encoder.hpp"
#include "bake/segment/encoder.hpp"
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
