// Answers queries. In GPU memory, a query only puts launches into the caller's stream. In host memory, it
// goes through staging memory, chunk by chunk, and waits for the answers.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

#include "device.hpp"
#include "query/nif_rays.hpp"
#include "query/outputs.hpp"

namespace nif::gpu {
namespace {

using kernels::gpu::SceneQuery;
using runtime::GpuMeasure;
using runtime::kMeasuredStages;
using runtime::OutputArray;
using runtime::visit_outputs;

void check_rays(Context& context, const NifRays& rays) {
  const auto check = [&](const void* array, const char* name) {
    check_array(context, rays.memory, array, std::string("rays: ") + name);
  };
  for (const float* array : rays.origin) check(array, "origin");
  for (const float* array : rays.direction) check(array, "direction");
  check(rays.tmin, "tmin");
  check(rays.tmax, "tmax");
  check(rays.mask, "mask");
  check_stream(context, rays.stream, "rays");
}

void check_answers(Context& context, const NifRays& rays, const NifAnswers& answers) {
  visit_outputs(
      [&](const OutputArray& about, const auto* array) {
        check_array(context, rays.memory, array, std::string("answers: ") + about.name);
      },
      answers);
}

void check_open(Context& context, const NifRays& rays, const NifOpenRays& open) {
  const auto check = [&](const void* array, const char* name) {
    check_array(context, rays.memory, array, std::string("open: ") + name);
  };
  check(open.count, "count");
  if (open.capacity == 0) return;  // the lists are not used
  check(open.rays, "rays");
  check(open.tmin, "tmin");
  check(open.tmax, "tmax");
  check(open.instance, "instance");
}

void check_hits(Context& context, const NifRays& rays, const NifHits& hits) {
  runtime::visit_hit_outputs(
      [&](const OutputArray& about, const auto* array) {
        check_array(context, rays.memory, array, std::string("hits: ") + about.name);
      },
      hits);
}

[[noreturn]] void refuse_scene() {
  throw GpuError(NIF_ERROR_INVALID_OPERATION, "the scene is not on the GPU, because its commit failed");
}

template <class T>
auto* bytes_of(T* array) {
  return reinterpret_cast<std::conditional_t<std::is_const_v<T>, const unsigned char, unsigned char>*>(array);
}

SceneQuery scene_query(const NifRays& query, const NifAnswers& answers) {
  SceneQuery result{};
  for (int a = 0; a < 3; ++a) {
    result.origin[a] = bytes_of(query.origin[a]);
    result.direction[a] = bytes_of(query.direction[a]);
  }
  result.tmin = bytes_of(query.tmin);
  result.tmax = bytes_of(query.tmax);
  result.origin_stride = query.origin_stride;
  result.direction_stride = query.direction_stride;
  result.tmin_stride = query.tmin_stride;
  result.tmax_stride = query.tmax_stride;
  result.mask = bytes_of(query.mask);
  result.mask_stride = query.mask_stride;
  // The layout that kernels read (load_ray() of kernels/gpu/scene_arrays.hpp).
  static_assert(sizeof(NifRay) == 32 && offsetof(NifRay, tmin) == 12 && offsetof(NifRay, direction) == 16 &&
                offsetof(NifRay, tmax) == 28);
  result.whole_rays = runtime::are_nif_rays(query) && reinterpret_cast<uintptr_t>(query.origin[0]) % 16 == 0;
  visit_outputs([](const OutputArray&, unsigned char*& to, auto* from) { to = bytes_of(from); }, result,
                answers);
  return result;
}

/// Records in the stream that the scene is in use up to this point.
void record_use(GpuDevice& device, GpuScene& scene, Stream stream) {
  Context& context = *device.context;
  const std::lock_guard lock(scene.mutex);
  for (Event& event : scene.events)
    if (context.is_done(event)) return context.record(event, stream);
  scene.events.reserve(scene.events.size() + 1);
  const Event event = context.make_event(false);
  scene.events.push_back(event);
  context.record(event, stream);
}

/// Puts launches into the stream, and records that the scene is in use until they are done.
template <class Launches>
void put_noted(GpuDevice& device, GpuScene& scene, Stream stream, const Launches& launches) {
  try {
    launches();
    record_use(device, scene, stream);
  } catch (...) {
    // Some launches may be running, and nothing else would wait for them.
    try {
      device.context->wait_stream(stream);
    } catch (const GpuError&) {
    }
    throw;
  }
}

template <class T>
T value_at(const T* array, uint64_t stride, uint64_t i) {
  T value;
  // Computed as an integer: a stride may be negative, in two's complement.
  const uintptr_t from = reinterpret_cast<uintptr_t>(array) + uintptr_t(i * stride);
  std::memcpy(&value, reinterpret_cast<const char*>(from), sizeof(value));
  return value;
}

void read_rays(const NifRays& query, uint64_t first, uint64_t count, unsigned char* to) {
  if (runtime::are_nif_rays(query)) {
    std::memcpy(to, bytes_of(query.origin[0]) + first * sizeof(NifRay), count * sizeof(NifRay));
    return;
  }
  for (uint64_t k = 0; k < count; ++k) {
    const uint64_t i = first + k;
    NifRay ray;
    for (int a = 0; a < 3; ++a) {
      ray.origin[a] = value_at(query.origin[a], query.origin_stride, i);
      ray.direction[a] = value_at(query.direction[a], query.direction_stride, i);
    }
    ray.tmin = query.tmin ? value_at(query.tmin, query.tmin_stride, i) : 0;
    ray.tmax =
        query.tmax ? value_at(query.tmax, query.tmax_stride, i) : std::numeric_limits<float>::infinity();
    std::memcpy(to + k * sizeof(ray), &ray, sizeof(ray));
  }
}

/// Returns how many bytes the masks take: one for each ray, or one for all.
size_t read_masks(const NifRays& query, uint64_t first, uint64_t count, unsigned char* to) {
  const uint64_t stride = query.mask_stride, bytes = (stride == 0 ? 1 : count) * sizeof(uint32_t);
  if (stride == sizeof(uint32_t)) {
    std::memcpy(to, bytes_of(query.mask) + first * stride, bytes);
    return bytes;
  }
  for (uint64_t at = 0; at < bytes; at += sizeof(uint32_t), ++first) {
    const uint32_t mask = value_at(query.mask, stride, first);
    std::memcpy(to + at, &mask, sizeof(mask));
  }
  return bytes;
}

/// Borrows staging memory for its lifetime.
class BorrowedStaging {
 public:
  explicit BorrowedStaging(GpuDevice& device) : device_(device) {
    {
      const std::lock_guard lock(device.mutex);
      if (!device.stagings.empty()) {
        staging_ = std::move(device.stagings.back());
        device.stagings.pop_back();
      }
    }
    if (!staging_) staging_ = std::make_unique<Staging>(*device.context);
  }
  ~BorrowedStaging() {
    const std::lock_guard lock(device_.mutex);
    try {
      device_.stagings.push_back(std::move(staging_));
    } catch (...) {  // the staging memory is freed instead
    }
  }
  const Staging& operator*() const { return *staging_; }

