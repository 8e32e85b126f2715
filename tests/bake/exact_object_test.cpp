// An `exact` object gives the answers of a BVH of the same triangles: in every bit, by every kernel. So do
// its planes alone, as a `proof` object, if the BVH answers the intervals that they leave open.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cstdlib>

#include "bake/triangles/builder.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/cpu/encodings/cpu_exact.hpp"
#include "kernels/cpu/encodings/cpu_proof.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"
#include "kernels/reference/planes/planes_hit.hpp"
#include "tests/bake/adversary.hpp"
#include "tests/support/real_meshes.hpp"

namespace nif::test {
namespace {

using kernels::cpu::Isa;

/// Object and BVH of a mesh, with planes as an OccupiedObject has them.
struct ExactObject {
  OccupiedObject occupied;
  std::vector<std::byte> file;  ///< kernels need the layout of a file
  kernels::ExactField field;

  ExactObject(mesh::Mesh source, uint32_t resolution, const CellOptions& options)
      : occupied(std::move(source), resolution, options) {
    format::Asset asset;
    format::Object& object = asset.objects.emplace_back();
    format::PlanesData& planes = object.planes.emplace();
    bake::store_occupancy(occupied.occupancy, occupied.mesh.name, planes);
    format::leave_bare(planes);  // numbers the voxels of bricks, of which there are fewer without corners
    planes.voxel_records = occupied.object.planes->voxel_records;
    planes.children = occupied.object.planes->children;
    object.triangles =
        bake::build_bvh(occupied.prepared.surface.positions, occupied.prepared.surface.triangles);
    file = format::encode(asset);
    field = format::read_asset(file, occupied.mesh.name).objects[0].as<kernels::ExactField>();
  }
};

struct Tally {
  std::atomic<uint64_t> rays{0}, proven{0}, differ{0};
};

bool visible_in(const kernels::TrianglesField& field, Segment segment, const kernels::OpenInterval& part) {
  segment.tmin = part.begin;
  segment.tmax = part.end;
  return kernels::query(field, segment).visible;
}

bool same(const kernels::Hit& a, const kernels::Hit& b) {
  return a.t == b.t && a.low == b.low && a.high == b.high && a.triangle == b.triangle && a.u == b.u &&
         a.v == b.v && std::equal(a.normal, a.normal + 3, b.normal);
}

/// Counts first hits of a batch, by the reference and each kernel, that differ from the BVH's or lie outside
/// of the planes' bounds.
uint64_t wrong_hits(const kernels::ExactField& field, const kernels::SegmentBatch& batch,
                    const std::vector<kernels::KernelPointer>& exact,
                    const std::vector<kernels::KernelPointer>& proofs, std::byte* scratch) {
  uint64_t wrong = 0;
  std::vector<kernels::Hit> expected, planes;
  for (uint32_t i = 0; i < batch.count; ++i) {
    const Segment segment = kernels::segment_of(batch, i);
    const kernels::Hit& hit = expected.emplace_back(kernels::intersect(field.triangles, segment));
    const kernels::Hit& bounds = planes.emplace_back(kernels::intersect(field.planes, segment));
    wrong += !same(kernels::intersect(field, segment), hit);
    wrong += !(bounds.low <= hit.t && (bounds.high == kernels::kNoHit || hit.t <= bounds.high));
  }
  const auto hits = std::make_unique<kernels::HitBatch>();
  const std::vector<float> limit(batch.count, kernels::kNoHit);
  const auto ask = [&](const std::vector<kernels::KernelPointer>& some,
                       const std::vector<kernels::Hit>& right) {
    for (const kernels::KernelPointer& kernel : some) {
      kernel->intersect(batch, limit.data(), *hits, scratch);
      for (uint32_t i = 0; i < batch.count; ++i) wrong += !same(kernels::hit_of(*hits, i), right[i]);
    }
  };
  ask(exact, expected);
  ask(proofs, planes);
  return wrong;
}

/// Queries adversarial segments with the reference and with each available kernel.
void compare(const ExactObject& o, uint64_t segments, bool by_reference, Tally& tally) {
  const Adversary adversary(o.occupied);
  std::pmr::memory_resource* const memory = std::pmr::get_default_resource();
  kernels::cpu::SharedCopies copies(memory);
  std::vector<kernels::KernelPointer> fast, proofs;
  for (const Isa isa : {Isa::sse4, Isa::avx2, Isa::avx512, Isa::neon}) {
    if (!kernels::cpu::available(isa)) continue;
    fast.push_back(kernels::cpu::make_kernel(o.field, {isa, memory, copies}));
    proofs.push_back(kernels::cpu::make_kernel(o.field.planes, {isa, memory, copies}));
  }
  tbb::parallel_for(uint64_t{0}, segments / kernels::kBatchRays, [&](uint64_t b) {
    struct Work {
      kernels::SegmentBatch batch;
      kernels::AnswerBatch answers;
      kernels::OpenBatch open;
      alignas(64) std::byte scratch[kernels::kKernelScratchBytes];
    };
    const auto work = std::make_unique<Work>();
    nif::Random random(23, 5, b);
    std::vector<kernels::Answer> expected, provable;
    std::vector<kernels::OpenInterval> parts;
    uint64_t proven = 0, differ = 0;
    work->batch.count = kernels::kBatchRays;
    for (uint32_t i = 0; i < kernels::kBatchRays; ++i) {
      Segment s = adversary.draw(random);
      if (random.below(16) == 0)  // beyond the reach of what planes prove
        for (float& x : s.origin) x *= static_cast<float>(random_size(random, 10.0, 1e6));
      kernels::set_segment(work->batch, i, s);
      expected.push_back(kernels::query(o.field.triangles, s));
      kernels::FullTraversal traversal;
      kernels::traverse_segment(o.field.planes, s, traversal);
      proven += traversal.certain;
      provable.push_back(kernels::prove(o.field.planes, s, parts.emplace_back()));
      differ += provable.back().certain
                    ? provable.back().visible != expected.back().visible
                    : visible_in(o.field.triangles, s, parts.back()) != expected.back().visible;
      if (!by_reference) continue;
      const kernels::Answer found = kernels::query(o.field, s);
      differ += found.visible != expected.back().visible || found.certain != expected.back().certain ||
                found.logit != expected.back().logit;
    }
    if (by_reference || b % 8 == 0) differ += wrong_hits(o.field, work->batch, fast, proofs, work->scratch);
    for (const kernels::KernelPointer& kernel : fast) {
      kernel->answer(work->batch, work->answers, work->scratch);
      for (uint32_t i = 0; i < kernels::kBatchRays; ++i)
        differ += work->answers.logit[i] != expected[i].logit ||
                  (work->answers.certain[i] != 0) != expected[i].certain;
    }
    for (const kernels::KernelPointer& kernel : proofs) {
      kernel->prove(work->batch, work->answers, work->open, work->scratch);
      for (uint32_t i = 0; i < kernels::kBatchRays; ++i)
        differ += work->answers.logit[i] != provable[i].logit ||
                  (work->answers.certain[i] != 0) != provable[i].certain ||
                  (!provable[i].certain &&
                   (work->open.begin[i] != parts[i].begin || work->open.end[i] != parts[i].end));
    }
    tally.rays += kernels::kBatchRays;
    tally.proven += proven;
    tally.differ += differ;
  });
}

class ExactOnShapes : public testing::TestWithParam<std::tuple<int, uint32_t>> {};

TEST_P(ExactOnShapes, AnswersAsItsBvh) {
  const auto [number, levels] = GetParam();
  const auto shape = Shape(number);
  const ExactObject o(make_shape(shape, levels), resolution_of(shape, levels), {.levels = levels});
  Tally tally;
  compare(o, 100'000, true, tally);
  EXPECT_EQ(tally.differ, 0u);
  EXPECT_GT(tally.proven, tally.rays / 20);
  EXPECT_LT(tally.proven, tally.rays);
}

INSTANTIATE_TEST_SUITE_P(Generated, ExactOnShapes,
                         testing::Combine(testing::Range(0, int(kShapes)), testing::Values(2u)));
INSTANTIATE_TEST_SUITE_P(CutOtherwise, ExactOnShapes,
                         testing::Combine(testing::Range(0, int(kShapes)), testing::Values(0u, 4u)));

/// The segments are hard enough to detect wrong planes.
TEST(ExactOnFlaws, AreNoticed) {
  const auto narrow = [](format::PlanesData& data) {
    narrow_planes(data);
    bake::set_sides("bowl", data);  // otherwise the writer refuses them
  };
  const ExactObject o(make_shape(kBowl, 2), resolution_of(kBowl, 2), {.levels = 2, .flaw = narrow});
  Tally tally;
  compare(o, 100'000, true, tally);
  EXPECT_GT(tally.differ, 0u);
}

/// With NIF_TEST_SEGMENTS=6000000, 10^8 in all, in about five minutes.
TEST(ExactOnRealMeshes, AnswersAsItsBvh) {
  if (!real_mesh_folder()) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const uint64_t segments = segments_wanted(100'000);
  uint64_t asked = 0;
  for (const std::filesystem::path& file : real_meshes(4'000'000)) {
    SCOPED_TRACE(file.filename().string());
    mesh::Scene scene = mesh::read(file);
    // The largest object of a file stands for the others.
    const auto largest = std::max_element(
        scene.meshes.begin(), scene.meshes.end(),
        [](const auto& a, const auto& b) { return a.triangles.size() < b.triangles.size(); });
    const ExactObject o(std::move(*largest), 80, {.levels = 1});  // as the baker's `balanced`
    Tally tally;
    compare(o, segments, false, tally);
    EXPECT_EQ(tally.differ, 0u);
    asked += tally.rays;
  }
  RecordProperty("segments", std::to_string(asked));
}

}  // namespace
}  // namespace nif::test
