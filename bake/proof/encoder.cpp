// Fits a grid to its budget, then asks whether planes are worth it: if they would not save a quarter of
// the work of a BVH alone, as counted, they are left out and a very coarse grid remains.
#include "bake/proof/encoder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bake/bvh/builder.hpp"
#include "bake/encoder.hpp"
#include "bake/exact/encoder.hpp"

namespace nif::bake {
namespace {

class ProofEncoder final : public Encoder {
 public:
  explicit ProofEncoder(const BakeOptions& options) : options_(options), shape_(proof_shape_for(options)) {}

  std::string_view name() const override { return format::EncodingOf<kernels::ProofField>::kName; }
  std::string_view noun() const override { return "planes"; }
  std::string_view smallest() const override { return "the coarsest grids"; }
  AnswerKind kind() const override { return AnswerKind::open; }
  bool has_scale(double scale) const override { return bake::has_scale(shape_, scale); }

  void lay_out(const Prepared& prepared, double scale, bool bounded, bool, Form& form) const override {
    auto& proof = form.object().content.emplace<format::ProofData>();
    ProofBaking::Report report;
    form.scale = fit_proof(prepared, shape_, scale, bounded, options_, form.object().name, proof, report,
                           [&] { return count(form); });
    form.report = report;
  }

  /// Where a BVH alone takes less work than behind planes, they are left out: a grid remains that only knows
  /// what misses it.
  std::string leave_out(const Prepared& prepared, const RaySource& source, uint64_t seed,
                        Form& form) const override {
    if (options_.resolution) return {};
    auto& proof = form.object().as<format::ProofData>();
    const format::Bvh bvh = build_bvh(prepared.surface.positions, prepared.surface.triangles);
    const double alone = work_of(format::field_of(bvh), source, seed),
                 behind = work_of(kernels::ExactField{proof_of(proof), format::field_of(bvh)}, source, seed);
    // The lists of open rays take time, too, which is not counted (docs/results/proof.md).
    constexpr double kLargestShare = 0.75;
    if (behind < kLargestShare * alone) return {};
    constexpr GridShape kCoarsest{2, 0, 1, kNoBudget};
    const LaidOut grid = lay_out_grid(prepared, kCoarsest, 1, false);
    store_occupancy(grid.occupancy, form.object().name, proof);
    proof.levels = 0;
    leave_bare(proof);
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
    form.cost.bytes = 0;
    for (const auto& [type, bytes] : form.sections)
      if (type == format::kProofOccupancy || type == format::kProofCells) form.cost.bytes += bytes;
    return form.cost.bytes;
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

void describe(const format::ProofView& view, nlohmann::ordered_json& json) {
  const kernels::ProofField& grid = view.field;
  json["voxels"] = grid.voxels;
  json["levels"] = grid.levels;
  json["surface_voxels"] = grid.surface_voxels;
  json["parts"] = grid.part_count;
  json["bytes"] = {{"occupancy", view.occupancy.file}, {"planes", view.cells.file}};
}

std::string summary(const format::ProofView& view) {
  const kernels::ProofField& grid = view.field;
  return fmt::format("{} x {} x {} voxels, {} of them surface in {} parts", grid.voxels[0], grid.voxels[1],
                     grid.voxels[2], grid.surface_voxels, grid.part_count);
}

}  // namespace nif::bake
