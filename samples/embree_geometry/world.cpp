// Builds both Embree scenes from the same instances, so that shadows can be compared. A rough check of the
// bounds detects an asset that was baked from another mesh.
#include "world.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

namespace {

using nifkit::Transform;

struct ReleaseGeometry {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Geometry = std::unique_ptr<RTCGeometryTy, ReleaseGeometry>;

Scene new_scene(RTCDevice embree) {
  Scene scene(rtcNewScene(embree));
  if (!scene) throw std::runtime_error("Embree created no scene");
  return scene;
}

Geometry triangles(RTCDevice embree, const std::vector<std::array<float, 3>>& positions,
                   const std::vector<std::array<uint32_t, 3>>& corners) {
  Geometry geometry(rtcNewGeometry(embree, RTC_GEOMETRY_TYPE_TRIANGLE));
  const auto fill = [&](RTCBufferType type, RTCFormat format, const auto& values) {
    void* buffer = rtcSetNewGeometryBuffer(geometry.get(), type, 0, format, sizeof(values[0]), values.size());
    if (!buffer) throw std::runtime_error("Embree has no memory for the mesh");
    std::memcpy(buffer, values.data(), values.size() * sizeof(values[0]));
  };
  fill(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, positions);
  fill(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, corners);
  rtcCommitGeometry(geometry.get());
  return geometry;
}

/// Applies b, then a.
Transform multiply(const Transform& a, const Transform& b) {
  Transform c;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 4; ++column) {
      float sum = column == 3 ? a[4 * row + 3] : 0;
      for (size_t k = 0; k < 3; ++k) sum += a[4 * row + k] * b[4 * k + column];
      c[4 * row + column] = sum;
    }
  }
  return c;
}

/// Rotates and scales around a point, then moves that point to another.
Transform placed(const std::array<float, 3>& from, float turn, float scale, const std::array<float, 3>& to) {
  const float c = scale * std::cos(turn), s = scale * std::sin(turn);
  Transform t{c, 0, s, 0, 0, scale, 0, 0, -s, 0, c, 0};
  for (size_t row = 0; row < 3; ++row) {
    t[4 * row + 3] = to[row];
    for (size_t k = 0; k < 3; ++k) t[4 * row + 3] -= t[4 * row + k] * from[k];
  }
  return t;
}

struct Part {
  uint32_t object;
  Transform transform;
};

/// The transforms with which the asset's file places its objects.
std::vector<Part> parts_of(const nifkit::Asset& asset) {
  std::vector<Part> parts;
  const NifAssetInfo info = asset.info();
  for (uint32_t i = 0; i < info.instance_count; ++i) {
    const NifAssetInstanceInfo instance = asset.instance(i);
    parts.push_back({instance.object, {}});
    std::copy_n(instance.transform, 12, parts.back().transform.begin());
  }
  if (parts.empty() && !info.places_nothing) {
    for (uint32_t object = 0; object < info.object_count; ++object)
      if (asset.object(object).level == 0) parts.push_back({object, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}});
  }
  return parts;
}

/// Checks whether the asset was baked from this mesh: no part may lie outside of the mesh's box.
void check_parts(const nifkit::Asset& asset, const std::vector<Part>& parts, const Mesh& mesh, float size) {
  for (const Part& part : parts) {
    const NifObjectInfo object = asset.object(part.object);
    for (size_t a = 0; a < 3; ++a) {
      const float* row = &part.transform[4 * a];
      float low = row[3], high = row[3];
      for (size_t k = 0; k < 3; ++k) {
        low += std::min(row[k] * object.bounds_min[k], row[k] * object.bounds_max[k]);
        high += std::max(row[k] * object.bounds_min[k], row[k] * object.bounds_max[k]);
      }
      // Rotated boxes are larger than their contents.
      if (low < mesh.low[a] - size || high > mesh.high[a] + size ||
          (parts.size() == 1 && std::abs(low - mesh.low[a]) + std::abs(high - mesh.high[a]) > 0.01f * size))
        throw std::runtime_error("the asset was not baked from this mesh: its bounds differ");
    }
  }
}

}  // namespace

World::World(RTCDevice embree, const nifkit::Device& device, const nifkit::Asset& asset, const Mesh& mesh)
    : model_(new_scene(embree)), own_(new_scene(embree)), shadow_(new_scene(embree)), direct_(device) {
  size_ = 0;
  for (size_t a = 0; a < 3; ++a) {
    middle_[a] = (mesh.low[a] + mesh.high[a]) / 2;
    size_ = std::max(size_, mesh.high[a] - mesh.low[a]);
  }
  const std::vector<Part> parts = parts_of(asset);
  check_parts(asset, parts, mesh, size_);

  rtcAttachGeometry(model_.get(), triangles(embree, mesh.positions, mesh.triangles).get());
  rtcCommitScene(model_.get());
  for (uint32_t object = 0; object < asset.info().object_count; ++object) {
    objects_.push_back(std::make_unique<NifGeometry>(embree, device, asset, object));
    assets_.push_back(new_scene(embree));
    rtcAttachGeometry(assets_.back().get(), objects_.back()->handle());
    rtcCommitScene(assets_.back().get());
    bias_ = std::max(bias_, asset.object(object).bias);
  }

  const float floor = mesh.low[1], wide = 500 * size_;
  const Geometry ground = triangles(embree,
                                    {{middle_[0] - wide, floor, middle_[2] - wide},
                                     {middle_[0] - wide, floor, middle_[2] + wide},
                                     {middle_[0] + wide, floor, middle_[2] + wide},
                                     {middle_[0] + wide, floor, middle_[2] - wide}},
                                    {{0, 1, 2}, {0, 2, 3}});
  rtcAttachGeometry(own_.get(), ground.get());
  rtcAttachGeometry(shadow_.get(), ground.get());

  // One in the middle, and smaller ones around it, all on the floor.
  const std::array<float, 3> foot{middle_[0], floor, middle_[2]};
  std::vector<Transform> copies{placed(foot, 0, 1, foot)};
  for (int i = 0; i < 7; ++i) {
    const float angle = 0.9f * float(i);
    copies.push_back(placed(
        foot, 2.4f * float(i), 0.35f + 0.05f * float(i % 3),
        {foot[0] + 0.95f * size_ * std::cos(angle), floor, foot[2] + 0.95f * size_ * std::sin(angle)}));
  }
  for (const Transform& copy : copies) {
    place(embree, own_.get(), model_.get(), copy);
    for (const Part& part : parts)
      place(embree, shadow_.get(), assets_[part.object].get(), multiply(copy, part.transform));
    direct_.add_asset(asset, copy);
  }
  rtcCommitScene(own_.get());
  rtcCommitScene(shadow_.get());
  direct_.commit();
}

void World::place(RTCDevice embree, RTCScene into, RTCScene what, const Transform& transform) {
  const Geometry instance(rtcNewGeometry(embree, RTC_GEOMETRY_TYPE_INSTANCE));
  rtcSetGeometryInstancedScene(instance.get(), what);
  rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform.data());
  rtcCommitGeometry(instance.get());
  rtcAttachGeometry(into, instance.get());
}

void World::throw_where_a_query_failed() const {
  for (const auto& object : objects_) {
    if (const NifError error = object->failure(); error != NIF_OK)
      throw std::runtime_error(std::string("a query failed: ") + nifGetErrorName(error));
  }
}
