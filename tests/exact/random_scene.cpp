// Draws random scenes and their rays, and asks them on devices and plainly.
#include "tests/exact/random_scene.hpp"

#include <algorithm>
#include <cmath>

#include "formats/nif/writer.hpp"
#include "tests/exact/generators.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {
namespace {

constexpr uint32_t kMasks[] = {1, 2, 6, 0x80000000u, 0xffffffffu, 0xffffffffu, 0};
constexpr float kInfinity = std::numeric_limits<float>::infinity();

uint32_t draw_mask(Random& random) { return kMasks[random.below(std::size(kMasks))]; }

/// As often below a number as above its square.
float between_powers(Random& random, float low, float high) {
  return std::exp2(random.between(std::log2(low), std::log2(high)));
}

mesh::Box box_of(const format::ObjectView& object) {
  const kernels::ObjectBox box = kernels::object_box(format::field_of(object));
  mesh::Box rounded{};
  for (size_t a = 0; a < 3; ++a) {
    rounded.min[a] = float(box.low[a]);
    rounded.max[a] = float(box.high[a]);
  }
  return rounded;
}

/// A square across an axis: its box is as thin as boxes get.
format::TrianglesData flat(Random& random) {
  Soup soup;
  const uint32_t axis = random.below(3);
  for (uint32_t corner = 0; corner < 4; ++corner) {
    std::array<float, 3>& p = soup.positions.emplace_back();
    p[axis] = 0.5f;
    p[(axis + 1) % 3] = float(corner & 1);
    p[(axis + 2) % 3] = float(corner >> 1);
  }
  soup.triangles = {{0, 1, 2}, {1, 3, 2}};
  return RandomTree(soup).pack(random);
}

/// Turned, mirrored, stretched or sheared by the generators of hostile transforms. Its translation is any.
Matrix draw_linear(const mesh::Box& box, Random& random) {
  const auto generators = transform_generators();
  nif::Random drawn(random.below(0xffffffffu), 1, 3);
  for (;;) {
    const TransformGenerator& generator = generators[random.below(uint32_t(generators.size()))];
    if (std::string(generator.name) == "extreme scale" && random.below(64) != 0) continue;
    Matrix transform = generator.draw(box, drawn);
    if (random.below(8) == 0)  // flattened
      for (size_t k = 0, row = random.below(3), by = random.below(20); k < 3; ++k)
        transform[4 * row + k] = std::ldexp(transform[4 * row + k], -int(by));
    return transform;
  }
}

/// Scales by a power of two, so that the box has about this size, and moves its centre.
Matrix fit(Matrix transform, const mesh::Box& box, float size, const std::array<float, 3>& centre) {
  float longest = 0;
  for (size_t row = 0; row < 3; ++row) {
    float side = 0;
    for (size_t k = 0; k < 3; ++k) side += std::abs(transform[4 * row + k]) * (box.max[k] - box.min[k]);
    longest = std::max(longest, side);
  }
  const float scale = std::exp2(std::round(std::log2(size / longest)));
  if (std::isfinite(scale) && scale > 0)
    for (size_t k = 0; k < 12; ++k) transform[k] *= scale;
  for (size_t row = 0; row < 3; ++row) {
    double at = double(centre[row]);
    for (size_t k = 0; k < 3; ++k)
      at -= double(transform[4 * row + k]) * (double(box.min[k]) + double(box.max[k])) / 2;
    transform[4 * row + 3] = float(at);
  }
  return transform;
}

bool is_usable(const Matrix& transform) {
  kernels::WorldToObject inverse;
  bool good;
  return std::all_of(transform.begin(), transform.end(), [](float x) { return std::isfinite(x); }) &&
         kernels::invert(transform.data(), inverse, good);
}

}  // namespace

RandomScene::RandomScene(uint64_t seed, uint64_t number) {
  Random random(seed * 0x9e3779b97f4a7c15u + number);
  for (uint32_t count = 1 + random.below(3); files_.size() < count;) draw_file(random);
  place(random);
  if (random.below(3) == 0) place_beside_origin(random);
  if (random.below(2)) change(random);
  draw_rays(random);
  if (random.below(3) != 0) return;
  for (Instance& one : instances_) one.mask = draw_mask(random);
  const uint32_t each = random.below(3);
  masks_.resize(each == 0 ? 0 : each == 1 ? 1 : rays_.size());
  for (uint32_t& mask : masks_) mask = draw_mask(random);
}

void RandomScene::draw_file(Random& random) {
  RandomAssetOptions options{.objects = 1,
                             .instances = 0,
                             .max_voxels = random.below(4) ? 8u : 24u,
                             .bvhs = 1,
                             .sphericals = random.below(8) == 0,
                             .exacts = 1,
                             .proofs = 1,
                             .cutouts = 1,
                             .colors = random.below(3),
                             .sources = random.below(3),
                             .coded = random.below(2) ? kCodedAll : 0};
  options.proves_nothing = random.below(16) == 0;
  format::Asset asset = random_asset(random.below(0xffffffffu), options);
  for (const format::TrianglesData& bvh : {random_bvh(random, 60 + random.below(300)), flat(random)}) {
    asset.objects.push_back(test::object_of(bvh, "bvh"));
    asset.objects.back().triangles = bvh;
  }
  files_.push_back(std::make_unique<File>(format::encode(asset)));
}

