// Assets and scenes on their way to the card: what they consist of is laid out in one block of memory each,
// with pointers to where it will lie there.
#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "device.hpp"
#include "kernels/packed/feature_grid.hpp"
#include "kernels/packed/walk_grid.hpp"

namespace nif::gpu {
namespace {

using kernels::SphericalGrid;
using kernels::SphericalNetwork;
using kernels::SphericalValues;
using kernels::cpu::FeatureGrid;
using kernels::cpu::WalkGrid;

/// [object], of `segment` objects: by what their walk leaps.
/// What takes the place of an asset's own arrays on the card.
struct SegmentGrids {
  explicit SegmentGrids(const kernels::SegmentField& field)
      : walk(field, WalkGrid::most_tables(field), std::pmr::new_delete_resource()),
        corners(field, std::pmr::new_delete_resource()),
        next_pairs(corners.next_pairs()) {}

  kernels::gpu::DeviceSegmentField in_place_of(const kernels::SegmentField& field) const {
    return {field, walk.view(), corners.complete ? corners.view() : kernels::CornerBricks(),
            next_pairs.data()};
  }

  WalkGrid walk;
  FeatureGrid corners;
  std::vector<uint32_t> next_pairs;
};
using AssetGrids = std::vector<std::optional<SegmentGrids>>;  ///< [object]: none of other encodings'

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

void add_field(Block& block, kernels::gpu::DeviceSegmentField& field) {
  block.move(field.walk.words, kernels::gpu::walk_words(field));
  field.brick_states = nullptr;  // the codes of the walk say it all
  kernels::CornerBricks& corners = field.corner_bricks;
  if (corners.table) {
    size_t words = 1;
    for (const uint32_t voxels : field.voxels) words *= kernels::code_bricks(voxels);
    block.move(corners.table, (words + 15) / 16);
    block.move(corners.bricks, corners.brick_count);
    block.move(field.next_pairs, corners.pair_count);
    corners.pairs = nullptr;
    field.brick_table = nullptr;
    field.brick_corners = nullptr;
    field.corner_base = nullptr;
    field.features = nullptr;
  } else {
    field.next_pairs = nullptr;
    block.move(field.brick_table, size_t(field.bricks[0]) * field.bricks[1] * field.bricks[2]);
    block.move(field.brick_corners, field.mixed_bricks);
    block.move(field.corner_base, field.mixed_bricks);
    block.move(field.features, size_t(field.corners) * field.features_per_corner);
  }
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

/// Levels of a tree, the root's among them.
uint32_t bvh_levels(const kernels::BvhField& field) {
  // Nodes on the way down, and those beside them that are still to be seen; each with its level.
  std::vector<std::pair<uint32_t, uint32_t>> pending{{0, 1}};
  uint32_t deepest = 1;
  while (!pending.empty()) {
    const auto [number, level] = pending.back();
    pending.pop_back();
    if (level > deepest) deepest = level;
    const kernels::BvhNode& node = field.nodes[number];
    for (const uint8_t slot : node.slots)
      if (slot != 0 && kernels::slot_kind(slot) == kernels::kInnerSlot)
        pending.emplace_back(node.first_node + kernels::slot_rank(slot), level + 1);
  }
  return deepest;
}

// Words of a thread's row that the object needs, where a thread goes all the way with its ray.

uint32_t row_words(const kernels::SegmentField& field) {
  return 2 * kernels::gpu::kKeptRuns +
         (field.network.layers[0].inputs + 2 * kernels::gpu::make_layout(field).widest) / 4;
}
uint32_t row_words(const kernels::BvhField& field) {
  return kernels::gpu::bvh_stack_words(bvh_levels(field));
}
uint32_t row_words(const kernels::SphericalField& field) {
  return 2 * kernels::gpu::describe_object(field).widest;
}

// How the pipeline answers an object's items: what its lists are like, and the stages of both.

void choose_stages(const kernels::SegmentField& field, bool, CardObject& object) {
  using namespace kernels::gpu;
  object.list.segment = make_layout(field);
  const bool pairs = object.object.kind == kPairSegment;
  object.stages[0] = !object.list.segment.tiled ? kAlone : pairs ? kPairNetworks : kAnyNetworks;
  object.stages[1] = kAlone;
}
void choose_stages(const kernels::BvhField&, bool, CardObject& object) {
  object.stages[0] = object.stages[1] = kernels::gpu::kStages;
}
void choose_stages(const kernels::SphericalField& field, bool half, CardObject& object) {
  using namespace kernels::gpu;
  object.stages[0] = object.stages[1] = kAlone;
  if (!half) return;
  object.list.half = make_half_layout(field);
  if (!object.list.half.fits) return;
  const bool narrow = object.list.half.tiles == kHalfTiles;
  object.stages[0] = narrow ? kNarrowOuter : kWideOuter;
  object.stages[1] = narrow ? kNarrowInner : kWideInner;
}

template <class Field>
void add_object(Block& block, Field field, const GpuObjectView& view, bool half, GpuAsset& asset) {
  CardObject object{};
  object.object = kernels::gpu::describe_object(field);
  object.object.logit_scale = view.logit_scale;
  object.object.reach_scale = view.reach_scale;
  object.row_words = row_words(field);
  choose_stages(field, half, object);
  add_field(block, field);
  object.object.field = object.list.field = block.add_structure(field);
  asset.objects.push_back(object);
}

Block lay_out(const GpuObjectView* objects, uint32_t count, const AssetGrids& grids, bool half,
              const unsigned char* base, GpuAsset& asset) {
  Block block(base);
  asset.objects.clear();
  for (uint32_t i = 0; i < count; ++i) {
    if (objects[i].bvh)
      add_object(block, *objects[i].bvh, objects[i], half, asset);
    else if (objects[i].spherical)
      add_object(block, *objects[i].spherical, objects[i], half, asset);
    else
      add_object(block, grids[i]->in_place_of(*objects[i].segment), objects[i], half, asset);
  }
  return block;
}

void copy_and_wait(GpuDevice& device, const Memory& to, const Block& block) {
  device.context->copy_in(to.data(), block.bytes().data(), block.bytes().size(), device.uploads);
  device.context->wait_stream(device.uploads);
}

/// Lists of items by stages, for the objects that instances place. `placed` get to know theirs.
std::vector<kernels::gpu::PipelineList> make_lists(std::span<const CardObject* const> objects,
                                                   std::span<kernels::gpu::SceneObject> placed,
                                                   const std::vector<bool>& used,
                                                   kernels::gpu::PipelineLists& about) {
  using namespace kernels::gpu;
  std::vector<PipelineList> lists;
  about = {};
  for (uint32_t stage = 0; stage < kStages; ++stage) {
    about.first[stage] = uint32_t(lists.size());
    for (size_t i = 0; i < objects.size(); ++i)
      for (uint32_t k = 0; k < 2; ++k) {
        const CardObject& object = *objects[i];
        if (object.stages[k] != stage || !used[i]) continue;
        placed[i].lists[k] = uint32_t(lists.size());
        lists.push_back(object.list);
        if (stage != kAlone)
          about.shared_bytes[stage] =
              std::max({about.shared_bytes[stage], object.list.segment.bytes, object.list.half.bytes});
      }
  }
  about.first[kStages] = uint32_t(lists.size());
  about.walk_words = kItemWords;
  for (const CardObject* object : objects)
    if (object->object.kind == kBvhObject) about.walk_words = std::max(about.walk_words, object->row_words);
  return lists;
}

void lay_out(Block& block, const GpuSceneView& view, GpuScene& scene) {
  std::vector<const CardObject*> objects;
  std::vector<kernels::gpu::SceneObject> placed;
  uint32_t words = 1;
  scene.kinds = 0;
  for (uint64_t i = 0; i < view.object_count; ++i) {
    const CardObject& object = view.objects[i].asset->objects[view.objects[i].object];
    objects.push_back(&object);
    placed.push_back(object.object);
    words = std::max(words, object.row_words);
    scene.kinds |= object.object.kind;
  }
  std::vector<bool> used(objects.size());
  for (uint64_t i = 0; i < view.instance_count; ++i) used[view.instances[i].object] = true;
  const std::vector<kernels::gpu::PipelineList> lists = make_lists(objects, placed, used, scene.lists);
  scene.arrays = {view.nodes, view.instances, placed.data(), uint32_t(view.instance_count),
                  kernels::gpu::make_scene_layout(words)};
  scene.lists.shared_bytes[kernels::gpu::kAlone] = scene.arrays.layout.bytes;
  scene.lists.lists = lists.data();
  block.move(scene.arrays.nodes, view.node_count);
  block.move(scene.arrays.instances, view.instance_count);
  block.move(scene.arrays.objects, placed.size());
  block.move(scene.lists.lists, lists.size());
}

/// What a scene is to a query's speed, but for where things are: instances, lists and kinds.
std::array<uint32_t, 3> shape_of(const GpuScene& scene) {
  return {scene.arrays.instance_count, scene.lists.count(), scene.kinds};
}

}  // namespace

std::unique_ptr<GpuAsset> copy_asset(GpuDevice& device, const GpuObjectView* objects, uint32_t count) {
  AssetGrids grids(count);
  for (uint32_t i = 0; i < count; ++i)
    if (objects[i].segment) grids[i].emplace(*objects[i].segment);
  auto asset = std::make_unique<GpuAsset>();
  const bool half = device.settings.half != 0;
  asset->memory =
      Memory(*device.context, lay_out(objects, count, grids, half, nullptr, *asset).bytes().size());
  copy_and_wait(device, asset->memory, lay_out(objects, count, grids, half, asset->memory.data(), *asset));
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
  const auto before = shape_of(scene);
  Block measured(nullptr);
  lay_out(measured, view, scene);
  const size_t bytes = measured.bytes().size();
  if (bytes > scene.memory.bytes()) {
    scene.memory = Memory();
    scene.memory = Memory(*device.context, bytes);
  }
  Block block(scene.memory.data());
  lay_out(block, view, scene);
  if (bytes > 0) copy_and_wait(device, scene.memory, block);
  // Instances that only move leave what was measured as good as it was.
  if (shape_of(scene) != before) scene.choice.clear();
  scene.ready = true;
}

}  // namespace nif::gpu
