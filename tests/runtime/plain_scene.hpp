// Answers a scene as the simplest program would: every ray is tested against every instance, by the
// reference.
#pragma once

#include "kernels/reference/instance.hpp"
#include "kernels/reference/scene_query.hpp"
#include "tests/runtime/runtime_fixture.hpp"

namespace nif::test {

using Matrix = std::array<float, 12>;

class PlainScene {
 public:
  void add(const kernels::SegmentField& field, const Matrix& transform) {
    instances_.push_back({field, transform});
  }
  void set_transform(size_t instance, const Matrix& transform) { instances_[instance].transform = transform; }

  Answers ask(const std::vector<NifRay>& rays) const {
    Answers answers(rays.size());
    std::fill(answers.bits.begin(), answers.bits.end(), uint8_t(0));
    for (size_t i = 0; i < rays.size(); ++i) {
      const kernels::Segment ray = to_segment(rays[i]);
      kernels::BoxRay box_ray;
      const bool askable = kernels::prepare_box_ray(ray, box_ray);
      kernels::CombinedAnswer combined;
      if (askable || instances_.size() == 1)
        for (const Placed& placed : instances_) ask_instance(placed, ray, box_ray, combined);
      answers.visible[i] = combined.logit() >= 0;
      answers.bits[i / 8] = uint8_t(answers.bits[i / 8] | answers.visible[i] << (i % 8));
      answers.certain[i] = combined.certain() && (askable || instances_.size() == 1 || ray.tmin > ray.tmax);
      answers.probability[i] = combined.probability();
      answers.logit[i] = combined.logit();
    }
    return answers;
  }

 private:
  struct Placed {
    kernels::SegmentField field;
    Matrix transform;
  };

  void ask_instance(const Placed& placed, const kernels::Segment& ray, const kernels::BoxRay& box_ray,
                    kernels::CombinedAnswer& combined) const {
    const float* transform = placed.transform.data();
    const auto box = kernels::world_box(kernels::object_box(placed.field), transform);
    if (instances_.size() > 1 && !kernels::may_meet(box, ray, box_ray)) return;
    kernels::WorldToObject to_object;
    bool good;
    ASSERT_TRUE(kernels::invert(transform, to_object, good));
    const bool identity = placed.transform == kIdentity;
    const kernels::Segment local = identity ? ray : kernels::to_object(to_object, ray);
    const kernels::Answer answer = kernels::query(placed.field, local);
    const bool certain =
        answer.certain &&
        (identity || ray.tmin > ray.tmax ||
         (good && kernels::stays_certain(to_object, kernels::reach_scale(placed.field), ray, local)));
    combined.add(answer.logit, certain, placed.field.network.calibration, true);
  }

  std::vector<Placed> instances_;
};

/// Any transform: near the origin or far, rotated, sheared, mirrored, stretched.
inline Matrix random_transform(Random& random, float spread) {
  Matrix transform;
  for (;;) {
    for (size_t k = 0; k < 12; ++k)
      transform[k] = k % 4 == 3 ? random.between(-spread, spread) : random.between(-1.0f, 1.0f);
    const float size = std::exp2(random.between(-2.0f, 2.0f));
    for (size_t k = 0; k < 12; ++k)
      if (k % 4 != 3) transform[k] *= size;
    if (random.below(16) == 0) std::copy_n(kIdentity.begin(), 12, transform.begin());
    kernels::WorldToObject inverse;
    bool good;
    if (kernels::invert(transform.data(), inverse, good)) return transform;
  }
}

/// Long and short rays all over a cube, some along axes, some invalid.
inline std::vector<NifRay> rays_in_cube(Random& random, float side, size_t count) {
  std::vector<NifRay> rays(count);
  for (NifRay& ray : rays) {
    for (size_t a = 0; a < 3; ++a) {
      ray.origin[a] = random.between(-side, side);
      ray.direction[a] = random.between(-1.0f, 1.0f);
    }
    if (random.below(8) == 0) ray.direction[random.below(3)] = 0;
    if (random.below(8) == 0) ray.direction[random.below(3)] = -0.0f;
    if (random.below(8) == 0) ray.origin[random.below(3)] *= 1e6f;
    ray.tmin = random.below(2) ? 0 : -std::numeric_limits<float>::infinity();
    ray.tmax = random.below(2) ? random.unit() * side : std::numeric_limits<float>::infinity();
    if (random.below(64) == 0) ray.direction[0] = std::numeric_limits<float>::quiet_NaN();
    if (random.below(64) == 0) ray.origin[1] = std::numeric_limits<float>::infinity();
    if (random.below(64) == 0) ray.tmax = -1, ray.tmin = 1;
    if (random.below(64) == 0) ray.tmax = std::numeric_limits<float>::quiet_NaN();
  }
  return rays;
}

}  // namespace nif::test
