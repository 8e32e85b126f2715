// Answers a scene as the simplest program would: no hierarchy, no batches, no early end. Every ray is tested
// against every instance, by the reference.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <stdexcept>
#include <variant>
#include <vector>

#include "kernels/reference/hit_details.hpp"
#include "kernels/reference/planes/open.hpp"
#include "kernels/reference/reference_encodings.hpp"
#include "kernels/reference/scene_field.hpp"
#include "kernels/reference/scene_hit.hpp"
#include "kernels/reference/scene_query.hpp"
#include "tests/support/query_answers.hpp"
#include "tests/support/test_first_hits.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/to_world.hpp"

namespace nif::test {

/// An instance as a scene's caller sets it.
struct PlainInstance {
  kernels::AnyField field;
  Matrix transform = kIdentity;
  std::array<float, 3> remainder{};  ///< of the translation
  uint32_t mask = 0xffffffffu;
  bool awake = true;   ///< neither removed nor disabled
  bool proven = true;  ///< its file proves something
  uint32_t object = 0;
  uint64_t user = 0;
  kernels::HitDetails details{};
};

class PlainScene {
 public:
  void add(const kernels::AnyField& field, const Matrix& transform) {
    add({.field = field, .transform = transform});
  }
  void add(const PlainInstance& instance) {
    instances_.push_back({instance});
    place(instances_.back());
    awake_ += instances_.back().meetable();
    unproven_ = unproven_ || (instances_.back().meetable() && !instance.proven);
  }
  void set_transform(size_t instance, const Matrix& transform) {
    instances_[instance].transform = transform;
    place(instances_[instance]);
  }

  /// A ray, and the instances that are asked about it.
  struct Asked {
    struct Met {
      uint32_t number;
      kernels::Segment local;
      float enter;   ///< where the ray enters the box
      bool certain;  ///< what is certain in object space is so in the world
    };
    kernels::Segment ray;
    bool valid;   ///< several instances see only valid rays
    bool misses;  ///< if nothing is met, that is certain
    std::vector<Met> met;
  };
  Asked meet(const NifRay& from, uint32_t mask = 0xffffffffu) const {
    Asked asked{.ray = to_segment(from), .valid = false, .misses = false, .met = {}};
    kernels::BoxRay prepared;
    asked.valid = kernels::prepare_box_ray(asked.ray, prepared);
    asked.misses = (asked.valid || asked.ray.tmin > asked.ray.tmax) && !unproven_;
    for (uint32_t number = 0; number < instances_.size(); ++number) {
      const Placed& placed = instances_[number];
      if (!placed.awake || !(placed.mask & mask)) continue;
      if (!sole() && !asked.valid) continue;
      const kernels::BoxPassage passage = kernels::pass_box(placed.box, asked.ray, prepared);
      if (!sole() && !(passage.enter <= passage.leave)) continue;
      const kernels::Segment local =
          placed.placed.identity ? asked.ray : kernels::to_object(placed.placed.to_object, asked.ray);
      asked.met.push_back({number, local, passage.enter,
                           kernels::stays_certain(placed.placed, placed.reach_scale, asked.ray, local)});
    }
    return asked;
  }

  struct Visibility {
    int32_t logit;
    bool certain;
    float probability;
  };
  Visibility visibility(const Asked& asked) const {
    kernels::CombinedAnswer combined = nothing_asked();
    for (const Asked::Met& met : asked.met) {
      const Placed& placed = instances_[met.number];
      const kernels::Answer answer = kernels::query(placed.field, met.local);
      combined.add(answer.logit, answer.certain && met.certain, kernels::calibration(placed.field), true);
    }
    return {combined.logit(), asked.met.empty() ? asked.misses : combined.certain(), combined.probability()};
  }

  struct Open {
    bool listed;
    float begin, end;
    uint32_t instance;  ///< the only one that leaves the ray open, or none
  };
  Open open(const Asked& asked) const {
    kernels::CombinedAnswer combined = nothing_asked();
    Open open{false, std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
              kernels::kNoInstance};
    if (unproven_) open.begin = asked.ray.tmin, open.end = asked.ray.tmax;
    for (const Asked::Met& met : asked.met) {
      kernels::OpenInterval part;
      const kernels::Answer answer = prove_one(instances_[met.number].field, met.local, part);
      const bool certain = answer.certain && met.certain;
      if (!met.certain) part = {asked.ray.tmin, asked.ray.tmax};
      combined.add(answer.logit, certain, {}, false);
      if (certain) continue;
      open.instance = open.begin <= open.end ? kernels::kNoInstance : met.number;
      open.begin = sole() ? part.begin : std::min(open.begin, part.begin) + 0.0f;
      open.end = sole() ? part.end : std::max(open.end, part.end) + 0.0f;
    }
    if (sole()) open.instance = sole_number();
    const bool certain = asked.met.empty() ? asked.misses : combined.certain();
    open.listed = !certain && (combined.logit() < 0 || asked.valid);
    return open;
  }

