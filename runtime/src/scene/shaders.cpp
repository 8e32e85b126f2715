// Makes tables for shaders from an asset's objects, or says why a shader cannot have them.
#include "scene/shaders.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "api/error.hpp"
#include "kernels/shader/shader_tables.hpp"
#include "kernels/shader/top_level.hpp"
#include "kernels/shader/triangle_tree.hpp"

namespace nif::runtime {
namespace {

using kernels::shader::About;
using kernels::shader::kIdentityBit;

[[noreturn]] void refuse_object(const NifAssetObject& asset, uint32_t object, NifError code,
                                const std::string& why) {
  throw Failure(code, std::string(asset.name) + ": object " + std::to_string(object) + " ('" +
                          std::string(asset.view.objects[object].name) + "') " + why);
}

/// Throws Failure if no shader can answer an object, or its file is gone.
const format::ObjectView& readable(const NifAssetObject& asset, uint32_t object) {
  const format::ObjectView& view = answerable(asset, object);
  const bool has_triangles = view.is<kernels::TrianglesField>() || view.is<kernels::ExactField>();
  if (!view.is<kernels::SegmentField>() && !has_triangles && !view.is<kernels::PlanesField>())
    refuse_object(asset, object, NIF_ERROR_NOT_AVAILABLE,
                  "has the encoding '" + std::string(format::encoding_of(view).name) +
                      "'; shaders answer 'segment', 'proof', 'bvh' and 'exact' only");
  if (asset.view.bytes.empty())
    refuse_object(asset, object, NIF_ERROR_INVALID_OPERATION,
                  "is no longer in memory as shaders need it: make the device with shaders=on");
  if (!has_triangles) return view;
  const kernels::TrianglesField& field = view.triangles->field;
  if (uint64_t{field.vertex_count} * 3 +
          uint64_t{field.triangle_count} * kernels::shader::kMostWordsOfATriangle >=
      kIdentityBit)
    refuse_object(asset, object, NIF_ERROR_NOT_AVAILABLE, "has tables for shaders of 2^29 words or more");
  return view;
}

kernels::SourceTriangles source_of(const NifAssetObject& asset, uint32_t object) {
  const format::NumbersView* const numbers = asset.view.numbers_of(object, format::kSourceTriangles);
  return numbers ? numbers->field : kernels::SourceTriangles();
}

std::pmr::vector<uint32_t> tables_of(const NifAssetObject& asset, uint32_t object) {
  using kernels::shader::make_tables;
  const format::ObjectView& view = readable(asset, object);
  std::pmr::memory_resource* const memory = asset.device->memory();
  About about{view.proven, {}, view.bias};
  std::copy_n(view.aabb_min.begin(), 3, about.bounds);
  std::copy_n(view.aabb_max.begin(), 3, about.bounds + 3);
  if (view.is<kernels::TrianglesField>())
    return make_tables(view.as<kernels::TrianglesField>(), source_of(asset, object), about, memory);
  if (view.is<kernels::ExactField>())
    return make_tables(view.as<kernels::ExactField>(), format::hit_details(asset.view, object), about,
                       memory);
  if (view.is<kernels::PlanesField>()) return make_tables(view.as<kernels::PlanesField>(), about, memory);
  const auto field = view.as<kernels::SegmentField>();
  if (const char* why = kernels::shader::unfit(field, memory))
    refuse_object(asset, object, NIF_ERROR_NOT_AVAILABLE, why);
  return make_tables(field, about, memory);
}

/// How many words tables_of() makes; throws what that does. A `segment` is made the first time, because features decide.
uint64_t count_of(const NifAssetObject& asset, uint32_t object) {
  using kernels::shader::count_words;
  const format::ObjectView& view = readable(asset, object);
  std::atomic<uint64_t>& count = asset.shader_words[object];
  if (count == 0) {
    if (view.is<kernels::TrianglesField>())
      count = count_words(view.as<kernels::TrianglesField>(), source_of(asset, object));
    else if (view.is<kernels::ExactField>())
      count = count_words(view.as<kernels::ExactField>(), format::hit_details(asset.view, object));
    else if (view.is<kernels::PlanesField>())
      count = count_words(view.as<kernels::PlanesField>());
    else
      count = tables_of(asset, object).size();
  }
  return count;
}

[[noreturn]] void refuse_room(uint64_t capacity, uint64_t count) {
  refuse_argument("words: there is room for " + std::to_string(capacity) + " words, but the tables have " +
                  std::to_string(count));
}

/// Makes an object's tables, `count` words, where the caller wants them.
void make_at(const NifAssetObject& asset, uint32_t object, uint64_t count, uint32_t* to) {
  const auto words = tables_of(asset, object);
  if (words.size() != count)
    throw std::logic_error("an object has other tables for shaders than were counted");
  std::copy(words.begin(), words.end(), to);
}

/// The asset that has an object of the scene.
const NifAssetObject& asset_of(const NifSceneObject& scene, uint32_t object) {
  for (const HeldAsset& held : scene.assets)
    if (object >= held.first_object && object - held.first_object < held.asset->view.objects.size())
      return *held.asset.get();
  throw std::logic_error("an object of the scene has no asset");
}

void put_floats(uint32_t* to, const float* from, size_t count) {
  for (size_t i = 0; i < count; ++i) to[i] = kernels::bits_as<uint32_t>(from[i]);
}

}  // namespace

uint64_t write_shader_tables(const NifAssetObject& asset, uint32_t object, uint32_t* to, uint64_t capacity) {
  const uint64_t count = count_of(asset, object);
  if (to == nullptr) return count;
  if (capacity < count) refuse_room(capacity, count);
  make_at(asset, object, count, to);
  return count;
}

uint64_t write_scene_shader_tables(const NifSceneObject& scene, uint32_t* to, uint64_t capacity) {
  using namespace kernels::shader;
  if (!scene.committed)
    throw Failure(NIF_ERROR_INVALID_OPERATION, "the scene has changes that are not committed");
  std::pmr::memory_resource* const memory = scene.device->memory();
  std::pmr::vector<uint32_t> awake(memory);  // in the order of their numbers
  std::pmr::vector<kernels::WorldBox> boxes(memory);
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (!scene.settings[i].awake()) continue;
    if (scene.settings[i].bent != kNotBent)
      throw Failure(NIF_ERROR_NOT_AVAILABLE,
                    "instance " + std::to_string(i) + " bends; tables for shaders have objects at rest only");
    const uint32_t place = scene.instances[i].place;
    awake.push_back(i);
    boxes.push_back(place == kNoBox ? empty_box() : scene.hierarchy.box(place));
  }
  const uint64_t top_level = kSceneWords + kInstanceWords * awake.size();
  const uint64_t moving = top_level + count_top_level_words(awake.size());
  // Objects lie in the order of the instances' numbers, which stays when they move.
  std::pmr::vector<uint32_t> first_word(scene.objects.size(), 0u, memory), placed(memory);
  uint64_t count = moving;
  for (const uint32_t number : awake) {
    const uint32_t object = asset_object(scene, number);
    if (first_word[object] != 0) continue;
    placed.push_back(object);
    first_word[object] = uint32_t(count);
    count += count_of(asset_of(scene, object), scene.objects[object].number);
    if (count >= kIdentityBit)
      throw Failure(NIF_ERROR_NOT_AVAILABLE, "the scene's tables for shaders would have 2^29 words or more");
  }
  if (to == nullptr) return count;
  if (capacity < count && capacity != moving) refuse_room(capacity, count);

