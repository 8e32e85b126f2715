// A TBB pipeline: chunks are computed in parallel and written in order. Finished chunks are in a ring of
// fixed slots; as tokens of the pipeline, they would leak if one throws.
#include "formats/mesh/ply_writer.hpp"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"

namespace nif::mesh {
namespace {

static_assert(std::endian::native == std::endian::little, "chunks are written as they are in memory");

constexpr uint64_t kChunk = 1 << 14;  ///< vertices or triangles that are computed together; some 200 kB
constexpr float kHuge = std::numeric_limits<float>::max();
constexpr size_t kFaceBytes = 1 + sizeof(Triangle);

constexpr Float3 kLowest{-kHuge, -kHuge, -kHuge}, kHighest{kHuge, kHuge, kHuge};

/// A chunk as it is in the file, and its bounds.
struct Block {
  std::vector<std::byte> bytes;
  Float3 low = kHighest, high = kLowest;

  void include(const Float3& l, const Float3& h) {
    for (size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], l[axis]);
      high[axis] = std::max(high[axis], h[axis]);
    }
  }
};

std::string header(const MeshSource& source, const std::string& comment, bool doubles) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\n{0}element vertex {1}\nproperty {2} x\nproperty {2} y\n"
      "property {2} z\nelement face {3}\nproperty list uchar int vertex_indices\nend_header\n",
      comment.empty() ? "" : "comment " + comment + "\n", source.vertex_count(), doubles ? "double" : "float",
      source.triangle_count());
}

/// The source split into chunks, those of the vertices first.
class Chunks {
 public:
  Chunks(const MeshSource& source, bool doubles)
      : source_(source),
        doubles_(doubles),
        of_vertices_((source.vertex_count() + kChunk - 1) / kChunk),
        count_(of_vertices_ + (source.triangle_count() + kChunk - 1) / kChunk) {}

  uint64_t count() const { return count_; }

  Block compute(uint64_t index) const {
    return index < of_vertices_ ? of_vertices(index * kChunk) : of_faces((index - of_vertices_) * kChunk);
  }

 private:
  Block of_vertices(uint64_t first) const {
    std::vector<Float3> points(std::min(kChunk, source_.vertex_count() - first));
    source_.vertices(first, points);
    Block chunk;
    for (const Float3& point : points) chunk.include(point, point);
    std::vector<Double3> wide(doubles_ ? points.size() : 0);
    if (doubles_) source_.exact(first, wide);
    const std::span<const std::byte> bytes =
        doubles_ ? std::as_bytes(std::span(wide)) : std::as_bytes(std::span(points));
    chunk.bytes.assign(bytes.begin(), bytes.end());
    return chunk;
  }

  Block of_faces(uint64_t first) const {
    std::vector<Triangle> triangles(std::min(kChunk, source_.triangle_count() - first));
    source_.triangles(first, triangles);
    Block chunk;
    chunk.bytes.resize(triangles.size() * kFaceBytes);
    std::byte* at = chunk.bytes.data();
    for (const Triangle& triangle : triangles) {
      *at = std::byte{3};
      std::memcpy(at + 1, triangle.data(), sizeof(triangle));
      at += kFaceBytes;
    }
    return chunk;
  }

  const MeshSource& source_;
  bool doubles_;
  uint64_t of_vertices_, count_;
};

}  // namespace

PlyFile write_ply(const std::string& path, const MeshSource& source, const std::string& comment,
                  const std::function<void(double)>& progress, const std::atomic<bool>& cancel) {
  constexpr uint64_t kMost = std::numeric_limits<int32_t>::max();
  if (source.vertex_count() > kMost || source.triangle_count() > kMost)
    throw Error(Status::too_large,
                fmt::format("{}: {} vertices and {} triangles are more than a PLY file can hold", path,
                            source.vertex_count(), source.triangle_count()));
  OutputFile file(path);
  PlyFile written;
  const auto append = [&](std::span<const std::byte> bytes) {
    file.write(bytes);
    written.bytes += bytes.size();
  };
  const bool doubles = source.needs_doubles();
  const std::string text = header(source, comment, doubles);
  append(std::as_bytes(std::span(text)));

  const Chunks chunks(source, doubles);
  // The number of concurrent chunks: enough that no thread waits while one is written. They finish in order,
  // so that each has its own slot. (As tokens of the pipeline, they would leak if one of them throws.)
  std::vector<Block> places(2 * size_t(tbb::this_task_arena::max_concurrency()) + 2);
  Block all;
  uint64_t next = 0, done = 0;
  const auto begin = [&](tbb::flow_control& flow) {
    if (cancel) throw Error(Status::interrupted, path + ": the writing was cancelled");
    if (next == chunks.count()) flow.stop();
    return next++;
  };
  const auto compute = [&](uint64_t index) {
    places[index % places.size()] = chunks.compute(index);
    return index;
  };
  const auto finish = [&](uint64_t index) {
    const Block& chunk = places[index % places.size()];
    append(chunk.bytes);
    all.include(chunk.low, chunk.high);
    progress(double(++done) / double(chunks.count()));
  };
  tbb::parallel_pipeline(places.size(),
                         tbb::make_filter<void, uint64_t>(tbb::filter_mode::serial_in_order, begin) &
                             tbb::make_filter<uint64_t, uint64_t>(tbb::filter_mode::parallel, compute) &
                             tbb::make_filter<uint64_t, void>(tbb::filter_mode::serial_in_order, finish));
  if (source.vertex_count() > 0) {
    written.low = all.low;
    written.high = all.high;
  }
  file.commit();
  return written;
}

}  // namespace nif::mesh
