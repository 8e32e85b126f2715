// Makes tables for shaders from an asset's objects, or says why a shader cannot have them.
#include "scene/shaders.hpp"

#include <algorithm>
#include <string>

#include "api/error.hpp"
#include "kernels/shader/shader_tables.hpp"

namespace nif::runtime {
namespace {

using kernels::shader::About;

[[noreturn]] void refuse_object(const NifAssetObject& asset, uint32_t object, NifError code,
                                const std::string& why) {
  throw Failure(code, std::string(asset.name) + ": object " + std::to_string(object) + " ('" +
                          std::string(asset.view.objects[object].name) + "') " + why);
}

std::pmr::vector<uint32_t> tables_of(const NifAssetObject& asset, uint32_t object) {
  const format::ObjectView& view = answerable(asset, object);
  const bool segment = view.is<kernels::SegmentField>();
  if (!segment && !view.is<kernels::PlanesField>())
    refuse_object(asset, object, NIF_ERROR_NOT_AVAILABLE,
                  "has the encoding '" + std::string(format::encoding_of(view).name) +
                      "'; shaders answer 'segment' and 'proof' only");
  if (asset.view.bytes.empty())
    refuse_object(asset, object, NIF_ERROR_INVALID_OPERATION,
                  "is no longer in memory as shaders need it: make the device with shaders=on");
  std::pmr::memory_resource* const memory = asset.device->memory();
  About about{view.proven, {}, view.bias};
  std::copy_n(view.aabb_min.begin(), 3, about.bounds);
  std::copy_n(view.aabb_max.begin(), 3, about.bounds + 3);
  if (!segment) return kernels::shader::make_tables(view.as<kernels::PlanesField>(), about, memory);
  const auto field = view.as<kernels::SegmentField>();
  if (const char* why = kernels::shader::unfit(field, memory))
    refuse_object(asset, object, NIF_ERROR_NOT_AVAILABLE, why);
  return kernels::shader::make_tables(field, about, memory);
}

}  // namespace

uint64_t write_shader_tables(const NifAssetObject& asset, uint32_t object, uint32_t* to, uint64_t capacity) {
  const std::pmr::vector<uint32_t> words = tables_of(asset, object);
  if (to == nullptr) return words.size();
  if (capacity < words.size())
    refuse_argument("words: there is room for " + std::to_string(capacity) + " words, but the tables have " +
                    std::to_string(words.size()));
  std::copy(words.begin(), words.end(), to);
  return words.size();
}

}  // namespace nif::runtime