 private:
  GpuDevice& device_;
  std::unique_ptr<Staging> staging_;
};

/// Makes a stream, and frees it at the end.
class OwnStream {
 public:
  explicit OwnStream(Context& context) : context_(context), stream_(context.make_stream()) {}
  ~OwnStream() { context_.free_stream(stream_); }
  OwnStream(const OwnStream&) = delete;
  OwnStream& operator=(const OwnStream&) = delete;
  Stream get() const { return stream_; }

 private:
  Context& context_;
  Stream stream_;
};

/// Answers a query in host memory, chunk by chunk, with two buffers in turn: while the GPU works on one
/// chunk, the rays of the next are gathered and copied.
class HostQuery {
 public:
  HostQuery(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers)
      : device_(device), context_(*device.context), scene_(scene), rays_(rays), answers_(answers) {
    size_t at = Staging::kInputBytes;
    visit_outputs(
        [&](const OutputArray& about, auto* to) {
          if (to) outputs_.push_back({about, bytes_of(to), at});
          at += about.bytes(Staging::kRays);
        },
        answers);
  }

  void answer() {
    std::optional<Place> places[2];
    try {
      size_t turn = 0, turns = rays_.count > Staging::kRays ? 2 : 1;
      for (uint64_t first = 0; first < rays_.count; first += Staging::kRays) {
        if (!places[turn] && !take(places[turn], turn > 0)) turn = 0, turns = 1;
        if (places[turn]->count > 0) finish(*places[turn]);
        start(*places[turn], first, std::min(rays_.count - first, Staging::kRays));
        turn = (turn + 1) % turns;
      }
      for (size_t left = 0; left < turns; ++left, turn = (turn + 1) % turns)
        if (places[turn]) finish(*places[turn]);
    } catch (...) {
      // Nothing may be running when others get the memory.
      for (std::optional<Place>& place : places) {
        if (!place) continue;
        try {
          context_.wait_stream(stream_of(*place));
        } catch (const GpuError&) {
        }
      }
      throw;
    }
  }

