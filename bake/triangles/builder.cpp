// Builds the tree with Embree's builder, on one thread, so that the bytes do not vary; the boxes that it
// computes are not used. Then order.cpp sorts the children of each node, and formats/nif packs the tree.
#include "bake/triangles/builder.hpp"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "bake/ground_truth/embree_scene.hpp"
#include "bake/triangles/order.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"
#include "formats/nif/triangles/pack.hpp"
#include "kernels/reference/triangles/refit.hpp"

namespace nif::bake {
namespace {

using Branch = format::BvhBranch;

/// Embree's builder and its memory.
class Topology {
 public:
  Topology(std::span<const mesh::Float3> positions, std::span<const mesh::Triangle> triangles)
      : device_(rtcNewDevice(nullptr)) {
    if (!device_) throw_no_device();
    std::vector<RTCBuildPrimitive> primitives(triangles.size());
    for (size_t i = 0; i < triangles.size(); ++i) {
      const mesh::Box box = mesh::bounds(positions, triangles.subspan(i, 1));
      primitives[i] = {box.min[0], box.min[1], box.min[2], 0,
                       box.max[0], box.max[1], box.max[2], uint32_t(i)};
    }
    bvh_ = rtcNewBVH(device_);
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.maxBranchingFactor = kernels::kBvhWidth;
    arguments.maxDepth = kernels::kMaxBvhDepth - 2;
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = kernels::kBvhLeafTriangles;
    // Treats four triangles as costing the same as one: with 1 here the bunny takes a third more bytes and
    // node visits, 24 bytes per triangle instead of 16.
    arguments.sahBlockSize = kernels::kBvhLeafTriangles;
    arguments.bvh = bvh_;
    arguments.primitives = primitives.data();
    arguments.primitiveCount = primitives.size();
    arguments.primitiveArrayCapacity = primitives.capacity();
    arguments.createNode = [](RTCThreadLocalAllocator allocator, unsigned, void*) -> void* {
      return new (rtcThreadLocalAlloc(allocator, sizeof(Branch), alignof(Branch))) Branch;
    };
    arguments.setNodeChildren = [](void* node, void** children, unsigned count, void*) {
      auto& branch = *static_cast<Branch*>(node);
      branch.child_count = count;
      for (unsigned i = 0; i < count; ++i) branch.children[i] = static_cast<Branch*>(children[i]);
    };
    arguments.setNodeBounds = [](void*, const RTCBounds**, unsigned, void*) {};
    arguments.createLeaf = [](RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitive,
                              size_t count, void*) -> void* {
      auto* leaf = new (rtcThreadLocalAlloc(allocator, sizeof(Branch), alignof(Branch))) Branch;
      leaf->triangle_count = uint32_t(count);
      for (size_t i = 0; i < count; ++i) leaf->triangles[i] = primitive[i].primID;
      // Embree partitions in place, in an order that is not specified.
      std::sort(leaf->triangles, leaf->triangles + count);
      return leaf;
    };
    // On one thread, like the ground truth: the order of children may depend on threads.
    tbb::task_arena(1).execute([&] { root_ = static_cast<Branch*>(rtcBuildBVH(&arguments)); });
    if (!root_) {
      throw Error(Status::out_of_memory,
                  "Embree cannot build a BVH over " + std::to_string(triangles.size()) + " triangles");
    }
  }
  ~Topology() {
    if (bvh_) rtcReleaseBVH(bvh_);
    if (device_) rtcReleaseDevice(device_);
  }
  Topology(const Topology&) = delete;
  Topology& operator=(const Topology&) = delete;

  format::BvhBranch& root() { return *root_; }

 private:
  RTCDevice device_ = nullptr;
  RTCBVH bvh_ = nullptr;
  Branch* root_ = nullptr;
};

}  // namespace

bool fits_bvh(std::span<const mesh::Float3> positions) {
  return std::all_of(positions.begin(), positions.end(), [](const mesh::Float3& p) {
    return std::all_of(p.begin(), p.end(),
                       [](float x) { return std::abs(x) <= kernels::kMaxVertexCoordinate; });
  });
}

format::TrianglesData build_bvh(std::span<const mesh::Float3> positions,
                                std::span<const mesh::Triangle> triangles, std::vector<uint32_t>* order,
                                std::vector<uint32_t>* sources) {
  Topology topology(positions, triangles);
  order_children(topology.root(), positions, triangles);
  return format::pack_bvh(topology.root(), positions, triangles, order, sources);
}

}  // namespace nif::bake
