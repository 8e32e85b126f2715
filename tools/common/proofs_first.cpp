// nifQueryOpen answers what is proven and lists the other rays, each with the interval of t that stays open.
// Embree traces only these intervals.
#include "tools/common/proofs_first.hpp"

#include "tools/common/runtime_handles.hpp"
#include "tools/common/segment_query.hpp"

namespace nif::tools {

size_t ProofsFirst::ask(NifScene scene, NifQuery query, std::span<const kernels::Segment> segments,
                        const bake::EmbreeScene& embree, bake::EmbreeCall call, uint8_t* visible) {
  rays_.resize(query.count);
  tmin_.resize(query.count);
  tmax_.resize(query.count);
  uint32_t count = 0;
  NifOpenRays open{};
  open.struct_size = sizeof(open);
  open.capacity = query.count;
  open.rays = rays_.data();
  open.tmin = tmin_.data();
  open.tmax = tmax_.data();
  open.count = &count;
  query.visible = visible;
  check(nifQueryOpen(scene, &query, &open));
  bake::ask_parts(embree, call, segments, std::span(rays_).first(count), tmin_.data(), tmax_.data(), visible);
  return count;
}

bake::Answerer proofs_first_answerer(NifScene scene, const bake::EmbreeScene& embree) {
  return [scene, &embree](std::span<const kernels::Segment> segments, const bake::Answers& answers) {
    NifQuery query = query_of(segments);
    query.certain = answers.certain;
    ProofsFirst().ask(scene, query, segments, embree, bake::EmbreeCall::occluded1, answers.visible);
    for (size_t i = 0; i < segments.size(); ++i) answers.probability[i] = answers.visible[i];
  };
}

}  // namespace nif::tools
