// Adds the exact `bvh` objects, and with them `cutout` ones, to the list of encodings (kernels/gpu/encoding_list.hpp).
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/triangles/triangles_kernels.hpp"
#include "kernels/reference/holes/holes_field.hpp"

namespace nif::kernels::gpu {

class FieldUpload;

/// In device memory.
struct DeviceBvhField : TrianglesField {
  const HolesField* holes = nullptr;  ///< null: no triangle has holes
};

/// As BlockingTriangles, if there are holes.
struct BlockingIfHoles {
  const HolesField* holes;

  NIF_HOST_DEVICE bool operator()(uint32_t triangle, const TriangleCrossing<double>& crossing) const {
    return holes == nullptr || BlockingTriangles{*holes}(triangle, crossing);
  }
};

/// Objects without holes and with them (`cutout`): a kernel for both has one traversal, which takes fewer registers than
/// two. Kernels for objects without holes know nothing of them.
struct BvhEncoding {
  using Field = DeviceBvhField;
  enum Kind : uint32_t {
    kExact = 1,
    kSingle = 2,  ///< of no object: selects a kernel with single-precision triangle tests, for measurements
    kHoles = 4
  };
  static constexpr uint32_t kKinds = 3;
  static constexpr bool kHasItems = false, kProves = false;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread&, const SceneObject& object, uint32_t,
                                                     const Segment& ray, uint32_t* row) {
    const auto& field = *static_cast<const Field*>(object.field);
    if constexpr (kSet == kSingle) return answer_bvh_ray<1, float>(field, ray, row);
    return answer_bvh_ray<1, double>(field, ray, row, blocking<kSet>(field));
  }
  template <uint32_t kSet>
  NIF_HOST_DEVICE NIF_INLINE static bool traverse(const SceneObject& object, const Segment& ray,
                                                  uint32_t* column, OpenItem&, ObjectAnswer& answer) {
    const auto& field = *static_cast<const Field*>(object.field);
    answer = answer_bvh_ray<kBlockThreads, double>(field, ray, column, blocking<kSet>(field));
    return true;
  }
  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread&, const SceneObject& object, uint32_t,
                                                  const Segment& ray, float limit, uint32_t* row) {
    const auto& field = *static_cast<const Field*>(object.field);
    return find_bvh_hit<1>(field, ray, limit, row, blocking<kSet>(field));
  }

  template <uint32_t kSet>
  NIF_HOST_DEVICE NIF_INLINE static auto blocking(const Field& field) {
    if constexpr ((kSet & kHoles) != 0)
      return BlockingIfHoles{field.holes};
    else
      return AllTriangles();
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