 private:
  /// An output that is asked for.
  struct Output {
    OutputArray about;
    unsigned char* to;
    size_t at;  ///< offset in staging memory
  };
  struct Place {
    explicit Place(GpuDevice& device) : staging(device) {}
    BorrowedStaging staging;
    uint64_t first = 0, count = 0;
  };

  /// Returns false if the GPU has no memory left and the place is optional.
  bool take(std::optional<Place>& place, bool optional) {
    try {
      place.emplace(device_);
      return true;
    } catch (const GpuError& error) {
      if (!optional || error.code() != NIF_ERROR_OUT_OF_DEVICE_MEMORY) throw;
      return false;
    }
  }

  Stream stream_of(const Place& place) const {
    return rays_.stream ? rays_.stream : (*place.staging).stream();
  }

  /// The query for a chunk of `count` rays, in GPU memory.
  SceneQuery on_gpu(const Staging& staging, uint64_t count) const {
    NifRays rays = nifMakeRays(reinterpret_cast<const NifRay*>(staging.gpu()), count);
    if (rays_.mask) {
      rays.mask = reinterpret_cast<const uint32_t*>(staging.gpu() + count * sizeof(NifRay));
      rays.mask_stride = rays_.mask_stride == 0 ? 0 : sizeof(uint32_t);
    }
    SceneQuery query = scene_query(rays, {});
    size_t at = Staging::kInputBytes;
    visit_outputs(
        [&](const OutputArray& about, unsigned char*& array, const auto* wanted) {
          if (wanted) array = staging.gpu() + at;
          at += about.bytes(Staging::kRays);
        },
        query, answers_);
    return query;
  }

  void start(Place& place, uint64_t first, uint64_t count) {
    const Staging& staging = *place.staging;
    const Stream stream = stream_of(place);
    place.first = first;
    place.count = count;
    read_rays(rays_, first, count, staging.host());
    size_t bytes = count * sizeof(NifRay);
    if (rays_.mask) bytes += read_masks(rays_, first, count, staging.host() + bytes);
    context_.copy_in(staging.gpu(), staging.host(), bytes, stream);
    put_query(device_, scene_, on_gpu(staging, count), count, stream);
    for (const Output& output : outputs_)
      context_.copy_out(staging.host() + output.at, staging.gpu() + output.at, output.about.bytes(count),
                        stream);
    context_.record(staging.answered(), stream);
  }

  void finish(const Place& place) {
    const Staging& staging = *place.staging;
    context_.wait(staging.answered());
    for (const Output& output : outputs_)
      std::memcpy(output.to + output.about.bytes(place.first), staging.host() + output.at,
                  output.about.bytes(place.count));
  }

