// Reads and checks how the vertices of an object bend: what is accepted makes no pose read outside of its joints. The
// writer is in write_skin.cpp, because the runtime does not need it.
#include "formats/nif/triangles/skin_section.hpp"

#include <cmath>

#include "formats/nif/reader.hpp"

namespace nif::format {

std::optional<SkinView> read_record(const SkinRecord& record, const ObjectView& object,
                                    const Reading& reading) {
  const Place& place = reading.place;
  place.require(object.is<kernels::TrianglesField>(), Rule::skin_object);
  const NumbersView* const sources = reading.asset.numbers_of(record.object, kSourceVertices);
  place.require(sources != nullptr && record.vertices == sources->below && record.vertices != 0,
                Rule::skin_vertices);
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  place.require(record.joints <= kernels::kMostJoints, Rule::skin_joints);
  const bool known = record.joints == 0
                         ? record.influences == 0 && record.targets != 0
                         : record.influences == 4 || record.influences == kernels::kMostInfluences;
  place.require(known, Rule::skin_influences);
  SkinView view;
  view.object = record.object;
  kernels::SkinField& field = view.field;
  field.vertex_count = record.vertices;
  field.joint_count = record.joints;
  field.influences = record.influences;
  field.target_count = record.targets;
  // Cannot overflow: 2^32 vertices with 8 influences of 6 bytes each, and 2^28 targets at most.
  place.require(record.targets < (1u << 28), Rule::skin_targets);
  const uint64_t weights = uint64_t{record.vertices} * record.influences,
                 moves = uint64_t{record.vertices} * record.targets;
  const std::byte* const at = reading.payloads.next(record.values, view.bytes(), "skin", place).data();
  field.weights = reinterpret_cast<const float*>(at);
  field.targets = reinterpret_cast<const float(*)[3]>(at + weights * sizeof(float));
  field.joints =
      reinterpret_cast<const uint16_t*>(at + weights * sizeof(float) + moves * sizeof(*field.targets));
  for (uint64_t v = 0; v < record.vertices && record.influences != 0; ++v) {
    double sum = 0;
    for (uint64_t i = v * record.influences; i < (v + 1) * record.influences; ++i) {
      place.require(field.weights[i] >= 0 && field.weights[i] <= 1, Rule::skin_weight);
      place.require(field.joints[i] < record.joints, Rule::skin_joint);
      sum += double{field.weights[i]};
    }
    place.require(std::abs(sum - 1) <= double{kernels::kWeightSlack}, Rule::skin_weight);
  }
  for (uint64_t i = 0; i < moves; ++i)
    for (const float move : field.targets[i]) place.require(std::abs(move) <= kMostMove, Rule::skin_targets);
  return view;
}

}  // namespace nif::format