  const TopLevel tree = make_top_level(boxes, uint32_t(top_level), memory);
  std::pmr::vector<uint32_t> words(size_t(top_level), 0u, memory);
  words.insert(words.end(), tree.words.begin(), tree.words.end());
  if (words.size() != moving)
    throw std::logic_error("a top level for shaders has other words than were counted");
  words[kSceneMagicWord] = kSceneMagic;
  words[kSceneVersionWord] = kVersion;
  words[kSceneFlags] = scene.unproven ? 0u : uint32_t(kProves);
  words[kInstanceCount] = uint32_t(awake.size());
  words[kTopLevel] = uint32_t(top_level);
  words[kObjects] = uint32_t(moving);
  words[kSceneWordCount] = uint32_t(count);
  put_floats(&words[kSceneBounds], scene.bounds.min, 3);
  put_floats(&words[kSceneBounds + 3], scene.bounds.max, 3);
  for (size_t k = 0; k < awake.size(); ++k) {
    const uint32_t number = awake[tree.order[k]];
    const Instance& instance = scene.instances[number];
    const kernels::WorldBox& box = boxes[tree.order[k]];
    uint32_t* const to_instance = &words[kSceneWords + kInstanceWords * k];
    put_floats(to_instance + kInverse, instance.to_object.inverse, 9);
    put_floats(to_instance + kTranslation, instance.to_object.translation, 3);
    put_floats(to_instance + kRemainder, instance.to_object.remainder, 3);
    put_floats(to_instance + kWorldBox, box.min, 3);
    put_floats(to_instance + kWorldBox + 3, box.max, 3);
    to_instance[kObjectWord] = first_word[asset_object(scene, number)] |
                               (instance.identity ? uint32_t(kIdentityBit) : 0u) |
                               (instance.well_conditioned ? uint32_t(kWellConditionedBit) : 0u) |
                               (instance.unproven ? uint32_t(kUnprovenBit) : 0u);
    to_instance[kMask] = instance.mask;
    to_instance[kNumber] = number;
  }
  std::copy(words.begin(), words.end(), to);
  if (capacity < count) return count;
  for (size_t k = 0; k < placed.size(); ++k) {
    const uint64_t end = k + 1 < placed.size() ? first_word[placed[k + 1]] : count;
    make_at(asset_of(scene, placed[k]), scene.objects[placed[k]].number, end - first_word[placed[k]],
            to + first_word[placed[k]]);
  }
  return count;
}

}  // namespace nif::runtime