  GpuDevice& device_;
  Context& context_;
  GpuScene& scene_;
  const NifRays& rays_;
  const NifAnswers& answers_;
  std::vector<Output> outputs_;
};

}  // namespace

void check_array(Context& context, uint32_t promised, const void* array, const std::string& name) {
  if (!array) return;
  const PointerKind kind = context.kind_of(array);
  const auto refuse = [&](const char* why) { throw GpuError(NIF_ERROR_WRONG_POINTER, name + why); };
  if (promised == NIF_MEMORY_DEVICE && kind == PointerKind::host)
    refuse(" is memory of the host, and NIF_MEMORY_DEVICE was promised");
  if (promised == NIF_MEMORY_DEVICE && kind == PointerKind::other_device) refuse(" is memory of another GPU");
  if (promised == NIF_MEMORY_HOST && (kind == PointerKind::device || kind == PointerKind::other_device))
    refuse(" is memory of a GPU, and NIF_MEMORY_HOST was promised");
}

void check_stream(Context& context, Stream stream, const char* whose) {
  if (stream && !context.owns(stream))
    throw GpuError(NIF_ERROR_INVALID_ARGUMENT,
                   std::string(whose) + ": the stream is not of the device's GPU");
}

void time_query(GpuDevice& device, GpuScene& scene, const NifRays& query, const NifAnswers& wanted_answers,
                GpuMeasure measure, uint32_t rounds, double* seconds) {
  if (!scene.ready) refuse_scene();
  Context& context = *device.context;
  const uint64_t count = query.count;
  const Memory rays(context, count * sizeof(NifRay)), answers(context, runtime::output_bytes(count));
  SceneQuery on_gpu = scene_query(nifMakeRays(reinterpret_cast<const NifRay*>(rays.data()), count), {});
  struct Output {
    void* to;
    unsigned char* from;
    uint64_t bytes;
  };
  std::vector<Output> outputs;
  unsigned char* at = answers.data();
  visit_outputs(
      [&](const OutputArray& about, unsigned char*& array, auto* wanted) {
        if (!wanted) return;
        array = at;
        outputs.push_back({wanted, at, about.bytes(count)});
        at += about.bytes(count);
      },
      on_gpu, wanted_answers);

  std::vector<unsigned char> packed(count * sizeof(NifRay));
  read_rays(query, 0, count, packed.data());
  const OwnStream stream(context);
  context.copy_in(rays.data(), packed.data(), packed.size(), stream.get());
  const Timer timer(context);
  for (uint32_t round = 0; round <= rounds; ++round) {  // the first round warms up the GPU
    const uint32_t row = round > 0 ? round - 1 : 0;
    if (measure == GpuMeasure::stages) {
      time_stages(device, scene, on_gpu, count, stream.get(), seconds + row * kMeasuredStages);
      continue;
    }
    timer.start(stream.get());
    put_query(device, scene, on_gpu, count, stream.get(), measure);
    timer.stop(stream.get());
    timer.wait();
    seconds[row] = timer.seconds();
  }
  for (const Output& output : outputs) context.copy_out(output.to, output.from, output.bytes, stream.get());
  context.wait_stream(stream.get());
}

void answer_query(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers) {
  if (!scene.ready) refuse_scene();
  check_rays(*device.context, rays);
  check_answers(*device.context, rays, answers);
  if (rays.memory == NIF_MEMORY_HOST) return HostQuery(device, scene, rays, answers).answer();
  put_noted(device, scene, rays.stream,
            [&] { put_query(device, scene, scene_query(rays, answers), rays.count, rays.stream); });
}

void list_open_rays(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifAnswers& answers,
                    const NifOpenRays& open) {
  if (!scene.ready) refuse_scene();
  Context& context = *device.context;
  check_rays(context, rays);
  check_answers(context, rays, answers);
  check_open(context, rays, open);
  constexpr uint64_t kMostRays = std::numeric_limits<uint32_t>::max();
  const kernels::gpu::OpenLists lists{bytes_of(open.rays), bytes_of(open.tmin),
                                      bytes_of(open.tmax), bytes_of(open.instance),
                                      open.count,          uint32_t(std::min(open.capacity, kMostRays))};
  put_noted(device, scene, rays.stream, [&] {
    put_open_query(device, scene, scene_query(rays, answers), rays.count, lists, rays.stream);
  });
}

void find_hits(GpuDevice& device, GpuScene& scene, const NifRays& rays, const NifHits& hits) {
  if (!scene.ready) refuse_scene();
  Context& context = *device.context;
  check_rays(context, rays);
  check_hits(context, rays, hits);
  kernels::gpu::HitOutputs outputs{};
  runtime::visit_hit_outputs(
      [](const OutputArray&, unsigned char*& to, auto* array) { to = bytes_of(array); }, outputs, hits);
  put_noted(device, scene, rays.stream,
            [&] { put_hit_query(device, scene, scene_query(rays, {}), rays.count, outputs, rays.stream); });
}

void check_for_cpu(GpuDevice& device, const NifRays& rays, const NifAnswers& answers, const NifOpenRays* open,
                   const NifHits* hits) {
  Context& context = *device.context;
  check_rays(context, rays);
  check_array(context, rays.memory, rays.scratch, "rays: scratch");
  check_answers(context, rays, answers);
  if (open) check_open(context, rays, *open);
  if (hits) check_hits(context, rays, *hits);
}

void check_for_cpu(GpuDevice& device, const void* array, const char* name) {
  const PointerKind kind = array ? device.context->kind_of(array) : PointerKind::host;
  if (kind == PointerKind::device || kind == PointerKind::other_device)
    throw GpuError(
        NIF_ERROR_WRONG_POINTER,
        std::string(name) + " is memory of a GPU, which nifPoseInstance takes as NIF_MEMORY_DEVICE");
}

}  // namespace nif::gpu
