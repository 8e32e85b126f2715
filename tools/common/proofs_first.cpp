// nifQueryOpen answers what is proven and lists the other rays, each with the interval of t that stays open.
// Embree traces only these intervals.
#include "tools/common/proofs_first.hpp"

#include "tools/common/runtime_handles.hpp"
#include "tools/common/segment_query.hpp"

namespace nif::tools {

size_t ProofsFirst::ask(NifScene scene, const NifRays& rays, NifAnswers answers,
                        std::span<const kernels::Segment> segments, const bake::EmbreeScene& embree,
                        bake::EmbreeCall call) {
  rays_.resize(rays.count);
  tmin_.resize(rays.count);
  tmax_.resize(rays.count);
  uint32_t count = 0;
  auto open = nifkit::sized<NifOpenRays>();
  open.capacity = rays.count;
  open.rays = rays_.data();
  open.tmin = tmin_.data();
  open.tmax = tmax_.data();
  open.count = &count;
  check(nifQueryOpen(scene, &rays, &answers, &open));
  bake::ask_parts(embree, call, segments, std::span(rays_).first(count), tmin_.data(), tmax_.data(),
                  answers.visible);
  return count;
}

bake::Answerer proofs_first_answerer(NifScene scene, const bake::EmbreeScene& embree) {
  return [scene, &embree](std::span<const kernels::Segment> segments, const bake::Answers& answers) {
    auto proven = nifkit::sized<NifAnswers>();
    proven.visible = answers.visible;
    proven.certain = answers.certain;
    ProofsFirst().ask(scene, rays_of(segments), proven, segments, embree, bake::EmbreeCall::occluded1);
    for (size_t i = 0; i < segments.size(); ++i) answers.probability[i] = answers.visible[i];
  };
}

}  // namespace nif::tools
