// Builds the tree on one thread, so that it does not vary. Embree's boxes are not used: ours are exact.
#include "bake/triangles/binary_tree.hpp"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <new>
#include <string>

#include "bake/ground_truth/embree_scene.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCBVH bvh) const { rtcReleaseBVH(bvh); }
};

/// A node in Embree's memory. Without children it is a leaf.
struct Built {
  const Built* children[2] = {};
  uint32_t triangle = 0;
};

Built* make(RTCThreadLocalAllocator allocator) {
  return new (rtcThreadLocalAlloc(allocator, sizeof(Built), alignof(Built))) Built;
}

/// Copies the tree, each node before its children, with boxes of triangles only.
BinaryTree copy_of(const Built& root, std::span<const mesh::Float3> positions,
                   std::span<const mesh::Triangle> triangles) {
  BinaryTree tree;
  tree.nodes.reserve(2 * triangles.size() - 1);
  tree.nodes.emplace_back();
  std::vector<const Built*> built = {&root};
  built.reserve(tree.nodes.capacity());
  for (uint32_t at = 0; at < built.size(); ++at) {
    if (built[at]->children[0] == nullptr) {
      tree.nodes[at].triangle = built[at]->triangle;
      tree.nodes[at].box = mesh::bounds(positions, triangles.subspan(built[at]->triangle, 1));
      continue;
    }
    for (uint32_t side = 0; side < 2; ++side) {
      tree.nodes[at].children[side] = uint32_t(tree.nodes.size());
      tree.nodes.emplace_back().parent = at;
      built.push_back(built[at]->children[side]);
    }
  }
  return tree;
}

/// Gives inner nodes their boxes, and makes leaves of those with few triangles that rays meet less often than the leaves below.
void make_leaves(BinaryTree& tree) {
  struct Below {
    uint32_t triangles = 1;
    double surface = 0;  ///< of the leaves
  };
  std::vector<Below> below(tree.nodes.size());
  for (size_t at = tree.nodes.size(); at-- > 0;) {
    BinaryTree::Node& node = tree.nodes[at];
    if (node.has_children()) {
      const Below &a = below[node.children[0]], &b = below[node.children[1]];
      tree.refit(uint32_t(at));
      below[at] = {a.triangles + b.triangles, a.surface + b.surface};
      if (below[at].triangles > kernels::kBvhLeafTriangles || half_surface(node.box) > below[at].surface)
        continue;
      node.height = 0;
    }
    below[at].surface = half_surface(node.box);
  }
  for (BinaryTree::Node& node : tree.nodes)
    if (node.parent != BinaryTree::kNone && tree.nodes[node.parent].height == 0) node.height = 0;
}

}  // namespace

double half_surface(const mesh::Box& box) {
  const double x = double{box.max[0]} - double{box.min[0]}, y = double{box.max[1]} - double{box.min[1]},
               z = double{box.max[2]} - double{box.min[2]};
  return x * y + y * z + z * x;
}

void BinaryTree::refit(uint32_t node) {
  const Node &a = nodes[nodes[node].children[0]], &b = nodes[nodes[node].children[1]];
  mesh::Box box = a.box;
  box.add(b.box);
  nodes[node].box = box;
  nodes[node].height = std::max(a.height, b.height) + 1;
}

BinaryTree build_binary_tree(std::span<const mesh::Float3> positions,
                             std::span<const mesh::Triangle> triangles) {
  const std::unique_ptr<RTCDeviceTy, Release> device(rtcNewDevice(nullptr));
  if (!device) throw_no_device();
  std::vector<RTCBuildPrimitive> primitives(triangles.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    const mesh::Box box = mesh::bounds(positions, triangles.subspan(i, 1));
    primitives[i] = {box.min[0], box.min[1], box.min[2], 0, box.max[0], box.max[1], box.max[2], uint32_t(i)};
  }
  const std::unique_ptr<RTCBVHTy, Release> bvh(rtcNewBVH(device.get()));
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.maxBranchingFactor = 2;
  arguments.maxDepth = kMostHeight;
  arguments.minLeafSize = 1;
  arguments.maxLeafSize = 1;
  arguments.sahBlockSize = 1;
  arguments.bvh = bvh.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = primitives.size();
  arguments.primitiveArrayCapacity = primitives.capacity();
  arguments.createNode = [](RTCThreadLocalAllocator allocator, unsigned, void*) -> void* {
    return make(allocator);
  };
  arguments.setNodeChildren = [](void* node, void** children, unsigned, void*) {
    for (uint32_t side = 0; side < 2; ++side)
      static_cast<Built*>(node)->children[side] = static_cast<Built*>(children[side]);
  };
  arguments.setNodeBounds = [](void*, const RTCBounds**, unsigned, void*) {};
  arguments.createLeaf = [](RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitive, size_t,
                            void*) -> void* {
    Built* const leaf = make(allocator);
    leaf->triangle = primitive->primID;
    return leaf;
  };
  const Built* root = nullptr;
  tbb::task_arena(1).execute([&] { root = static_cast<Built*>(rtcBuildBVH(&arguments)); });
  if (!root) {
    throw Error(Status::out_of_memory,
                "Embree cannot build a BVH over " + std::to_string(triangles.size()) + " triangles");
  }
  BinaryTree tree = copy_of(*root, positions, triangles);
  make_leaves(tree);
  return tree;
}

}  // namespace nif::bake
