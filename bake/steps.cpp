// Describes objects, measures them, and checks the requested error. Objects share the rays of an evaluation,
// but each gets enough for useful figures. BakeClock combines all progress into one number.
#include "bake/steps.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "formats/base/status.hpp"
#include "formats/nif/writer.hpp"

namespace nif::bake {

format::Object describe(const Prepared& prepared, ObjectReport& report) {
  format::Object object;
  object.name = format::clean_name(prepared.source->name);
  object.aabb_min = prepared.box.min;
  object.aabb_max = prepared.box.max;
  object.bias = prepared.bias;
  object.triangle_count = uint32_t(std::min<uint64_t>(prepared.surface.triangles.size(), 0xffffffffu));
  report.name = object.name;
  report.triangles = prepared.surface.triangles.size();
  report.cleaned = prepared.surface.report;
  report.closed_components = prepared.closed.count();
  report.open_components = prepared.closed.open_components;
  report.turned = prepared.closed.turned;
  return object;
}

std::vector<format::Instance> instances_of(const mesh::Scene& scene, const PreparedScene& prepared) {
  std::vector<format::Instance> instances;
  for (const uint32_t i : prepared.instances) {
    const mesh::Instance& instance = scene.instances[i];
    instances.push_back({format::clean_name(instance.name), prepared.object_of[instance.mesh],
                         instance.transform, to_float(instance.remainder)});
  }
  return instances;
}

SetAccuracies measure_sets(const RaySource& source, const Answerer& answer, const BakeOptions& options,
                           size_t objects, const std::function<void(RaySet)>& begin) {
  SetAccuracies sets{};
  if (options.evaluation_rays == 0) return sets;
  const uint64_t share = std::max<uint64_t>(20'000, options.evaluation_rays / objects);
  const size_t count = size_t(std::min(share, options.evaluation_rays));
  for (RaySet set : kRaySets) {
    begin(set);
    sets[size_t(set)] =
        evaluate(make_ray_set(source, set, count, options.seed + kMeasuringSeed), answer, source.oracle);
  }
  return sets;
}

SetHits measure_hits(const RaySource& source, const kernels::AnyField& field, double diagonal,
                     const BakeOptions& options, size_t objects, const std::function<void(RaySet)>& begin) {
  SetHits sets;
  if (options.evaluation_rays == 0) return sets;
  constexpr uint64_t kLeast = 1000;  // for one object of many
  const uint64_t all = std::max<uint64_t>(1, options.evaluation_rays / 10);
  const size_t count = size_t(std::min(std::max(kLeast, all / objects), all));
  const auto* proof = std::get_if<kernels::PlanesField>(&field);
  const ObjectScale scale{diagonal, proof && !kernels::has_planes(*proof) ? 0 : voxels_per_unit(field)};
  for (const RaySet set : kHitSets) {
    begin(set);
    const LabelledRays rays = make_ray_set(source, set, count, options.seed + kMeasuringSeed);
    sets[size_t(set)] = evaluate_hits(rays.segments, reference_finder(field), source.oracle, scale);
  }
  return sets;
}

ErrorBound error_bound(const SetAccuracies& sets) {
  ErrorBound worst;
  for (RaySet set : kRaySets) {
    const double bound = sets[size_t(set)].error_bound();
    if (bound > worst.bound) worst = {bound, sets[size_t(set)].error(), set};
  }
  return worst;
}

void check_error(const BakeOptions& options, const SetAccuracies& sets) {
  if (!options.max_error) return;
  const ErrorBound worst = error_bound(sets);
  if (worst.bound <= *options.max_error) return;
  throw TargetNotMet(
      TargetNotMet::Limit::error,
      fmt::format("{:.4f}% of {} are answered wrongly, below {:.4f}% with 99% confidence; the limit is "
                  "{:.4f}%",
                  worst.error * 100, name_of(worst.set), worst.bound * 100, *options.max_error * 100));
}

BakeClock::BakeClock(std::span<const Prepared> objects, const BakeCallback& callback) : callback_(callback) {
  for (const Prepared& object : objects)
    weights_.push_back(std::clamp(double(object.surface.triangles.size()), 10e3, kFullTriangles));
}

void BakeClock::report(BakeProgress::Stage stage, std::string_view name, size_t index, double share,
                       double loss, double error) const {
  if (!callback_) return;
  double done = 0, all = 0;
  for (size_t i = 0; i < weights_.size(); ++i) {
    done += i < index ? weights_[i] : i == index ? weights_[i] * share : 0;
    all += weights_[i];
  }
  const double fraction = stage == BakeProgress::Stage::preparing || all == 0 ? 0 : done / all;
  callback_({stage, name, index, std::max<size_t>(weights_.size(), 1), fraction, loss, error});
}

void stop_if(const std::atomic<bool>& cancel) {
  if (cancel) throw Error(Status::interrupted, "the bake was cancelled");
}

}  // namespace nif::bake
