// Baking of `bvh` objects: exact, and nothing is trained.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bake/choice.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;
struct Prepared;
struct RaySource;

struct BvhBaking {
  using Data = format::Bvh;
  struct Options {};
  struct Report {};
  static constexpr bool kAutomatic = true;
  static constexpr std::string_view kStandsInFor = "exact";
  static constexpr bool kGrids = false;
  static constexpr AnswerKind kKind = AnswerKind::exact;
  static constexpr const char* kHelp = "exact, about 18 bytes per triangle, no training";
  static std::unique_ptr<Encoder> make(const BakeOptions& options);
};

inline void add_report(const BvhBaking::Report&, nlohmann::ordered_json&) {}
inline void add_metadata(const BvhBaking::Report&, const ObjectReport&, const format::Object&,
                         nlohmann::ordered_json&) {}
void describe(const format::BvhView& view, nlohmann::ordered_json& json);
std::string summary(const format::BvhView& view);
inline std::vector<std::string> details(const format::BvhView&) { return {}; }

/// The BVH of a prepared mesh. The object gets the numbers of its triangles in the source mesh if they are
/// wanted; `bytes`, what both take of a file.
format::Bvh lay_out_bvh(const Prepared& prepared, const BakeOptions& options, format::Object& object,
                        uint64_t& bytes);

/// What rays take of the fast kernels, by which encodings are compared.
struct BvhCounts {
  uint64_t nodes = 0;  ///< leaves grow with them, and would say no more

  BvhCounts operator+(const BvhCounts& other) const { return {nodes + other.nodes}; }
  double nanoseconds() const;
};
BvhCounts count_work(const kernels::BvhField& field, std::span<const kernels::Segment> rays);
/// Mean work of a ray, as mean_work().
double work_of(const kernels::BvhField& field, const RaySource& source, uint64_t seed);

}  // namespace nif::bake
