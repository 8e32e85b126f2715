#include "bake/proof/encoder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bake/encoder.hpp"

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
    form.scale =
        fit_proof(prepared, shape_, scale, bounded, options_, form.object().name, proof, report, [&] {
          form.sections = format::section_bytes(form.alone);
          form.cost.bytes = 0;
          for (const auto& [type, bytes] : form.sections)
            if (type == format::kProofOccupancy || type == format::kProofCells) form.cost.bytes += bytes;
          return form.cost.bytes;
        });
    form.report = report;
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
