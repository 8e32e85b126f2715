// Lays out the BVH, including slivers and triangle numbers. Also counts the nodes that rays visit: `auto`
// estimates from that count how long an answer takes.
#include "bake/encodings/bake_bvh.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bake/encoder.hpp"
#include "bake/triangles/builder.hpp"
#include "bake/work.hpp"
#include "formats/mesh/skin.hpp"
#include "kernels/reference/triangles/triangles_query.hpp"

namespace nif::bake {
namespace {

class BvhEncoder final : public Encoder {
 public:
  explicit BvhEncoder(const BakeOptions& options) : options_(options) {}

  std::string_view name() const override {
    return kernels::encoding_of_field<kernels::TrianglesField>().name;
  }
  std::string_view noun() const override { return "a BVH"; }
  std::string_view smallest() const override { return "BVHs"; }
  AnswerKind kind() const override { return AnswerKind::exact; }
  bool bends() const override { return true; }

  std::string obstacle(std::span<const mesh::Float3> positions) const override {
    return obstacle_of_bvh(positions);
  }

  void lay_out(const Prepared& prepared, double, bool, bool, Form& form) const override {
    form.cost.bytes = lay_out_triangles(prepared, options_, form.object());
    form.cost.resident = form.cost.bytes;
    form.report = BvhBaking::Report();
    form.sections = format::section_bytes(form.alone);
  }

  double work(const Form& form, const RaySource& source, uint64_t seed) const override {
    return work_of(std::get<kernels::TrianglesField>(form.field()), source, seed);
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

std::string obstacle_of_bvh(std::span<const mesh::Float3> positions) {
  if (fits_bvh(positions)) return {};
  return fmt::format("coordinates beyond {:.1e} are too large for a BVH to compute with",
                     kernels::kMaxBvhCoordinate / 4);
}

namespace {

format::Skin stored(const mesh::Skin& skin, size_t vertices) {
  format::Skin stored{
      uint32_t(vertices), skin.joint_count, skin.influences, uint32_t(skin.targets.size()), skin.weights, {},
      skin.joints};
  for (const std::vector<mesh::Float3>& target : skin.targets)
    stored.targets.insert(stored.targets.end(), target.begin(), target.end());
  return stored;
}

/// All triangles as they are in the source, because any may get an area, and vertices at the same place may part.
uint64_t lay_out_bending(const Prepared& prepared, const BakeOptions& options, format::Object& object) {
  const mesh::Mesh& source = *prepared.source;
  std::vector<uint32_t> order, vertices;
  object.triangles = build_bvh(source.positions, source.triangles, &order, &vertices);
  const auto vertex_count = uint32_t(source.positions.size());
  uint64_t bytes = object.triangles->bytes() + format::numbers_bytes(vertices.size(), vertex_count);
  object.numbers[format::kSourceVertices] = {vertex_count, std::move(vertices)};
  if (options.source_triangles || source.merged()) {
    const auto triangles = uint32_t(source.triangles.size());
    bytes += format::numbers_bytes(order.size(), triangles);
    object.numbers[format::kSourceTriangles] = {triangles, std::move(order)};
  }
  if (source.skin) {
    object.skin = stored(*source.skin, vertex_count);
    bytes += format::skin_bytes(vertex_count, object.skin->influences, object.skin->target_count);
  }
  return bytes;
}

}  // namespace

uint64_t lay_out_triangles(const Prepared& prepared, const BakeOptions& options, format::Object& object,
                           std::vector<uint32_t>* places) {
  if (prepared.bends) return lay_out_bending(prepared, options, object);
  // Including slivers, which close the gaps that rounding opens between the triangles on both sides of them.
  const mesh::CleanMesh& surface = prepared.surface;
  std::vector<mesh::Triangle> all;
  if (!surface.slivers.empty()) {
    all = surface.triangles;
    all.insert(all.end(), surface.slivers.begin(), surface.slivers.end());
  }
  // Hits on a merged object tell by these numbers which of its parts they are on.
  const bool numbered = options.source_triangles || prepared.source->merged();
  std::vector<uint32_t> order;
  object.triangles = build_bvh(surface.positions, all.empty() ? surface.triangles : all,
                               numbered || places ? &order : nullptr);
  if (places) *places = order;
  uint64_t bytes = object.triangles->bytes();
  if (!numbered) return bytes;
  std::vector<uint32_t> numbers = mesh::source_triangles(surface);
  numbers.insert(numbers.end(), surface.sliver_numbers.begin(), surface.sliver_numbers.end());
  for (uint32_t& triangle : order) triangle = numbers[triangle];
  const auto triangles = uint32_t(prepared.source->triangles.size());
  bytes += format::numbers_bytes(order.size(), triangles);
  object.numbers[format::kSourceTriangles] = {triangles, std::move(order)};
  return bytes;
}

// docs/results/work.md describes the fit.
double BvhCounts::nanoseconds() const { return 19 * double(nodes); }

BvhCounts count_work(const kernels::TrianglesField& field, std::span<const Segment> rays) {
  return count_all<BvhCounts>(rays, [&](const Segment& segment, BvhCounts& counts) {
    kernels::BvhRay ray;
    if (!kernels::prepare_ray(field, segment, ray)) return;
    kernels::meets_bvh(field, ray, &counts.nodes);
  });
}

double work_of(const kernels::TrianglesField& field, const RaySource& source, uint64_t seed) {
  return mean_work(source, seed, [&](std::span<const Segment> rays) { return count_work(field, rays); });
}

}  // namespace nif::bake
