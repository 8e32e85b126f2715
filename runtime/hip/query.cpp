// Queries: of memory of the card they are launches in the caller's stream and nothing else; of the host's
// they go through staging memory, part by part, and are waited for.
#include <algorithm>
#include <cstring>
#include <limits>

#include "device.hpp"

namespace nif::gpu {
namespace {

using kernels::hip::SceneQuery;

/// The arrays of a query and what messages call them.
struct NamedArray {
  const void* array;
  const char* name;
};

void check_memory(Context& context, const NifQuery& query) {
  const NamedArray arrays[] = {{query.origin[0], "origin"},
                               {query.origin[1], "origin"},
                               {query.origin[2], "origin"},
                               {query.direction[0], "direction"},
                               {query.direction[1], "direction"},
                               {query.direction[2], "direction"},
                               {query.tmin, "tmin"},
                               {query.tmax, "tmax"},
                               {query.visible, "visible"},
                               {query.visible_bits, "visible_bits"},
                               {query.probability, "probability"},
                               {query.certain, "certain"},
                               {query.logit, "logit"}};
  for (const NamedArray& given : arrays) {
    if (!given.array) continue;
    const PointerKind kind = context.kind_of(given.array);
    const auto refuse = [&](const char* why) {
      throw GpuError(NIF_ERROR_WRONG_POINTER, std::string("query: ") + given.name + why);
    };
    if (query.memory == NIF_DEVICE && kind == PointerKind::host)
      refuse(" is memory of the host, and NIF_DEVICE was promised");
    if (query.memory == NIF_DEVICE && kind == PointerKind::other_device) refuse(" is memory of another card");
    if (query.memory == NIF_HOST && (kind == PointerKind::device || kind == PointerKind::other_device))
      refuse(" is memory of a card, and NIF_HOST was promised");
  }
  if (query.stream && !context.owns(query.stream))
    throw GpuError(NIF_ERROR_INVALID_ARGUMENT, "query: the stream is not of the device's card");
}

template <class T>
unsigned char* bytes_of(T* array) {
  return reinterpret_cast<unsigned char*>(array);
}
const unsigned char* bytes_of(const float* array) { return reinterpret_cast<const unsigned char*>(array); }

SceneQuery scene_query(const NifQuery& query) {
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
  result.visible = query.visible;
  result.visible_bits = query.visible_bits;
  result.probability = bytes_of(query.probability);
  result.certain = query.certain;
  result.logit = bytes_of(query.logit);
  return result;
}

template <class T>
void advance(T*& array, uint64_t bytes) {
  if (array) array += bytes;
}

/// The same with the first rays left out; a multiple of 8.
void skip(SceneQuery& query, uint64_t rays) {
  for (int a = 0; a < 3; ++a) {
    advance(query.origin[a], rays * query.origin_stride);
    advance(query.direction[a], rays * query.direction_stride);
  }
  advance(query.tmin, rays * query.tmin_stride);
  advance(query.tmax, rays * query.tmax_stride);
  advance(query.visible, rays);
  advance(query.visible_bits, rays / 8);
  advance(query.probability, rays * sizeof(float));
  advance(query.certain, rays);
  advance(query.logit, rays * sizeof(int32_t));
}

/// In as many launches as it takes.
void launch(GpuDevice& device, GpuScene& scene, SceneQuery query, uint64_t count, Stream stream) {
  constexpr uint32_t kMostBlocks = 1u << 20;
  const SceneKernels* kernels = device.kernels;
  while ((scene.kinds & ~kernels->kinds) != 0) ++kernels;
  const kernels::hip::SceneLayout& layout = scene.arrays.layout;
  while (count > 0) {
    query.count = uint32_t(std::min<uint64_t>(count, device.context->most_rays()));
    void* arguments[] = {&scene.arrays, &query};
    const LaunchShape shape{std::min(kMostBlocks, (query.count - 1) / layout.rays + 1),
                            kernels::hip::kSceneThreads, layout.bytes};
    device.context->launch(query.details() ? kernels->details : kernels->visible, shape, stream, arguments);
    count -= query.count;
    skip(query, query.count);
  }
}

/// Notes in the stream that the scene is in use until here.
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

float value_at(const float* array, uint64_t stride, uint64_t i) {
  float value;
  std::memcpy(&value, reinterpret_cast<const char*>(array) + i * stride, sizeof(value));
  return value;
}

void read_rays(const NifQuery& query, uint64_t first, uint64_t count, unsigned char* to) {
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

/// Staging memory for a while.
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
    } catch (...) {  // then it is freed
    }
  }
  const Staging& operator*() const { return *staging_; }

 private:
  GpuDevice& device_;
  std::unique_ptr<Staging> staging_;
};

