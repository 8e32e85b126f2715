// Lays out triangles as for `bvh`, and the holes that they have.
#include "bake/encodings/bake_cutout.hpp"

#include <fmt/format.h>

#include "bake/encoder.hpp"
#include "bake/encodings/bake_bvh.hpp"
#include "bake/holes/lay_out_holes.hpp"

namespace nif::bake {
namespace {

class CutoutEncoder final : public Encoder {
 public:
  explicit CutoutEncoder(const BakeOptions& options) : options_(options) {}

  std::string_view name() const override { return kernels::encoding_of_field<kernels::CutoutField>().name; }
  std::string_view noun() const override { return "a BVH with holes"; }
  std::string_view smallest() const override { return "BVHs with holes"; }
  AnswerKind kind() const override { return AnswerKind::exact; }
  Holes holes() const override { return Holes::only; }

  std::string obstacle(std::span<const mesh::Float3> positions) const override {
    return obstacle_of_bvh(positions);
  }

  void lay_out(const Prepared& prepared, double, bool, bool, Form& form) const override {
    std::vector<uint32_t> order;
    const uint64_t triangles = lay_out_triangles(prepared, options_, form.object(), &order),
                   numbers = triangles - form.object().triangles->bytes();
    form.object().holes = lay_out_holes(prepared.surface, order, form.alone.alpha_maps);
    form.cost.resident = triangles + form.object().holes->bytes();
    for (const kernels::AlphaMap& map : form.alone.alpha_maps)
      form.cost.resident += kernels::alpha_tiles(map.width, map.height) * sizeof(uint64_t);
    form.report = CutoutBaking::Report();
    form.sections = format::section_bytes(form.alone);
    form.cost.bytes = payload_bytes(form.sections) + numbers;
  }

  double work(const Form& form, const RaySource& source, uint64_t seed) const override {
    return work_of(std::get<kernels::CutoutField>(form.field()).triangles, source, seed);
  }

  void add(Form&& form, format::Asset& asset) const override {
    share_alpha_maps(*form.object().holes, form.alone.alpha_maps, asset.alpha_maps);
    asset.objects.push_back(std::move(form.object()));
  }

 private:
  const BakeOptions& options_;
};

}  // namespace

std::unique_ptr<Encoder> CutoutBaking::make(const BakeOptions& options) {
  return std::make_unique<CutoutEncoder>(options);
}

}  // namespace nif::bake