void RandomScene::place(Random& random) {
  // Few rays of a batch meet the same one of very many instances, so kernels get rays of several objects.
  const auto count =
      random.below(16) == 0 ? 3000 + random.below(3000) : uint32_t(between_powers(random, 2, 1001));
  const std::string layouts[] = {"anywhere", "anywhere", "alike", "nested",
                                 "lattice",  "plane",    "apart", "own"};
  layout_ = layouts[random.below(std::size(layouts))];
  const float side = std::cbrt(float(count)) * between_powers(random, 0.2f, 4);
  const uint32_t in_row = std::max(1u, uint32_t(std::cbrt(float(count))));
  std::vector<Matrix> of_objects;
  for (const auto& file : files_)
    for (const format::ObjectView& object : file->view.objects)
      of_objects.push_back(draw_linear(box_of(object), random));
  while (instances_.size() < count) {
    const auto i = uint32_t(instances_.size());
    Instance one{};
    one.asset = random.below(uint32_t(files_.size()));
    one.object = random.below(uint32_t(files_[one.asset]->view.objects.size()));
    const mesh::Box box = box_of(object_of(one));
    std::array<float, 3> at{};
    for (float& x : at) x = random.between(-side, side);
    float size = 1;
    Matrix linear = draw_linear(box, random);
    if (layout_ == "alike") {
      at = {1, 2, 3};
      linear = of_objects[one.object];
    } else if (layout_ == "nested") {
      at = {1, 2, 3};
      size = std::ldexp(1.0f, -int(i % 16));
    } else if (layout_ == "lattice") {
      at = {float(i % in_row), float(i / in_row % in_row), float(i / in_row / in_row)};
      linear = kIdentity;
    } else if (layout_ == "plane") {
      at[2] = 0;
    } else if (layout_ == "apart") {
      at = {std::ldexp(1.0f, int(i % 20)), 0, float(i / 20)};
    }
    one.transform = layout_ == "own" ? linear : fit(linear, box, size, at);
    one.before = random.below(2) ? one.transform : random_transform(random, side);
    if (is_usable(one.transform)) instances_.push_back(one);
  }
}

/// Moves translations to origins in double precision, far away.
void RandomScene::place_beside_origin(Random& random) {
  const double away = std::ldexp(1.0, int(random.below(5)) * 10);
  for (double& x : origin_) x = double(random.between(-1.0f, 1.0f)) * away;
  for (Instance& one : instances_)
    for (size_t a = 0; a < 3; ++a) {
      one.origin[a] = origin_[a];
      if (random.below(2)) one.origin[a] += double(std::exchange(one.transform[4 * a + 3], 0.0f));
    }
}

void RandomScene::change(Random& random) {
  changed_ = true;
  const bool few_stay = random.below(8) == 0;
  for (Instance& one : instances_) {
    if (random.below(few_stay ? 20 : 4) != 0 && !few_stay) continue;
    one.state = random.below(2) ? Instance::State::disabled : Instance::State::removed;
  }
  if (few_stay) instances_[random.below(uint32_t(instances_.size()))].state = Instance::State::enabled;
}

