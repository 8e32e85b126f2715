// Assets and scenes on their way to the card: what they consist of is laid out in one block of memory each,
// with pointers to where it will lie there.
#include <cstring>
#include <map>
#include <utility>

#include "device.hpp"

namespace nif::gpu {
namespace {

using kernels::SphericalGrid;
using kernels::SphericalNetwork;
using kernels::SphericalValues;

/// A block that will lie at `base`. It is built twice: first to learn how large it is, and once more with
/// pointers that hold.
class Block {
 public:
  explicit Block(const unsigned char* base) : base_(reinterpret_cast<uintptr_t>(base)) {}

  /// Adds an array and lets the pointer point to where it will be. What several objects share is added once.
  template <class T>
  void move(const T*& array, size_t count) {
    array = static_cast<const T*>(add(array, count * sizeof(T)));
  }
  const void* add(const void* from, size_t bytes) {
    const auto [known, is_new] = placed_.try_emplace({from, bytes}, bytes_.size());
    if (is_new && bytes > 0) append(from, bytes);
    return reinterpret_cast<const void*>(base_ + known->second);
  }
  /// Adds a structure; it may have the address of one that is no more.
  template <class T>
  const T* add_structure(const T& value) {
    const size_t at = bytes_.size();
    append(&value, sizeof(value));
    return reinterpret_cast<const T*>(base_ + at);
  }
  const std::vector<unsigned char>& bytes() const { return bytes_; }

 private:
  void append(const void* from, size_t bytes) {
    const size_t at = bytes_.size();
    bytes_.resize(at + (bytes + kAlignment - 1) / kAlignment * kAlignment);
    std::memcpy(bytes_.data() + at, from, bytes);
  }

  static constexpr size_t kAlignment = 64;
  uintptr_t base_;
  std::vector<unsigned char> bytes_;
  std::map<std::pair<const void*, size_t>, size_t> placed_;
};

void add_field(Block& block, kernels::SegmentField& field) {
  block.move(field.brick_table, size_t(field.bricks[0]) * field.bricks[1] * field.bricks[2]);
  block.move(field.brick_states, field.mixed_bricks);
  block.move(field.brick_corners, field.mixed_bricks);
  block.move(field.corner_base, field.mixed_bricks);
  block.move(field.features, size_t(field.corners) * field.features_per_corner);
  for (uint32_t l = 0; l < field.network.layer_count; ++l) {
    kernels::Network::Layer& layer = field.network.layers[l];
    block.move(layer.weights, size_t(layer.inputs) * layer.outputs);
    block.move(layer.biases, layer.outputs);
  }
}

void add_field(Block& block, kernels::BvhField& field) {
  block.move(field.nodes, field.node_count);
  block.move(field.vertices, field.vertex_count);
  block.move(field.triangles, field.triangle_count);
}

void add_values(Block& block, SphericalValues& values, size_t count) {
  values.data = block.add(values.data, count * (values.half ? sizeof(uint16_t) : sizeof(float)));
}

void add_field(Block& block, kernels::SphericalField& field) {
  for (SphericalGrid* grid :
       {&field.outer_position, &field.outer_direction, &field.inner_position, &field.inner_direction})
    add_values(block, grid->values, size_t(grid->resolution) * grid->resolution * grid->features);
  add_values(block, field.distance.values, size_t(field.distance.resolution) * field.distance.features);
  for (SphericalNetwork* network : {&field.outer, &field.inner})
    add_values(block, network->weights, kernels::spherical_weights(*network));
}

template <class Field>
void add_object(Block& block, const Field& field, const GpuObjectView& view, GpuAsset& asset) {
  kernels::hip::SceneObject object = kernels::hip::describe_object(field);
  object.logit_scale = view.logit_scale;
  object.reach_scale = view.reach_scale;
  Field moved = field;
  add_field(block, moved);
  object.field = block.add_structure(moved);
  asset.objects.push_back(object);
  asset.row_words.push_back(kernels::hip::row_words(field));
}

Block lay_out(const GpuObjectView* objects, uint32_t count, const unsigned char* base, GpuAsset& asset) {
  Block block(base);
  asset.objects.clear();
  asset.row_words.clear();
  for (uint32_t i = 0; i < count; ++i) {
    if (objects[i].bvh)
      add_object(block, *objects[i].bvh, objects[i], asset);
    else if (objects[i].spherical)
      add_object(block, *objects[i].spherical, objects[i], asset);
    else
      add_object(block, *objects[i].segment, objects[i], asset);
  }
  return block;
}

void copy_and_wait(GpuDevice& device, const Memory& to, const Block& block) {
  device.context->copy_in(to.data(), block.bytes().data(), block.bytes().size(), device.uploads);
  device.context->wait_stream(device.uploads);
}

kernels::hip::SceneArrays lay_out(Block& block, const GpuSceneView& view) {
  std::vector<kernels::hip::SceneObject> objects;
  uint32_t words = 1;
  for (uint64_t i = 0; i < view.object_count; ++i) {
    const runtime::GpuPlacedObject& placed = view.objects[i];
    objects.push_back(placed.asset->objects[placed.object]);
    words = std::max(words, placed.asset->row_words[placed.object]);
  }
  kernels::hip::SceneArrays arrays{view.nodes, view.instances, objects.data(), uint32_t(view.instance_count),
                                   kernels::hip::make_scene_layout(words)};
  block.move(arrays.nodes, view.node_count);
  block.move(arrays.instances, view.instance_count);
  block.move(arrays.objects, objects.size());
  return arrays;
}

}  // namespace

std::unique_ptr<GpuAsset> copy_asset(GpuDevice& device, const GpuObjectView* objects, uint32_t count) {
  auto asset = std::make_unique<GpuAsset>();
  asset->memory = Memory(*device.context, lay_out(objects, count, nullptr, *asset).bytes().size());
  copy_and_wait(device, asset->memory, lay_out(objects, count, asset->memory.data(), *asset));
  return asset;
}

void wait_for_queries(GpuDevice& device, GpuScene& scene) {
  const std::lock_guard lock(scene.mutex);
  while (!scene.events.empty()) {
    const Event event = scene.events.back();
    if (!device.lost) device.context->wait(event);
    device.context->free_event(event);
    scene.events.pop_back();
  }
}

void copy_scene(GpuDevice& device, const GpuSceneView& view, GpuScene& scene) {
  scene.ready = false;
  wait_for_queries(device, scene);
  Block measured(nullptr);
  lay_out(measured, view);
  const size_t bytes = measured.bytes().size();
  if (bytes > scene.memory.bytes()) {
    scene.memory = Memory();
    scene.memory = Memory(*device.context, bytes);
  }
  Block block(scene.memory.data());
  scene.arrays = lay_out(block, view);
  if (bytes > 0) copy_and_wait(device, scene.memory, block);
  scene.kinds = 0;
  for (uint64_t i = 0; i < view.object_count; ++i)
    scene.kinds |= view.objects[i].asset->objects[view.objects[i].object].kind;
  scene.ready = true;
}

}  // namespace nif::gpu
