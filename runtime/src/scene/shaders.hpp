// Tables of objects and of scenes for shaders (kernels/shader).
#pragma once

#include "scene/scene.hpp"

namespace nif::runtime {

/// Writes the words of an object to `to` [capacity] unless that is null, and returns how many there are. Throws
/// Failure if there is no room for them, or if shaders cannot answer the object.
uint64_t write_shader_tables(const NifAssetObject& asset, uint32_t object, uint32_t* to, uint64_t capacity);

/// The same for a committed scene: its instances that rays can meet, and the objects that they place.
uint64_t write_scene_shader_tables(const NifSceneObject& scene, uint32_t* to, uint64_t capacity);

}  // namespace nif::runtime
