// Bakes one mesh into every encoding and asks scenes of it by every call, which must agree.
#include "tests/exact/subject.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "bake/triangles/builder.hpp"
#include "formats/mesh/transform.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"
#include "tests/support/coded.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/to_world.hpp"

namespace nif::test {
namespace {

constexpr Transform kInPlace{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// An arbitrary answer for unproven rays.
format::Mlp untrained(uint32_t inputs) {
  format::Layer layer{.inputs = inputs, .outputs = 1, .shift = 0, .biases = {1}, .weights = {}};
  for (uint32_t i = 0; i < inputs; ++i) layer.weights.push_back(i % 2 ? 3 : -3);
  return {.layers = {layer}};
}

/// A change in object space before the transform: none, a shift, a larger shift, or a mirrored quarter turn.
Transform beside(const mesh::Box& box, Random& random) {
  Transform t = kInPlace;
  const uint32_t kind = random.below(5);
  for (size_t a = 0; a < 3; ++a) {
    const double size = double(box.max[a]) - double(box.min[a]);
    if (kind == 1) t[4 * a + 3] = float(random.uniform(-1, 1) * size);
    if (kind == 2) t[4 * a + 3] = float(size);
    if (kind == 4) t[4 * a + 3] = float(8 * size);
    if (kind == 3) {  // a quarter turn about the middle, mirrored
      const size_t from = (a + 1) % 3;
      t[4 * a + a] = 0;
      t[4 * a + from] = random.below(2) ? 1 : -1;
      const auto middle = [&](size_t k) { return (double(box.min[k]) + double(box.max[k])) / 2; };
      t[4 * a + 3] = float(middle(a) - double(t[4 * a + from]) * middle(from));
    }
  }
  return t;
}

}  // namespace

const char* name_of(Placed placed) {
  static const char* const names[kPlaced] = {"bvh",           "exact",     "proof",       "segment",
                                             "all",           "moved bvh", "moved exact", "moved proof",
                                             "moved segment", "crowd",     "changed"};
  return names[size_t(placed)];
}

GridShape draw_grid(Random& random) {
  const uint32_t levels = random.below(3);
  return {levels, 3 + random.below(levels == 0 ? 30u : 14u)};
}

Subject::Subject(const mesh::Mesh& mesh, const Transform& transform, Random& random) {
  const auto [levels, resolution] = draw_grid(random);
  const bake::Prepared prepared = bake::prepare(mesh);
  const mesh::CleanMesh& surface = prepared.surface;
  if (!bake::fits_bvh(surface.positions)) throw Error(Status::too_large, mesh.name + ": too large for a BVH");
  // With slivers, as the baker keeps them, or without: seams must be closed either way.
  std::vector<mesh::Triangle> all = surface.triangles;
  if (random.below(2)) all.insert(all.end(), surface.slivers.begin(), surface.slivers.end());
  std::vector<uint32_t> order;
  const format::TrianglesData bvh = bake::build_bvh(surface.positions, all, &order);
  for (const uint32_t number : order) {
    const mesh::Triangle& t = all[number];
    triangles_.push_back({surface.positions[t[0]], surface.positions[t[1]], surface.positions[t[2]]});
  }
  const auto fits_planes = [](const mesh::Float3& p) {
    return std::all_of(p.begin(), p.end(),
                       [](float x) { return std::abs(x) <= kernels::kMaxExactCoordinate; });
  };
  const bool planes = std::all_of(surface.positions.begin(), surface.positions.end(), fits_planes);
  format::PlanesData proof;
  format::Object segment;
  if (planes) {
    const OccupiedObject occupied(mesh, resolution, {.levels = levels});
    segment = occupied.object;
    bake::store_occupancy(occupied.occupancy, occupied.mesh.name, proof);
    format::leave_bare(proof);  // numbers the voxels of bricks, of which there are fewer without corners
    proof.voxel_records = segment.planes->voxel_records;
    proof.children = segment.planes->children;
  }
  for (const bool coded : {false, true}) {
    format::Asset asset;
    asset.objects.emplace_back().triangles = bvh;
    if (planes) {
      asset.objects.push_back(asset.objects[0]);
      asset.objects[1].planes = proof;
      asset.objects.emplace_back().planes = proof;
      asset.objects.push_back(segment);
      asset.mlps.push_back(
          untrained(kernels::input_count(segment.network->samples, segment.network->features_per_corner)));
    }
    for (format::Object& object : asset.objects) {
      set_coded(coded ? kCodedAll & ~4u : 0, object);
      object.name = "mesh";
      for (size_t a = 0; a < 3; ++a) {
        object.aabb_min[a] = prepared.box.min[a];
        object.aabb_max[a] = prepared.box.max[a];
      }
      object.bias = prepared.bias;
      object.triangle_count = uint32_t(surface.triangles.size());
    }
    (coded ? coded_ : plain_) = format::encode(asset);
  }
  place(transform, planes, prepared.box, random);
}

void Subject::place(const Transform& transform, bool planes, const mesh::Box& box, Random& random) {
  for (uint32_t kind = 0; kind < (planes ? kKinds : 1); ++kind) {
    scenes_[kind] = {{Kind(kind), kInPlace}};
    scenes_[size_t(Placed::moved_bvh) + kind] = {{Kind(kind), transform}};
    if (planes) scenes_[size_t(Placed::all)].push_back({Kind(kind), kInPlace});
  }
  std::vector<Instance>& crowd = scenes_[size_t(Placed::crowd)];
  for (uint32_t count = 2 + random.below(4); crowd.size() < count;) {
    const Kind kind = Kind(random.below(planes ? kKinds : 1));
    const Transform near = beside(box, random);
    crowd.push_back({kind, crowd.empty() ? transform : mesh::compose(transform, near)});
  }
  draw_changed(transform, planes, box, random);
  for (std::vector<Instance>& scene : scenes_)
    for (Instance& one : scene) {
      const bool changed = &scene == &scenes_[size_t(Placed::changed)];
      const LongMatrix at = at_origin(one.transform, one.origin, changed ? origin_ : Origin{});
      one.placed = at.matrix;
      one.remainder = at.remainder;
    }
}

/// Some instances are removed, disabled or masked out; in a third of the scenes only one is left.
void Subject::draw_changed(const Transform& transform, bool planes, const mesh::Box& box, Random& random) {
  std::vector<Instance>& scene = scenes_[size_t(Placed::changed)];
  const uint32_t count = 2 + random.below(5), left = random.below(3) == 0 ? random.below(count) : count;
  ray_mask_ = random.below(2) ? 1u << random.below(32) : 0;
  committed_before_ = random.below(2) != 0;
  const double extent = std::max({std::abs(double(box.max[0])), std::abs(double(box.max[1])),
                                  std::abs(double(box.max[2])), std::abs(double(box.min[0]))});
  const double far[] = {0, extent, std::ldexp(extent, 20), std::ldexp(extent, 40)};
  const double away = far[random.below(4)];
  for (double& x : origin_) x = random.uniform(-1, 1) * away;
  for (uint32_t i = 0; i < count; ++i) {
    Instance one{Kind(random.below(planes ? kKinds : 1)),
                 i == 0 ? transform : mesh::compose(transform, beside(box, random))};
    const uint32_t beside_origin = random.below(3);
    for (size_t a = 0; a < 3; ++a) {
      one.origin[a] = origin_[a];
      if (beside_origin == 1) one.origin[a] += random.uniform(-1, 1) * extent * 1e-3;
      if (beside_origin == 2) one.origin[a] = std::nextafter(one.origin[a], 2 * extent);
    }
    if (random.below(3) == 0)
      one.state = random.below(2) ? Instance::State::disabled : Instance::State::removed;
    if (ray_mask_ && random.below(3) == 0) one.mask = random.below(2) ? ~ray_mask_ : 0;
    if (left < count) one.mask = 0xffffffffu;
    if (left < count && i == left) one.state = Instance::State::enabled;
    if (left < count && i != left && one.state == Instance::State::enabled)
      one.state = random.below(2) ? Instance::State::disabled : Instance::State::removed;
    one.met =
        one.state == Instance::State::enabled && (one.mask & (ray_mask_ ? ray_mask_ : 0xffffffffu)) != 0;
    scene.push_back(one);
  }
}

nifkit::Scene Subject::make_scene(const Way& way, const nifkit::Asset& asset, Placed placed) const {
  nifkit::Scene scene(way.device);
  const std::vector<Instance>& instances = this->instances(placed);
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t number = scene.add_instance(asset, uint32_t(instances[i].kind), instances[i].transform);
    if (number != i) throw std::runtime_error("another number than the next one");
    scene.set_instance_user(i, user_of(i));
  }
  if (placed == Placed::changed) {
    if (committed_before_) scene.commit();
    scene.set_origin(origin_);
    for (uint32_t i = 0; i < instances.size(); ++i) {
      const Instance& one = instances[i];
      if (one.state == Instance::State::removed) {
        scene.remove_instance(i);
        continue;
      }
      scene.set_instance_origin(i, one.origin);
      scene.set_instance_mask(i, one.mask);
      if (one.state == Instance::State::disabled) scene.set_instance_flags(i, NIF_INSTANCE_DISABLED);
    }
  }
  scene.commit();
  return scene;
}

nifkit::Asset Subject::load(const Way& way) const {
  const std::vector<std::byte>& bytes = way.coded ? coded_ : plain_;
  if (!way.mapped) return nifkit::Asset::load(way.device, bytes);
  static std::atomic<uint32_t> number{0};
  const auto file =
      std::filesystem::temp_directory_path() / fmt::format("nif-judge-{}-{}.nif", getpid(), number++);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  nifkit::Asset asset = nifkit::Asset::load(way.device, file.string(), NIF_LOAD_IN_PLACE);
  std::filesystem::remove(file);
  return asset;
}

Said Subject::ask(const Way& way, const nifkit::Asset& asset, Placed placed,
                  const std::vector<NifRay>& rays) const {
  const nifkit::Scene scene = make_scene(way, asset, placed);
  const uint32_t mask = placed == Placed::changed ? ray_mask_ : 0;
  return test::ask(scene, rays, std::span(&mask, mask ? 1 : 0), [&] { return way.most; });
}

void Subject::corners_of(uint32_t triangle, mesh::Float3 corners[3]) const {
  std::copy(triangles_.at(triangle).begin(), triangles_.at(triangle).end(), corners);
}

}  // namespace nif::test
