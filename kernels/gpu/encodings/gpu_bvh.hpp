// Adds the exact `bvh` objects to the list of encodings (kernels/gpu/encoding_list.hpp).
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/triangles/triangles_kernels.hpp"

namespace nif::kernels::gpu {

class FieldUpload;

struct BvhEncoding {
  using Field = TrianglesField;
  enum Kind : uint32_t {
    kExact = 1,
    kSingle = 2  ///< of no object: selects a kernel with single-precision triangle tests, for measurements
  };
  static constexpr uint32_t kKinds = 2;
  static constexpr bool kHasItems = false, kProves = false;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread&, const SceneObject& object, uint32_t,
                                                     const Segment& ray, uint32_t* row) {
    const auto& field = *static_cast<const Field*>(object.field);
    if constexpr (kSet == kSingle) return answer_bvh_ray<1, float>(field, ray, row);
    return answer_bvh_ray<1>(field, ray, row);
  }
  NIF_HOST_DEVICE NIF_INLINE static bool traverse(const SceneObject& object, const Segment& ray,
                                                  uint32_t* column, OpenItem&, ObjectAnswer& answer) {
    answer = answer_bvh_ray<kBlockThreads>(*static_cast<const Field*>(object.field), ray, column);
    return true;
  }
  template <class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread&, const SceneObject& object, uint32_t,
                                                  const Segment& ray, float limit, uint32_t* row) {
    return find_bvh_hit<1>(*static_cast<const Field*>(object.field), ray, limit, row);
  }

  template <class Hash>
  static constexpr void describe(Hash& hash) {
    using F = TrianglesField;
    using Node = BvhNode;
    hash.template structure<Node>({&Node::frame, &Node::first_node, &Node::first_triangle,
                                   &Node::first_vertex, &Node::slots, &Node::low, &Node::high});
    hash.template structure<F>({&F::nodes, &F::vertices, &F::triangles, &F::node_count, &F::vertex_count,
                                &F::triangle_count, &F::extent});
  }
  static FieldUpload* upload(const TrianglesField& field);
};
template <>
struct GpuEncodingOf<TrianglesField> {
  using Encoding = BvhEncoding;
};

}  // namespace nif::kernels::gpu
