// Moves vertices by joints and morph targets, four components at once, and refits trees. docs/answers.md ("Posed
// vertices") has the order of operations.
#include "scene/bending.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "api/error.hpp"
#include "query/float4.hpp"
#include "query/float_environment.hpp"
#include "scene/asset.hpp"

namespace nif::runtime {
namespace {

constexpr uint32_t kColumns = 4;  ///< of a matrix: the last is the translation

/// The caller's float number `i` of vertex `v`. Computed as an integer: a stride may be negative, in two's complement.
float value_at(const float* positions, uint64_t stride, uint64_t v, uint32_t i) {
  float value;
  std::memcpy(
      &value,
      reinterpret_cast<const void*>(reinterpret_cast<uintptr_t>(positions + i) + uintptr_t(v * stride)),
      sizeof(value));
  return value;
}

/// Largest magnitude of some numbers; infinity if one is not finite.
float largest_of(const float* numbers, uint64_t count) {
  float largest = 0;
  for (uint64_t i = 0; i < count; ++i)
    largest = std::isnan(numbers[i]) ? HUGE_VALF : std::max(std::abs(numbers[i]), largest);
  return largest;
}

}  // namespace

uint64_t bending_vertices(const format::AssetView& asset, uint32_t object) {
  const format::ObjectView& view = asset.objects[object];
  if (view.unsupported || !view.is<kernels::TrianglesField>()) return 0;
  const format::NumbersView* const sources = asset.numbers_of(object, format::kSourceVertices);
  return sources ? sources->below : 0;
}

BendingObject::BendingObject(const format::AssetView& asset, uint32_t object,
                             std::pmr::memory_resource* memory)
    : field_(&asset.objects[object].triangles->field),
      skin_(asset.skin_of(object) ? &asset.skin_of(object)->field : nullptr),
      sources_(memory),
      vertices_(field_->vertex_count, 0, memory),
      corners_(size_t{field_->triangle_count} * 3, 0, memory),
      rest_(memory) {
  const kernels::SourceTriangles& numbers = asset.numbers_of(object, format::kSourceVertices)->field;
  sources_.reserve(field_->vertex_count);
  for (uint32_t v = 0; v < field_->vertex_count; ++v)
    sources_.push_back(kernels::source_triangle(numbers, v));
  std::sort(sources_.begin(), sources_.end());
  sources_.erase(std::unique(sources_.begin(), sources_.end()), sources_.end());
  rest_.resize(sources_.size());
  for (uint32_t v = 0; v < field_->vertex_count; ++v) {
    const uint32_t source = kernels::source_triangle(numbers, v);
    vertices_[v] = uint32_t(std::lower_bound(sources_.begin(), sources_.end(), source) - sources_.begin());
    std::copy_n(field_->vertices[v], 3, rest_[vertices_[v]].at);
  }
  for (uint32_t n = 0; n < field_->node_count; ++n) {
    const kernels::BvhNode& node = field_->nodes[n];
    uint32_t triangles = 0;
    for (const uint8_t slot : node.slots)
      if (kernels::slot_kind(slot) != kernels::kInnerSlot) triangles += kernels::slot_kind(slot);
    for (uint32_t t = node.first_triangle; t < node.first_triangle + triangles; ++t)
      for (uint32_t k = 0; k < 3; ++k)
        corners_[size_t{t} * 3 + k] = vertices_[node.first_vertex + field_->triangles[t][k]];
  }
}

BentObject::BentObject(const BendingObject& shared, const KernelChoice& choice, bool nodes,
                       SharedCopies& copies, std::pmr::memory_resource* memory)
    : shared_(&shared),
      positions_(shared.rest().begin(), shared.rest().end(), memory),
      joints_(shared.skin() ? size_t{shared.skin()->joint_count} * kColumns : 0, Vertex{}, memory),
      nodes_(memory),
      vertices_(memory),
      boxes_(memory),
      field_(shared.field()),
      kernel_(make_moving_kernel(shared.field(), choice, memory, copies)) {
  if (nodes || kernel_->reads_nodes()) {
    nodes_.assign(field_.nodes, field_.nodes + field_.node_count);
    // A vertex is loaded with the word before it.
    vertices_.resize(1 + size_t{field_.vertex_count} * 3);
    boxes_.resize(field_.node_count);
    field_.nodes = nodes_.data();
    field_.vertices = reinterpret_cast<const float(*)[3]>(vertices_.data() + 1);
  } else {
    field_.nodes = &root_;
  }
  refit();
}

void BentObject::set_vertices(const float* positions, uint64_t stride) {
  const std::span<const uint32_t> sources = shared_->sources();
  for (const uint32_t source : sources)
    for (uint32_t i = 0; i < 3; ++i)
      if (const float value = value_at(positions, stride, source, i);
          !(std::abs(value) <= kernels::kMaxVertexCoordinate))
        refuse_argument(
            "vertex " + std::to_string(source) +
            (std::isfinite(value) ? " is too far from the origin to compute with" : " is not finite"));
  for (size_t v = 0; v < sources.size(); ++v)
    for (uint32_t i = 0; i < 3; ++i) positions_[v].at[i] = value_at(positions, stride, sources[v], i);
  changed_ = true;
}

void BentObject::rest() {
  std::copy(shared_->rest().begin(), shared_->rest().end(), positions_.begin());
  changed_ = true;
}

void BentObject::pose(const NifPose& pose) {
  const kernels::SkinField* const skin = shared_->skin();
  if (skin == nullptr) refuse_argument("the object has no skin; nifSetInstanceVertices can move it");
  if (pose.joint_count != skin->joint_count)
    refuse_argument("the pose has " + std::to_string(pose.joint_count) + " joints, but the object " +
                    std::to_string(skin->joint_count));
  if (pose.target_count != 0 && pose.target_count != skin->target_count)
    refuse_argument("the pose has weights of " + std::to_string(pose.target_count) +
                    " morph targets, but the object has " + std::to_string(skin->target_count));
  if (pose.joint_count != 0) require_argument(pose.joints, "joints");
  if (pose.target_count != 0) require_argument(pose.weights, "weights");
  // No vertex may overflow, or come farther than a tree can hold: bounded before the first is moved.
  const float joints = largest_of(pose.joints, uint64_t{pose.joint_count} * 12);
  const float weights = largest_of(pose.weights, pose.target_count);
  if (!std::isfinite(joints)) refuse_argument("a matrix of a joint is not finite");
  if (!std::isfinite(weights)) refuse_argument("the weight of a morph target is not finite");
  double reach =
      double{shared_->field().extent} + double{weights} * double{format::kMostMove} * pose.target_count;
  if (pose.joint_count != 0) reach = double{joints} * (3 * reach + 1) * 1.01;
  if (!(reach <= double{kernels::kMaxVertexCoordinate}))
    refuse_argument("the pose moves vertices too far from the origin to compute with");
  move_by_skin(pose);
  changed_ = true;
}

NIF_COMPUTES void BentObject::move_by_skin(const NifPose& pose) {
  const kernels::SkinField& skin = *shared_->skin();
  for (uint32_t j = 0; j < pose.joint_count; ++j)
    for (uint32_t column = 0; column < kColumns; ++column)
      for (uint32_t row = 0; row < 3; ++row)
        joints_[size_t{j} * kColumns + column].at[row] = pose.joints[12 * size_t{j} + 4 * row + column];
  const std::span<const Vertex> rest = shared_->rest();
  for (size_t v = 0; v < rest.size(); ++v) {
    const size_t source = shared_->sources()[v];
    Vertex from = rest[v];
    for (uint32_t t = 0; t < pose.target_count; ++t)
      for (uint32_t i = 0; i < 3; ++i)
        from.at[i] += pose.weights[t] * skin.targets[size_t{t} * skin.vertex_count + source][i];
    if (skin.influences == 0) {
      positions_[v] = from;
      continue;
    }
    const float* const weights = skin.weights + source * skin.influences;
    const uint16_t* const joints = skin.joints + source * skin.influences;
    const Vertex* joint = &joints_[size_t{joints[0]} * kColumns];
    Float4 mean[kColumns];
    for (uint32_t column = 0; column < kColumns; ++column)
      mean[column] = load4(joint[column].at) * all_of(weights[0]);
    for (uint32_t k = 1; k < skin.influences; ++k) {
      if (weights[k] == 0) continue;  // most vertices have one joint or two
      joint = &joints_[size_t{joints[k]} * kColumns];
      for (uint32_t column = 0; column < kColumns; ++column)
        mean[column] = mean[column] + load4(joint[column].at) * all_of(weights[k]);
    }
    store4(positions_[v].at,
           ((mean[0] * all_of(from.at[0]) + mean[1] * all_of(from.at[1])) + mean[2] * all_of(from.at[2])) +
               mean[3]);
  }
}

bool BentObject::refit() {
  if (!changed_) return false;
  kernels::VertexBox box;
  if (!nodes_.empty()) {
    for (uint32_t v = 0; v < field_.vertex_count; ++v)
      std::copy_n(positions_[shared_->vertex_of(v)].at, 3, vertices_.data() + 1 + size_t{v} * 3);
    kernels::refit(field_, nodes_.data(), boxes_.data());
    box = boxes_[0];
  } else {
    box.clear();
    Float4 low = load4(box.low), high = load4(box.high);
    for (const Vertex& vertex : positions_) {
      const Float4 at = load4(vertex.at);
      low = min_of(at, low);
      high = max_of(at, high);
    }
    store4(box.low, low);
    store4(box.high, high);
    root_ = kernels::root_around(box);
  }
  field_.extent = kernels::bvh_extent(field_.nodes[0]);
  kernel_->move({field_, box, reinterpret_cast<const float(*)[4]>(positions_.data()), shared_->corners()});
  changed_ = false;
  return true;
}

size_t BentObject::bytes() const {
  return sizeof(*this) + (positions_.capacity() + joints_.capacity()) * sizeof(Vertex) +
         nodes_.capacity() * sizeof(kernels::BvhNode) + vertices_.capacity() * sizeof(float) +
         boxes_.capacity() * sizeof(kernels::VertexBox) + kernel_->built_bytes().decoded_triangles +
         kernel_.get_deleter().bytes;
}

}  // namespace nif::runtime
