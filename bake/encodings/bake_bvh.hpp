// Bakes `bvh` objects: exact, without training.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bake/choice.hpp"
#include "bake/triangles/describe_triangles.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

class Encoder;
struct BakeOptions;
struct ObjectReport;
struct Prepared;
struct RaySource;

struct BvhBaking {
  using Field = kernels::TrianglesField;
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

/// Why an object with these positions cannot have a BVH; empty if it can.
std::string obstacle_of_bvh(std::span<const mesh::Float3> positions);

/// Gives an object the triangles of a prepared mesh and, if requested, their numbers in the source mesh.
/// Returns their size in a file. `order`, if not null, receives of each triangle of the object its index among those
/// of the clean mesh and then its slivers.
uint64_t lay_out_triangles(const Prepared& prepared, const BakeOptions& options, format::Object& object,
                           std::vector<uint32_t>* order = nullptr);

/// Work of the fast kernels for rays, by which encodings are compared.
struct BvhCounts {
  uint64_t nodes = 0;  ///< leaves grow with them, and would add no information

  BvhCounts operator+(const BvhCounts& other) const { return {nodes + other.nodes}; }
  double nanoseconds() const;
};
BvhCounts count_work(const kernels::TrianglesField& field, std::span<const kernels::Segment> rays);
/// Mean work per ray, as mean_work().
double work_of(const kernels::TrianglesField& field, const RaySource& source, uint64_t seed);

}  // namespace nif::bake
