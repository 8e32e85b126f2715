// Lays the BVH out, slivers and triangle numbers with it. Also counts the nodes that rays visit: from
// that count `auto` estimates how long an answer takes.
#include "bake/bvh/encoder.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bake/bvh/builder.hpp"
#include "bake/encoder.hpp"
#include "bake/work.hpp"
#include "kernels/reference/bvh/query.hpp"

namespace nif::bake {
namespace {

class BvhEncoder final : public Encoder {
 public:
  explicit BvhEncoder(const BakeOptions& options) : options_(options) {}

  std::string_view name() const override { return format::EncodingOf<kernels::BvhField>::kName; }
  std::string_view noun() const override { return "a BVH"; }
  std::string_view smallest() const override { return "BVHs"; }
  AnswerKind kind() const override { return AnswerKind::exact; }

  std::string obstacle(std::span<const mesh::Float3> positions) const override {
    if (fits_bvh(positions)) return {};
    return fmt::format("coordinates beyond {:.1e} are too large for a BVH to compute with",
                       kernels::kMaxBvhCoordinate / 4);
  }

  void lay_out(const Prepared& prepared, double, bool, bool, Form& form) const override {
    form.object().content = lay_out_bvh(prepared, options_, form.object(), form.cost.bytes);
    form.cost.resident = form.cost.bytes;
    form.report = BvhBaking::Report();
    form.sections = format::section_bytes(form.alone);
  }

  double work(const Form& form, const RaySource& source, uint64_t seed) const override {
    return work_of(std::get<kernels::BvhField>(form.field()), source, seed);
  }

  void add(Form&& form, format::Asset& asset) const override {
    asset.objects.push_back(std::move(form.object()));
  }

 private:
  const BakeOptions& options_;
};

}  // namespace

std::unique_ptr<Encoder> BvhBaking::make(const BakeOptions& options) {
  return std::make_unique<BvhEncoder>(options);
}

format::Bvh lay_out_bvh(const Prepared& prepared, const BakeOptions& options, format::Object& object,
                        uint64_t& bytes) {
  // With slivers, which close what rounding opens between the triangles on both sides of them.
  const mesh::CleanMesh& surface = prepared.surface;
  std::vector<mesh::Triangle> all;
  if (!surface.slivers.empty()) {
    all = surface.triangles;
    all.insert(all.end(), surface.slivers.begin(), surface.slivers.end());
  }
  std::vector<uint32_t> order;
  format::Bvh bvh = build_bvh(surface.positions, all.empty() ? surface.triangles : all,
                              options.source_triangles ? &order : nullptr);
  bytes = bvh.bytes();
  if (!options.source_triangles) return bvh;
  std::vector<uint32_t> numbers = mesh::source_triangles(surface);
  numbers.insert(numbers.end(), surface.sliver_numbers.begin(), surface.sliver_numbers.end());
  for (uint32_t& triangle : order) triangle = numbers[triangle];
  const auto triangles = uint32_t(prepared.source->triangles.size());
  bytes += format::source_bytes(order.size(), triangles);
  object.source_triangles = {triangles, std::move(order)};
  return bvh;
}

// docs/results/work.md has how it was fitted.
double BvhCounts::nanoseconds() const { return 19 * double(nodes); }

BvhCounts count_work(const kernels::BvhField& field, std::span<const Segment> rays) {
  return count_all<BvhCounts>(rays, [&](const Segment& segment, BvhCounts& counts) {
    kernels::BvhRay ray;
    if (!kernels::prepare_ray(field, segment, ray)) return;
    kernels::meets_bvh(field, ray, &counts.nodes);
  });
}

double work_of(const kernels::BvhField& field, const RaySource& source, uint64_t seed) {
  return mean_work(source, seed, [&](std::span<const Segment> rays) { return count_work(field, rays); });
}

void describe(const format::BvhView& view, nlohmann::ordered_json& json) {
  json["nodes"] = view.field.node_count;
  json["vertices"] = view.field.vertex_count;
  json["bytes"] = {{"bvh", view.tree_bytes}};
}

std::string summary(const format::BvhView& view) { return fmt::format("{} nodes", view.field.node_count); }

}  // namespace nif::bake
