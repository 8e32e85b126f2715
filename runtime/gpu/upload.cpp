// Copies assets and scenes to the GPU: lays each out in one arena, with pointers that are valid on the GPU.
#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "device.hpp"
#include "kernels/gpu/upload.hpp"
#include "kernels/reference/reference_encodings.hpp"
#include "kernels/reference/scene_hit.hpp"

namespace nif::gpu {
namespace {

using kernels::gpu::Arena;
using kernels::gpu::FieldUpload;
using kernels::gpu::Stage;

std::unique_ptr<FieldUpload> make_upload(const kernels::AnyField& field) {
  return std::visit(
      [](const auto& own) {
        using Field = std::remove_cvref_t<decltype(own)>;
        using Encoding = typename kernels::gpu::GpuEncodingOf<Field>::Encoding;
        return std::unique_ptr<FieldUpload>(Encoding::upload(own));
      },
      field);
}

/// An asset's object: its data before the copy, and its description on the GPU.
struct PlannedObject {
  std::unique_ptr<FieldUpload> upload;
  kernels::HitDetails details;
  DeviceObject plan;
};

/// Adds the details of hits. Colours are looked up in a grid of their own, without the data for traversals.
kernels::HitDetails add_details(kernels::HitDetails details, Arena& arena) {
  kernels::SourceTriangles& source = details.source_triangles;
  if (source.words) arena.move(source.words, kernels::source_words(source.count, source.bits));
  kernels::VoxelColors& colors = details.colors;
  if (colors.values) {
    kernels::PlanesField grid = *colors.grid;
    arena.move(colors.values, grid.surface_voxels);
    arena.move(grid.brick_table, size_t(grid.bricks[0]) * grid.bricks[1] * grid.bricks[2]);
    arena.move(grid.brick_states, grid.mixed_bricks);
    arena.move(grid.voxel_base, grid.mixed_bricks);
    grid.voxel_records = nullptr;
    grid.children = nullptr;
    colors.grid = arena.add_structure(grid);
  }
  return details;
}

Arena lay_out(std::vector<PlannedObject>& objects, const unsigned char* base) {
  Arena arena(base);
  for (PlannedObject& object : objects) {
    if (!object.upload) continue;
    object.plan.object.field = object.plan.list.field = object.upload->add_to(arena);
    object.plan.object.details = add_details(object.details, arena);
  }
  return arena;
}

void copy_and_wait(GpuDevice& device, const Memory& to, const Arena& arena) {
  device.context->copy_in(to.data(), arena.bytes().data(), arena.bytes().size(), device.uploads);
  device.context->wait_stream(device.uploads);
}

/// Makes the lists of items, stage by stage, for the objects that instances use, and stores each object's
/// list numbers in `placed`.
std::vector<kernels::gpu::PipelineList> make_lists(std::span<const DeviceObject* const> objects,
                                                   std::span<kernels::gpu::SceneObject> placed,
                                                   const std::vector<bool>& used, PipelineLists& about) {
  using namespace kernels::gpu;
  std::vector<PipelineList> lists;
  about = {};
  for (uint32_t stage = 0; stage < kStages; ++stage) {
    about.first[stage] = uint32_t(lists.size());
    for (size_t i = 0; i < objects.size(); ++i)
      for (uint32_t k = 0; k < 2; ++k) {
        const DeviceObject& object = *objects[i];
        if (object.stages[k] != stage || !used[i]) continue;
        placed[i].lists[k] = uint32_t(lists.size());
        lists.push_back(object.list);
        if (stage != kAlone)
          about.shared_bytes[stage] = std::max(about.shared_bytes[stage], object.stage_bytes);
      }
  }
  about.first[kStages] = uint32_t(lists.size());
  about.traversal_words = kItemWords;
  for (const DeviceObject* object : objects)
    about.traversal_words = std::max(about.traversal_words, object->traversal_words);
  return lists;
}

void lay_out(Arena& arena, const GpuSceneView& view, GpuScene& scene) {
  std::vector<const DeviceObject*> objects;
  std::vector<kernels::gpu::SceneObject> placed;
  uint32_t words = 1;
  scene.kinds = 0;
  for (uint64_t i = 0; i < view.object_count; ++i) {
    static const DeviceObject kNothing{};
    const GpuAsset* const asset = view.objects[i].asset;
    const DeviceObject& object = asset ? asset->objects[view.objects[i].object] : kNothing;
    objects.push_back(&object);
    placed.push_back(object.object);
    placed.back().number = view.objects[i].number;
    words = std::max(words, object.row_words);
    scene.kinds |= object.object.kind;
  }
  std::vector<bool> used(objects.size());
  for (uint64_t i = 0; i < view.instance_count; ++i)
    if (view.instances[i].object < used.size()) used[view.instances[i].object] = true;  // otherwise removed
  const std::vector<kernels::gpu::PipelineList> lists = make_lists(objects, placed, used, scene.lists);
  const bool alone = view.sole != kernels::kNoInstance;
  const auto several = uint32_t(view.node_count > 0 ? std::max(view.instance_count, uint64_t{2}) : 0);
  scene.arrays = {
      view.nodes,          view.instances,        view.users,    placed.data(),
      alone ? 1 : several, alone ? view.sole : 0, view.unproven, kernels::gpu::make_scene_layout(words)};
  scene.lists.shared_bytes[kernels::gpu::kAlone] = scene.arrays.layout.bytes;
  scene.lists.lists = lists.data();
  arena.move(scene.arrays.nodes, view.node_count);
  arena.move(scene.arrays.instances, view.instance_count);
  if (view.users) arena.move(scene.arrays.users, view.instance_count);
  arena.move(scene.arrays.objects, placed.size());
  arena.move(scene.lists.lists, lists.size());
}

/// What a query's speed depends on, except positions: the numbers of instances and lists, and the kinds.
std::array<uint32_t, 3> shape_of(const GpuScene& scene) {
  return {scene.arrays.instance_count, scene.lists.count(), scene.kinds};
}

}  // namespace

std::unique_ptr<GpuAsset> copy_asset(GpuDevice& device, const kernels::AnyField* fields,
                                     const kernels::HitDetails* details, uint32_t count) {
  std::vector<PlannedObject> objects;
  for (uint32_t i = 0; i < count; ++i) {
    const auto* triangles = std::get_if<kernels::TrianglesField>(&fields[i]);
    if (triangles && triangles->nodes == nullptr) {  // not supported: no instance names it
      objects.emplace_back();
      continue;
    }
    std::unique_ptr<FieldUpload> upload = make_upload(fields[i]);
    DeviceObject plan = upload->plan(device.settings.half != 0);
    plan.object.calibration = kernels::calibration(fields[i]);
    plan.object.reach_scale = kernels::reach_scale(fields[i]);
    objects.push_back({std::move(upload), details ? details[i] : kernels::HitDetails(), plan});
  }
  auto asset = std::make_unique<GpuAsset>();
  asset->memory = Memory(*device.context, lay_out(objects, nullptr).bytes().size());
  copy_and_wait(device, asset->memory, lay_out(objects, asset->memory.data()));
  for (const PlannedObject& object : objects) asset->objects.push_back(object.plan);
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
  Arena measured(nullptr);
  lay_out(measured, view, scene);
  const size_t bytes = measured.bytes().size();
  if (bytes > scene.memory.bytes()) {
    scene.memory = Memory();
    scene.memory = Memory(*device.context, bytes);
  }
  Arena arena(scene.memory.data());
  lay_out(arena, view, scene);
  if (bytes > 0) copy_and_wait(device, scene.memory, arena);
  // Measurements stay valid if instances only move.
  if (shape_of(scene) != before) scene.choice.clear();
  scene.ready = true;
}

}  // namespace nif::gpu
