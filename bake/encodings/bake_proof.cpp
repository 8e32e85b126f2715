// Builds `proof` objects: fits a grid to its budget, then checks whether planes are worth it. If they would
// not save a quarter of the counted work of a BVH alone, they are left out and a very coarse grid remains.
#include "bake/encodings/bake_proof.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bake/encoder.hpp"
#include "bake/encodings/bake_exact.hpp"
#include "bake/triangles/builder.hpp"

namespace nif::bake {
namespace {

class ProofEncoder final : public Encoder {
 public:
  explicit ProofEncoder(const BakeOptions& options) : options_(options), shape_(proof_shape_for(options)) {}

  std::string_view name() const override { return kernels::encoding_of_field<kernels::PlanesField>().name; }
  std::string_view noun() const override { return "planes"; }
  std::string_view smallest() const override { return "the coarsest grids"; }
  AnswerKind kind() const override { return AnswerKind::open; }
  Holes holes() const override { return Holes::any; }
  bool has_scale(double scale) const override { return bake::has_scale(shape_, scale); }

  void lay_out(const Prepared& prepared, double scale, bool bounded, bool, Form& form) const override {
    format::PlanesData& planes = form.object().planes.emplace();
    ProofBaking::Report report;
    form.scale = fit_proof(prepared, shape_, scale, bounded, options_, form.object().name, planes, report,
                           [&] { return count(form); });
    form.report = report;
  }

  /// Leaves planes out if a BVH alone takes less work than one behind planes: the remaining grid only proves
  /// which rays miss it.
  std::string leave_out(const Prepared& prepared, const RaySource& source, uint64_t seed,
                        Form& form) const override {
    if (options_.resolution) return {};
    format::PlanesData& planes = *form.object().planes;
    const format::TrianglesData bvh = build_bvh(prepared.surface.positions, prepared.surface.triangles);
    const double alone = work_of(format::field_of(bvh), source, seed),
                 behind = work_of(kernels::ExactField{format::field_of(planes), format::field_of(bvh)},
                                  source, seed);
    // Listing open rays takes time, too, which is not counted (docs/results/proof.md).
    constexpr double kLargestShare = 0.75;
    if (behind < kLargestShare * alone) return {};
    constexpr GridShape kCoarsest{2, 0, 1, kNoBudget};
    const LaidOut grid = lay_out_grid(prepared, kCoarsest, 1, false);
    store_occupancy(grid.occupancy, form.object().name, planes);
    planes.levels = 0;
    leave_bare(planes);
    ProofBaking::Report report;
    report.voxels = grid.grid.voxels;
    report.surface_voxels = grid.occupancy.surface_voxels;
    form.report = report;
    count(form);
    return fmt::format(
        "planes are left out, because they would not save a quarter of the work: {:.0f} ns a ray with them "
        "and a BVH "
        "behind, {:.0f} ns by the BVH alone, counted",
        behind, alone);
  }

  void add(Form&& form, format::Asset& asset) const override {
    asset.objects.push_back(std::move(form.object()));
  }

  void add_options(nlohmann::ordered_json& json) const override { add_shape_options(options_, json); }

 private:
  static uint64_t count(Form& form) {
    form.sections = format::section_bytes(form.alone);
    return form.cost.bytes = payload_bytes(form.sections);
  }

  const BakeOptions& options_;
  const GridShape shape_;
};

}  // namespace

std::unique_ptr<Encoder> ProofBaking::make(const BakeOptions& options) {
  return std::make_unique<ProofEncoder>(options);
}

void add_metadata(const ProofBaking::Report& report, const ObjectReport&, const format::Object&,
                  nlohmann::ordered_json& json) {
  json["voxels"] = report.voxels;
}

}  // namespace nif::bake
