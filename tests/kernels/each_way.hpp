// Asks SIMD kernels of objects with triangles, in each way that there is: for each instruction set, with decoded and with
// packed triangles; and compares with the reference, bit for bit.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "formats/nif/asset.hpp"
#include "kernels/cpu/cpu_encodings.hpp"
#include "kernels/reference/batch.hpp"
#include "tests/support/test_random.hpp"

namespace nif::test {

struct Way {
  kernels::cpu::Isa isa;
  bool decoded;
};

inline auto each_way() {
  using kernels::cpu::Isa;
  return testing::Values(Way{Isa::sse4, true}, Way{Isa::avx2, true}, Way{Isa::avx512, true},
                         Way{Isa::neon, true}, Way{Isa::sse4, false}, Way{Isa::avx2, false},
                         Way{Isa::avx512, false}, Way{Isa::neon, false});
}

inline std::string name_of(const testing::TestParamInfo<Way>& info) {
  constexpr const char* kNames[] = {"sse4", "avx2", "avx512", "neon"};
  return std::string(kNames[size_t(info.param.isa)]) + (info.param.decoded ? "_decoded" : "_packed");
}

/// Triangles as a file has them: vertices right after the nodes, then the triangles.
class TreePayload {
 public:
  explicit TreePayload(const format::TrianglesData& bvh) {
    const kernels::TrianglesField data = format::field_of(bvh);
    const size_t nodes = data.node_count * sizeof(kernels::BvhNode);
    const size_t vertices = data.vertex_count * sizeof(data.vertices[0]);
    const size_t triangles = data.triangle_count * sizeof(data.triangles[0]);
    words_.resize((nodes + vertices + triangles + 3) / 4);
    auto* const bytes = reinterpret_cast<std::byte*>(words_.data());
    std::memcpy(bytes, data.nodes, nodes);
    std::memcpy(bytes + nodes, data.vertices, vertices);
    std::memcpy(bytes + nodes + vertices, data.triangles, triangles);
    field_ = data;
    field_.nodes = reinterpret_cast<const kernels::BvhNode*>(bytes);
    field_.vertices = reinterpret_cast<const float(*)[3]>(bytes + nodes);
    field_.triangles = reinterpret_cast<const uint8_t(*)[3]>(bytes + nodes + vertices);
  }
  TreePayload(const TreePayload&) = delete;
  TreePayload& operator=(const TreePayload&) = delete;
  const kernels::TrianglesField& field() const { return field_; }

 private:
  std::vector<uint32_t> words_;
  kernels::TrianglesField field_;
};

inline bool same_bits(const kernels::Hit& a, const kernels::Hit& b) {
  return std::memcmp(&a, &b, sizeof(a)) == 0;
}

/// How many rays were asked, and how many met something.
struct Asked {
  uint64_t rays = 0, met = 0;
};

/// Asks an object's kernel and the reference the same rays. draw() makes one; `also(segment, answer, hit)` may look at
/// what the reference says.
template <class Field, class Draw, class Also>
void expect_reference_bits(const Field& field, const Way& way, Random& random, Asked& asked, Draw&& draw,
                           const Also& also) {
  struct Work {
    kernels::SegmentBatch batch;
    kernels::AnswerBatch answers;
    kernels::HitBatch hits;
    float limit[kernels::kBatchRays];
    alignas(64) std::byte scratch[kernels::kKernelScratchBytes];
  };
  const auto work = std::make_unique<Work>();
  kernels::cpu::SharedCopies copies;
  kernels::cpu::KernelOptions options{way.isa, std::pmr::new_delete_resource(), copies};
  if (!way.decoded) options.most_decoded = 0;
  const auto kernel = kernels::cpu::make_kernel(field, options);
  EXPECT_EQ(kernel->built_bytes().decoded_triangles > 0, way.decoded);
  for (const uint32_t count : {1u, 7u, 100u, kernels::kBatchRays}) {
    work->batch.count = count;
    for (uint32_t i = 0; i < count; ++i) {
      set_segment(work->batch, i, draw());
      work->limit[i] = kernels::kNoHit;
    }
    kernel->answer(work->batch, work->answers, work->scratch);
    kernel->intersect(work->batch, work->limit, work->hits, work->scratch);
    for (uint32_t i = 0; i < count; ++i) {
      const kernels::Segment segment = segment_of(work->batch, i);
      const kernels::Answer answer = query(field, segment);
      ASSERT_EQ(work->answers.logit[i], answer.logit);
      ASSERT_EQ(work->answers.certain[i] != 0, answer.certain);
      const kernels::Hit hit = intersect(field, segment);
      ASSERT_TRUE(same_bits(hit_of(work->hits, i), hit)) << hit.t << ' ' << work->hits.t[i];
      ASSERT_NO_FATAL_FAILURE(also(segment, answer, hit));
      asked.met += hit.t < kernels::kNoHit;
      ++asked.rays;
      // Of a hit beyond the limit only that it is beyond counts.
      if (random.below(2) == 0) work->limit[i] = hit.t < kernels::kNoHit ? hit.t * random.unit() * 2 : 1;
    }
    kernel->intersect(work->batch, work->limit, work->hits, work->scratch);
    for (uint32_t i = 0; i < count; ++i) {
      const kernels::Hit hit = intersect(field, segment_of(work->batch, i)), limited = hit_of(work->hits, i);
      if (hit.t <= work->limit[i])
        ASSERT_TRUE(same_bits(limited, hit));
      else
        ASSERT_GT(limited.t, work->limit[i]);
    }
  }
}

}  // namespace nif::test