void RandomScene::draw_rays(Random& random) {
  constexpr size_t kCounts[] = {100, 1000, 3000, 6000};
  const size_t count = kCounts[random.below(std::size(kCounts))];
  std::vector<kernels::WorldBox> boxes;
  float reach = 1;
  for (const Instance& one : instances_) {
    const LongMatrix at = placed(one);
    boxes.push_back(kernels::world_box(kernels::object_box(format::field_of(object_of(one))),
                                       at.matrix.data(), at.remainder.data()));
    for (size_t a = 0; a < 3; ++a) reach = std::max(reach, std::min(std::abs(boxes.back().max[a]), 1e4f));
  }
  const auto within = [&](const kernels::WorldBox& box, size_t a) {
    return box.min[a] + (box.max[a] - box.min[a]) * random.unit();
  };
  const auto any = [&] { return random.below(uint32_t(instances_.size())); };
  while (rays_.size() < count) {
    const Instance& one = instances_[any()];
    const kernels::WorldBox& box = boxes[size_t(&one - instances_.data())];
    const size_t run = std::min<size_t>(1 + random.below(64), count - rays_.size());
    const uint32_t kind = random.below(6);
    NifRay ray{{}, 0, {}, kInfinity};
    if (kind == 0) {
      const std::vector<NifRay> more = rays_in_cube(random, reach * 1.2f, run);
      rays_.insert(rays_.end(), more.begin(), more.end());
    } else if (kind == 1) {
      // A view of an instance, from inside of another or from anywhere.
      const kernels::WorldBox& eye = boxes[any()];
      const bool inside = random.below(2);
      for (size_t a = 0; a < 3; ++a) {
        ray.origin[a] = inside ? within(eye, a) : random.between(-reach, reach) * 1.5f;
        ray.direction[a] = within(box, a) - ray.origin[a];
      }
      const float spread = between_powers(random, 1e-4f, 1);
      for (size_t k = 0; k < run; ++k) {
        rays_.push_back(ray);
        for (float& x : rays_.back().direction) x += random.between(-spread, spread) * (std::abs(x) + 1e-3f);
      }
    } else {
      for (size_t k = 0; k < run; ++k) {
        if (kind <= 3) {  // what is hard for the object
          ray = to_world(to_ray(random_segment(random, object_of(one))), placed(one).matrix);
        } else if (kind == 4) {  // along planes of the box, or from one to another
          const auto axis = random.below(3);
          for (size_t a = 0; a < 3; ++a) {
            const uint32_t where = random.below(3);
            ray.origin[a] = where == 0 ? box.min[a] : where == 1 ? box.max[a] : within(box, a);
            ray.direction[a] = a == axis ? (random.below(2) ? 1.0f : -1.0f) : random.below(2) ? 0.0f : -0.0f;
            if (random.below(8) == 0) ray.direction[a] = random.between(-1.0f, 1.0f);
          }
          ray.tmin = random.below(3) ? 0 : -kInfinity;
          ray.tmax = random.below(3) ? kInfinity : box.max[axis] - box.min[axis];
        } else {  // short, from inside
          for (size_t a = 0; a < 3; ++a) {
            ray.origin[a] = within(box, a);
            ray.direction[a] = (box.max[a] - box.min[a]) * random.between(-1.0f, 1.0f);
          }
          ray.tmin = random.below(2) ? 0 : between_powers(random, 1e-6f, 1);
          ray.tmax = ray.tmin + between_powers(random, 1e-6f, 4);
        }
        rays_.push_back(ray);
      }
    }
  }
}

PlainScene RandomScene::plain() const {
  PlainScene plain;
  for (uint32_t i = 0; i < instances_.size(); ++i) {
    const Instance& one = instances_[i];
    const format::AssetView& file = files_[one.asset]->view;
    const LongMatrix at = placed(one);
    plain.add({.field = format::field_of(object_of(one)),
               .transform = at.matrix,
               .remainder = at.remainder,
               .mask = one.mask,
               .awake = one.state == Instance::State::enabled,
               .proven = object_of(one).proven,
               .object = one.object,
               .user = user_of(i),
               .details = format::hit_details(file, one.object)});
  }
  return plain;
}

Said RandomScene::expected() const {
  const PlainScene scene = plain();
  Said said(rays_.size());
  for (size_t i = 0; i < rays_.size(); ++i) {
    const uint32_t mask = masks_.empty() ? 0xffffffffu : masks_[masks_.size() == 1 ? 0 : i];
    const PlainScene::Asked asked = scene.meet(rays_[i], mask);
    const PlainScene::Visibility found = scene.visibility(asked);
    said.visible[i] = found.logit >= 0;
    said.certain[i] = found.certain;
    said.logit[i] = found.logit;
    const PlainScene::Open open = scene.open(asked);
    if (open.listed) {
      said.listed[i] = 1;
      said.open[i] = open.instance;
      said.begin[i] = open.begin;
      said.end[i] = open.end;
    }
    scene.write_hit(asked, said.hits, i);
  }
  return said;
}

Said RandomScene::ask(const nifkit::Device& device, const std::function<uint64_t()>& next_call) const {
  std::vector<nifkit::Asset> assets;
  for (const auto& file : files_) assets.push_back(nifkit::Asset::load(device, file->bytes));
  nifkit::Scene scene(device);
  for (uint32_t i = 0; i < instances_.size(); ++i) {
    const Instance& one = instances_[i];
    const uint32_t number =
        scene.add_instance(assets[one.asset], one.object, changed_ ? one.before : one.transform);
    if (number != i) throw std::runtime_error("another number than the next one");
    scene.set_instance_user(i, user_of(i));
  }
  if (changed_) scene.commit();
  for (uint32_t i = 0; i < instances_.size(); ++i) {
    const Instance& one = instances_[i];
    if (one.state == Instance::State::removed) {
      scene.remove_instance(i);
      continue;
    }
    if (changed_) scene.set_instance_transform(i, one.transform);
    if (one.origin != std::array<double, 3>{}) scene.set_instance_origin(i, one.origin);
    if (one.mask != 0xffffffffu) scene.set_instance_mask(i, one.mask);
    if (one.state == Instance::State::disabled) scene.set_instance_flags(i, NIF_INSTANCE_DISABLED);
  }
  scene.set_origin(origin_);
  scene.commit();
  return test::ask(scene, rays_, masks_, next_call);
}

}  // namespace nif::test
