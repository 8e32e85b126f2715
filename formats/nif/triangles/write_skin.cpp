// Writes how the vertices of an object bend. The reader is in skin_section.cpp; they are separate because the runtime
// only reads.
#include "formats/nif/asset.hpp"

namespace nif::format {

bool SkinRecords::has(const Object& object) { return object.skin.has_value(); }

std::vector<SkinRecord> SkinRecords::write(const Object& object, uint32_t number, Section& payloads) {
  const Skin& skin = *object.skin;
  SkinRecord record{};
  record.object = number;
  record.vertices = skin.vertex_count;
  record.joints = skin.joint_count;
  record.influences = skin.influences;
  record.targets = skin.target_count;
  record.values = payloads.add_payload(skin.weights, skin.targets, skin.joints);
  return {record};
}

Skin to_skin(const SkinView& view) {
  const kernels::SkinField& field = view.field;
  const size_t influences = size_t{field.vertex_count} * field.influences;
  Skin skin{field.vertex_count, field.joint_count, field.influences, field.target_count, {}, {}, {}};
  skin.weights.assign(field.weights, field.weights + influences);
  for (size_t i = 0; i < size_t{field.vertex_count} * field.target_count; ++i)
    skin.targets.push_back({field.targets[i][0], field.targets[i][1], field.targets[i][2]});
  skin.joints.assign(field.joints, field.joints + influences);
  return skin;
}

}  // namespace nif::format