  kernels::SceneHit first_hit(const Asked& asked) const {
    kernels::SceneHit nearest;
    if (sole() && !asked.met.empty()) {
      const Asked::Met& met = asked.met[0];
      static_cast<kernels::Hit&>(nearest) = kernels::intersect(instances_[met.number].field, met.local);
      if (!met.certain) kernels::forget_proof(nearest);
      if (nearest.t < kernels::kNoHit) nearest.instance = met.number;
      return nearest;
    }
    if (!asked.misses) kernels::forget_proof(nearest);
    for (const Asked::Met& met : asked.met) {
      kernels::Hit hit = kernels::intersect(instances_[met.number].field, met.local);
      if (!met.certain) kernels::forget_proof(hit);
      kernels::begin_in_box(hit, met.enter);
      nearest.add(hit, met.number);
    }
    return nearest;
  }

  Answers ask(const std::vector<NifRay>& rays) const {
    Answers answers(rays.size());
    std::fill(answers.bits.begin(), answers.bits.end(), uint8_t(0));
    for (size_t i = 0; i < rays.size(); ++i) {
      const Visibility found = visibility(meet(rays[i]));
      answers.visible[i] = found.logit >= 0;
      answers.bits[i / 8] = uint8_t(answers.bits[i / 8] | answers.visible[i] << (i % 8));
      answers.certain[i] = found.certain;
      answers.probability[i] = found.probability;
      answers.logit[i] = found.logit;
    }
    return answers;
  }

  /// Writes the first hit of a ray as ray `i` of `hits`.
  void write_hit(const Asked& asked, FirstHits& hits, size_t i) const {
    kernels::SceneHit hit = first_hit(asked);
    hits.hit[i] = hit.t < kernels::kNoHit;
    hits.certain[i] = hit.certain();
    hits.t[i] = hit.t, hits.low[i] = hit.low, hits.high[i] = hit.high;
    hits.u[i] = hit.u, hits.v[i] = hit.v;
    hits.instance[i] = hit.instance;
    hits.object[i] = hits.triangle[i] = NIF_NONE;
    hits.user[i] = 0;
    float color[3]{};
    if (hit.instance != kernels::kNoInstance) {
      const Placed& placed = instances_[hit.instance];
      const auto met = std::find_if(asked.met.begin(), asked.met.end(),
                                    [&](const Asked::Met& one) { return one.number == hit.instance; });
      const float normal[3] = {hit.normal[0], hit.normal[1], hit.normal[2]};
      kernels::world_normal(placed.placed.identity ? nullptr : &placed.placed.to_object, normal,
                            asked.ray.direction, hit.normal);
      hits.object[i] = placed.object;
      hits.triangle[i] = kernels::source_triangle(placed.details.source_triangles, hit.triangle);
      hits.user[i] = placed.user;
      kernels::color_at(placed.details.colors, met->local, hit.t, color);
    }
    std::copy_n(hit.normal, 3, &hits.normal[3 * i]);
    std::copy_n(color, 3, &hits.color[3 * i]);
  }

 private:
  struct Placed : PlainInstance {
    bool meetable() const { return awake && mask != 0; }
    kernels::PlacedInstance placed{};
    kernels::WorldBox box{};
    float reach_scale = 0;
  };

  static void place(Placed& one) {
    bool good;
    if (!kernels::invert(one.transform.data(), one.placed.to_object, good, one.remainder.data()))
      throw std::invalid_argument("the transform has no inverse");
    one.placed.well_conditioned = good;
    one.placed.identity = one.transform == kIdentity && one.remainder == std::array<float, 3>{};
    one.placed.unproven = !one.proven;
    one.box = kernels::world_box(kernels::object_box(one.field), one.transform.data(), one.remainder.data());
    one.reach_scale = kernels::reach_scale(one.field);
  }

  static kernels::Answer prove_one(const kernels::AnyField& any, const kernels::Segment& segment,
                                   kernels::OpenInterval& open) {
    return std::visit(
        [&](const auto& field) {
          if constexpr (std::derived_from<std::remove_cvref_t<decltype(field)>, kernels::PlanesField>)
            return kernels::prove(field, segment, open);
          open = kernels::all_of(segment);
          return kernels::query(field, segment);
        },
        any);
  }

  kernels::CombinedAnswer nothing_asked() const {
    kernels::CombinedAnswer combined;
    if (unproven_ && !sole()) combined.add(kernels::kCertainLogit, false, {}, false);
    return combined;
  }

  /// A sole instance is asked about every ray.
  bool sole() const { return awake_ == 1; }
  uint32_t sole_number() const {
    const auto at = std::find_if(instances_.begin(), instances_.end(),
                                 [](const Placed& placed) { return placed.meetable(); });
    return uint32_t(at - instances_.begin());
  }

  std::vector<Placed> instances_;
  uint32_t awake_ = 0;
  bool unproven_ = false;
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