/// A stream of its own, and how long the card takes for what is put into it.
class Stopwatch {
 public:
  explicit Stopwatch(Context& context) : context_(context), stream_(context.make_stream()) {
    try {
      start_ = context.make_event(true);
      end_ = context.make_event(true);
    } catch (...) {
      release();
      throw;
    }
  }
  ~Stopwatch() { release(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  Stream stream() const { return stream_; }

  template <class Work>
  double time(const Work& work) const {
    context_.record(start_, stream_);
    work();
    context_.record(end_, stream_);
    context_.wait(end_);
    return context_.seconds_between(start_, end_);
  }

 private:
  void release() noexcept {
    if (start_) context_.free_event(start_);
    if (end_) context_.free_event(end_);
    context_.free_stream(stream_);
  }
  Context& context_;
  Stream stream_;
  Event start_ = nullptr, end_ = nullptr;
};

void answer_host_query(GpuDevice& device, GpuScene& scene, const NifQuery& query) {
  Context& context = *device.context;
  const BorrowedStaging borrowed(device);
  const Staging& staging = *borrowed;
  const Stream stream = query.stream ? query.stream : staging.stream();
  // Where each output lies in staging memory, and in the caller's.
  struct Output {
    unsigned char* to;
    size_t at;
    uint64_t (*bytes)(uint64_t rays);
  };
  const auto one = [](uint64_t rays) { return rays; };
  const auto four = [](uint64_t rays) { return 4 * rays; };
  const Output outputs[] = {
      {query.visible, Staging::kVisible, one},
      {query.visible_bits, Staging::kBits, [](uint64_t rays) { return (rays + 7) / 8; }},
      {query.certain, Staging::kCertain, one},
      {bytes_of(query.probability), Staging::kProbability, four},
      {bytes_of(query.logit), Staging::kLogit, four}};
  NifQuery on_card = nifQueryRays(reinterpret_cast<const NifRay*>(staging.card()), Staging::kRays);
  const auto place = [&](auto*& array, const void* wanted, size_t at) {
    if (wanted) array = reinterpret_cast<std::remove_reference_t<decltype(array)>>(staging.card() + at);
  };
  place(on_card.visible, query.visible, Staging::kVisible);
  place(on_card.visible_bits, query.visible_bits, Staging::kBits);
  place(on_card.certain, query.certain, Staging::kCertain);
  place(on_card.probability, query.probability, Staging::kProbability);
  place(on_card.logit, query.logit, Staging::kLogit);
  const SceneQuery asked = scene_query(on_card);
  const auto answer_part = [&](uint64_t first, uint64_t count) {
    read_rays(query, first, count, staging.host());
    context.copy_in(staging.card(), staging.host(), count * sizeof(NifRay), stream);
    launch(device, scene, asked, count, stream);
    for (const Output& output : outputs)
      if (output.to)
        context.copy_out(staging.host() + output.at, staging.card() + output.at, output.bytes(count), stream);
    context.wait_stream(stream);
    for (const Output& output : outputs)
      if (output.to)
        std::memcpy(output.to + output.bytes(first), staging.host() + output.at, output.bytes(count));
  };
  try {
    for (uint64_t first = 0; first < query.count; first += Staging::kRays)
      answer_part(first, std::min(query.count - first, Staging::kRays));
  } catch (...) {
    try {
      context.wait_stream(stream);  // so that nothing is under way when others get the memory
    } catch (const GpuError&) {
    }
    throw;
  }
}

}  // namespace

void time_query(GpuDevice& device, GpuScene& scene, const NifQuery& query, uint32_t rounds, double* seconds) {
  Context& context = *device.context;
  const uint64_t count = query.count;
  const Memory rays(context, count * sizeof(NifRay)), answers(context, 11 * count + 16);
  NifQuery on_card = nifQueryRays(reinterpret_cast<const NifRay*>(rays.data()), count);
  on_card.memory = NIF_DEVICE;
  struct Output {
    void* to;
    unsigned char* from;
    uint64_t bytes;
  };
  std::vector<Output> outputs;
  unsigned char* at = answers.data();
  const auto place = [&](auto*& array, auto* wanted, uint64_t bytes) {
    if (!wanted) return;
    array = reinterpret_cast<std::remove_reference_t<decltype(array)>>(at);
    outputs.push_back({wanted, at, bytes});
    at += bytes;
  };
  place(on_card.probability, query.probability, 4 * count);
  place(on_card.logit, query.logit, 4 * count);
  place(on_card.visible, query.visible, count);
  place(on_card.certain, query.certain, count);
  place(on_card.visible_bits, query.visible_bits, (count + 7) / 8);

  std::vector<unsigned char> packed(count * sizeof(NifRay));
  read_rays(query, 0, count, packed.data());
  const Stopwatch stopwatch(context);
  on_card.stream = stopwatch.stream();
  context.copy_in(rays.data(), packed.data(), packed.size(), on_card.stream);
  for (uint32_t round = 0; round <= rounds; ++round) {
    const double time = stopwatch.time([&] { answer_query(device, scene, on_card); });
    if (round > 0) seconds[round - 1] = time;  // before that, the card warms up
  }
  for (const Output& output : outputs) context.copy_out(output.to, output.from, output.bytes, on_card.stream);
  context.wait_stream(on_card.stream);
}

void answer_query(GpuDevice& device, GpuScene& scene, const NifQuery& query) {
  if (!scene.ready)
    throw GpuError(NIF_ERROR_INVALID_OPERATION, "the scene is not on the GPU, because its commit failed");
  check_memory(*device.context, query);
  if (query.memory == NIF_HOST) return answer_host_query(device, scene, query);
  launch(device, scene, scene_query(query), query.count, query.stream);
  record_use(device, scene, query.stream);
}

}  // namespace nif::gpu
