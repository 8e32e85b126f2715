// Builds `exact` objects: the BVH first, then grids until one fits the budget, which counts the grid alone.
// Work is counted the way answers are found: a traversal of the planes, then of the BVH for rays left open.
#include "bake/encodings/bake_exact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bake/encoder.hpp"
#include "bake/encodings/bake_bvh.hpp"
#include "bake/loaded/grid_memory.hpp"
#include "bake/work.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"

namespace nif::bake {
namespace {

class ExactEncoder final : public Encoder {
 public:
  explicit ExactEncoder(const BakeOptions& options) : options_(options), shape_(proof_shape_for(options)) {}

  std::string_view name() const override { return kernels::encoding_of_field<kernels::ExactField>().name; }
  std::string_view noun() const override { return "planes in front of a BVH"; }
  std::string_view smallest() const override { return "the coarsest grids in front of BVHs"; }
  AnswerKind kind() const override { return AnswerKind::exact; }
  bool has_scale(double scale) const override { return bake::has_scale(shape_, scale); }

  std::string obstacle(std::span<const mesh::Float3> positions) const override {
    for (const mesh::Float3& p : positions)
      for (const float x : p)
        if (!(std::abs(x) <= kernels::kMaxExactCoordinate))
          return fmt::format("coordinates beyond {:.1e} are too large for planes to compute with",
                             kernels::kMaxExactCoordinate);
    return {};
  }

  void lay_out(const Prepared& prepared, double scale, bool bounded, bool, Form& form) const override {
    const uint64_t tree_bytes = lay_out_triangles(prepared, options_, form.object());
    format::PlanesData& planes = form.object().planes.emplace();
    ExactBaking::Report report;
    form.scale =
        fit_proof(prepared, shape_, scale, bounded, options_, form.object().name, planes, report, [&] {
          form.sections = format::section_bytes(form.alone);
          return form.cost.bytes =
                     payload_bytes(form.sections) - format::aligned(form.object().triangles->bytes());
        });
    form.report = report;
    form.cost.bytes += tree_bytes;
    form.cost.resident = form.cost.bytes + loaded_bytes(format::field_of(planes));
  }

  double work(const Form& form, const RaySource& source, uint64_t seed) const override {
    return work_of(std::get<kernels::ExactField>(form.field()), source, seed);
  }

  void add(Form&& form, format::Asset& asset) const override {
    asset.objects.push_back(std::move(form.object()));
  }

  void add_options(nlohmann::ordered_json& json) const override { add_shape_options(options_, json); }

 private:
  const BakeOptions& options_;
  const GridShape shape_;
};

}  // namespace

std::unique_ptr<Encoder> ExactBaking::make(const BakeOptions& options) {
  return std::make_unique<ExactEncoder>(options);
}

double ExactCounts::nanoseconds() const { return traversal.nanoseconds() + triangles.nanoseconds(); }

ExactCounts count_work(const kernels::ExactField& field, std::span<const kernels::Segment> rays) {
  return count_all<ExactCounts>(rays, [&](const kernels::Segment& segment, ExactCounts& counts) {
    kernels::TraversalResult traversal;
    kernels::OpenInterval open;
    ++counts.traversal.rays;
    const kernels::SeenSegment seen = kernels::seen_by_planes(field, segment);
    kernels::follow_segment(field.planes, seen.segment, traversal, kernels::KeepOpen{open},
                            CountCubes{field.planes, counts.traversal.cubes});
    kernels::BvhRay ray;
    if (traversal.certain || !kernels::prepare_ray(field.triangles, segment, ray)) return;
    if (traversal.verdict == kernels::Verdict::open)
      kernels::cull(field.planes, seen.segment, seen.start, open, ray);
    kernels::meets_bvh(field.triangles, ray, &counts.triangles.nodes);
  });
}

double work_of(const kernels::ExactField& field, const RaySource& source, uint64_t seed) {
  return mean_work(source, seed,
                   [&](std::span<const kernels::Segment> rays) { return count_work(field, rays); });
}

void add_metadata(const ExactBaking::Report& report, const ObjectReport&, const format::Object&,
                  nlohmann::ordered_json& json) {
  json["voxels"] = report.voxels;
}

}  // namespace nif::bake
