// Moves vertices by morph targets, lets kernels move them by joints, and refits trees. docs/answers.md ("Posed
// vertices") has the order of operations.
#include "scene/bending.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "api/error.hpp"
#include "query/float4.hpp"
#include "query/float_environment.hpp"
#include "scene/asset.hpp"

namespace nif::runtime {
namespace {

/// The caller's float number `i` of vertex `v`. Computed as an integer: a stride may be negative, in two's complement.
float value_at(const float* positions, uint64_t stride, uint64_t v, uint32_t i) {
  float value;
  std::memcpy(
      &value,
      reinterpret_cast<const void*>(reinterpret_cast<uintptr_t>(positions + i) + uintptr_t(v * stride)),
      sizeof(value));
  return value;
}

/// Of vertices in memory of the GPU, in bytes: what lies between them is copied, too.
constexpr uint64_t kMostStride = 2048;

/// Where vertices lie in memory, if strides are at most kMostStride.
struct VertexSpan {
  uint64_t bytes;
  uint64_t before;  ///< from its first byte to vertex 0, which is the last one if the stride is negative
};
VertexSpan span_of(uint64_t stride, uint32_t last_vertex) {
  const bool backwards = stride > kMostStride;
  const uint64_t between = last_vertex * (backwards ? 0 - stride : stride);
  return {between + 3 * sizeof(float), backwards ? between : 0};
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
      points_(memory),
      corners_(size_t{field_->triangle_count} * 3, 0, memory),
      point_corners_(memory),
      rest_(memory),
      weights_(memory),
      joints_(memory) {
  number_vertices(asset.numbers_of(object, format::kSourceVertices)->field);
  for (uint32_t n = 0; n < field_->node_count; ++n) {
    const kernels::BvhNode& node = field_->nodes[n];
    uint32_t triangles = 0;
    for (const uint8_t slot : node.slots)
      if (kernels::slot_kind(slot) != kernels::kInnerSlot) triangles += kernels::slot_kind(slot);
    for (uint32_t t = node.first_triangle; t < node.first_triangle + triangles; ++t)
      for (uint32_t k = 0; k < 3; ++k)
        corners_[size_t{t} * 3 + k] = vertices_[node.first_vertex + field_->triangles[t][k]];
  }
  if (points_.empty()) return;
  point_corners_.reserve(corners_.size());
  for (const uint32_t vertex : corners_) point_corners_.push_back(points_[vertex]);
}

/// Joints that a pose adds up for a vertex of the source.
uint32_t BendingObject::joints_of(uint32_t source) const {
  if (skin_ == nullptr || skin_->influences == 0) return 0;
  const float* const weights = skin_->weights + size_t{source} * skin_->influences;
  uint32_t count = 1;
  for (uint32_t k = 1; k < skin_->influences; ++k) count += weights[k] != 0;
  return count;
}

/// Compares what moves two vertices, as the bits are: 0 if it is the same.
int BendingObject::compare_moves(uint32_t source, uint32_t other) const {
  const auto compare = [&](const auto* numbers, size_t each) {
    return std::memcmp(numbers + source * each, numbers + other * each, each * sizeof(numbers[0]));
  };
  if (const int order = compare(skin_->weights, skin_->influences)) return order;
  if (const int order = compare(skin_->joints, skin_->influences)) return order;
  for (uint32_t t = 0; t < skin_->target_count; ++t)
    if (const int order = compare(skin_->targets + size_t{t} * skin_->vertex_count, 1)) return order;
  return 0;
}

void BendingObject::number_vertices(const kernels::SourceTriangles& numbers) {
  const std::pmr::polymorphic_allocator<uint32_t> memory = sources_.get_allocator();
  struct Used {
    uint32_t source, stored;  ///< the first vertex of the field that has it
    uint32_t joints, point;   ///< index of the first vertex that moves alike
  };
  std::pmr::vector<Used> used(memory);
  used.reserve(field_->vertex_count);
  for (uint32_t v = 0; v < field_->vertex_count; ++v) {
    const uint32_t source = kernels::source_triangle(numbers, v);
    used.push_back({source, v, joints_of(source), 0});
  }
  const auto by_source = [](const Used& a, const Used& b) {
    return a.source != b.source ? a.source < b.source : a.stored < b.stored;
  };
  std::sort(used.begin(), used.end(), by_source);
  used.erase(std::unique(used.begin(), used.end(), [](auto& a, auto& b) { return a.source == b.source; }),
             used.end());
  const auto count = uint32_t(used.size());
  for (uint32_t i = 0; i < count; ++i) used[i].point = i;
  if (skin_) {
    const auto compare = [&](const Used& a, const Used& b) {
      const int order =
          std::memcmp(field_->vertices[a.stored], field_->vertices[b.stored], 3 * sizeof(float));
      return order != 0 ? order : compare_moves(a.source, b.source);
    };
    std::pmr::vector<uint32_t> alike(count, 0, memory);
    for (uint32_t i = 0; i < count; ++i) alike[i] = i;
    std::sort(alike.begin(), alike.end(), [&](uint32_t a, uint32_t b) {
      const int order = compare(used[a], used[b]);
      return order != 0 ? order < 0 : used[a].stored < used[b].stored;
    });
    for (uint32_t i = 1; i < count; ++i)
      if (compare(used[alike[i - 1]], used[alike[i]]) == 0) used[alike[i]].point = used[alike[i - 1]].point;
  }
  // The new order: points first.
  std::pmr::vector<uint32_t> order(count, 0, memory), number(count, 0, memory);
  for (uint32_t i = 0; i < count; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const bool copy = used[a].point != a, other = used[b].point != b;
    if (copy != other) return other;
    if (used[a].joints != used[b].joints) return used[a].joints < used[b].joints;
    return used[a].stored < used[b].stored;
  });
  for (uint32_t n = 0; n < count; ++n) number[order[n]] = n;
  sources_.reserve(count);
  for (const uint32_t i : order) sources_.push_back(used[i].source);
  last_source_ = count > 0 ? used.back().source : 0;
  for (uint32_t v = 0; v < field_->vertex_count; ++v) {
    const Used wanted{kernels::source_triangle(numbers, v), 0, 0, 0};
    vertices_[v] =
        number[size_t(std::lower_bound(used.begin(), used.end(), wanted, by_source) - used.begin())];
  }
  uint32_t points = 0;
  size_t influences = 0;
  for (; points < count && used[order[points]].point == order[points]; ++points)
    influences += used[order[points]].joints;
  if (points < count) {
    points_.reserve(count);
    for (const uint32_t i : order) points_.push_back(number[used[i].point]);
  }
  rest_.reserve(points);
  weights_.reserve(influences);
  joints_.reserve(influences);
  for (uint32_t p = 0; p < points; ++p) {
    const Used& own = used[order[p]];
    const float* const at = field_->vertices[own.stored];
    rest_.push_back({at[0], at[1], at[2], 1});
    ++order_.vertex_count[own.joints];
    for (uint32_t k = 0; own.joints != 0 && k < skin_->influences; ++k) {
      const size_t from = size_t{own.source} * skin_->influences + k;
      if (k != 0 && skin_->weights[from] == 0) continue;
      weights_.push_back(skin_->weights[from]);
      joints_.push_back(skin_->joints[from]);
    }
  }
  order_.weights = weights_.data();
  order_.joints = joints_.data();
}

BentObject::BentObject(const BendingObject& shared, const KernelChoice& choice, bool nodes,
                       SharedCopies& copies, const BentObject* like, std::pmr::memory_resource* memory)
    : shared_(&shared),
      positions_(shared.sources().size(), Vertex{}, memory),
      joints_(shared.skin() ? shared.skin()->joint_count : 0, kernels::JointMatrix{}, memory),
      weights_(shared.skin() ? shared.skin()->target_count : 0, 0.0f, memory),
      nodes_(memory),
      vertices_(memory),
      boxes_(memory),
      field_(shared.field()),
      kernel_(like ? copy_moving_kernel(*like->kernel_, shared.field(), choice, memory, copies)
                   : make_moving_kernel(shared.field(), choice, memory, copies)) {
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
  rest();
  refit();
  refitted_ = false;
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
  posed_ = poses_ = false;
  expected_ = {};
}

void BentObject::rest() {
  std::copy(shared_->rest().begin(), shared_->rest().end(), positions_.begin());
  changed_ = true;
  posed_ = true;
  poses_ = false;
  expected_ = {};
}

void BentObject::check(const NifPose& pose) const {
  if (pose.positions != nullptr) {
    if (pose.joints != nullptr || pose.weights != nullptr || pose.joint_count != 0 || pose.target_count != 0)
      refuse_argument("the pose has positions, and joints or weights, too");
    const uint64_t stride = pose.position_stride;
    if (pose.memory == NIF_MEMORY_DEVICE && std::min(stride, 0 - stride) > kMostStride)
      refuse_argument("positions: the stride is more than " + std::to_string(kMostStride) +
                      " bytes, which is the most in device memory");
    return;
  }
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
}

void BentObject::pose(const NifPose& pose) {
  check(pose);
  if (pose.positions != nullptr)
    set_vertices(pose.positions, pose.position_stride);
  else
    pose_by_skin(pose);
}

void BentObject::pose_by_skin(const NifPose& pose) {
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
  for (uint32_t j = 0; j < pose.joint_count; ++j)
    for (uint32_t column = 0; column < 4; ++column)
      for (uint32_t row = 0; row < 3; ++row)
        joints_[j].columns[column][row] = pose.joints[12 * size_t{j} + 4 * row + column];
  std::copy_n(pose.weights, pose.target_count, weights_.begin());
  target_count_ = pose.target_count;
  changed_ = true;
  posed_ = poses_ = true;
  expected_ = {};
}

void BentObject::fetch(NifDeviceObject& device, const NifPose& pose) {
  check(pose);
  FetchedArray arrays[] = {{pose.joints, uint64_t{pose.joint_count} * 12 * sizeof(float), "pose: joints"},
                           {pose.weights, uint64_t{pose.target_count} * sizeof(float), "pose: weights"}};
  uint32_t count = 2;
  if (pose.positions != nullptr) {
    const VertexSpan span = span_of(pose.position_stride, shared_->last_source());
    arrays[0] = {
        reinterpret_cast<const void*>(reinterpret_cast<uintptr_t>(pose.positions) - uintptr_t(span.before)),
        span.bytes, "pose: positions"};
    count = 1;
  }
  device.gpu->fetch(device, std::span(arrays, count), pose.stream, fetched_);
  // With positions, the other array has no bytes.
  fetched_bytes_ = std::max(fetched_bytes_, arrays[0].bytes + arrays[1].bytes);
  expected_ = pose;
}

void BentObject::receive(NifDeviceObject& device) {
  try {
    const unsigned char* const bytes = device.gpu->wait(device, *fetched_);
    NifPose here = expected_;
    if (here.positions != nullptr) {
      const VertexSpan span = span_of(here.position_stride, shared_->last_source());
      here.positions = reinterpret_cast<const float*>(bytes + span.before);
    } else {
      here.joints = reinterpret_cast<const float*>(bytes);
      here.weights = here.joints + uint64_t{here.joint_count} * 12;
    }
    pose(here);
  } catch (const Failure&) {
    expected_ = {};
    throw;
  }
}

NIF_COMPUTES void BentObject::move_by_skin() {
  const kernels::SkinField& skin = *shared_->skin();
  const std::span<const Vertex> rest = shared_->rest();
  const Vertex* from = rest.data();
  if (target_count_ != 0 || skin.influences == 0) {
    std::copy(rest.begin(), rest.end(), positions_.begin());
    for (uint32_t t = 0; t < target_count_; ++t) {
      const float(*const moves)[3] = skin.targets + size_t{t} * skin.vertex_count;
      for (size_t p = 0; p < rest.size(); ++p)
        for (uint32_t i = 0; i < 3; ++i) positions_[p].at[i] += weights_[t] * moves[shared_->sources()[p]][i];
    }
    from = positions_.data();
  }
  if (skin.influences == 0) return;
  kernel_->skin(shared_->skin_order(), joints_.data(), reinterpret_cast<const float(*)[4]>(from),
                reinterpret_cast<float(*)[4]>(positions_.data()));
}

/// Of those that triangles have.
kernels::VertexBox BentObject::box_of_positions() const {
  kernels::VertexBox box;
  box.clear();
  Float4 low = load4(box.low), high = load4(box.high);
  for (const Vertex& vertex :
       std::span(positions_).first(posed_ ? shared_->rest().size() : positions_.size())) {
    const Float4 at = load4(vertex.at);
    low = min_of(at, low);
    high = max_of(at, high);
  }
  store4(box.low, low);
  store4(box.high, high);
  return box;
}

void BentObject::refit() {
  if (!changed_) return;
  if (poses_) move_by_skin();
  poses_ = false;
  kernels::VertexBox box;
  if (!nodes_.empty()) {
    for (uint32_t v = 0; v < field_.vertex_count; ++v)
      std::copy_n(positions_[shared_->vertex_of(v, posed_)].at, 3, vertices_.data() + 1 + size_t{v} * 3);
    kernels::refit(field_, nodes_.data(), boxes_.data());
    box = boxes_[0];
  } else {
    box = box_of_positions();
    root_ = kernels::root_around(box);
  }
  field_.extent = kernels::bvh_extent(field_.nodes[0]);
  kernel_->move(
      {field_, box, reinterpret_cast<const float(*)[4]>(positions_.data()), shared_->corners(posed_)});
  changed_ = false;
  refitted_ = true;
  current_on_gpu = false;
}

size_t BentObject::bytes() const {
  return sizeof(*this) + positions_.capacity() * sizeof(Vertex) +
         joints_.capacity() * sizeof(kernels::JointMatrix) + weights_.capacity() * sizeof(float) +
         nodes_.capacity() * sizeof(kernels::BvhNode) + vertices_.capacity() * sizeof(float) +
         boxes_.capacity() * sizeof(kernels::VertexBox) + kernel_->built_bytes().decoded_triangles +
         kernel_.get_deleter().bytes + size_t(fetched_bytes_);
}

}  // namespace nif::runtime
