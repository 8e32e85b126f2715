// meshoptimizer decodes, after this file has checked its input. Before memory is allocated, the claimed size
// is compared with the bytes that there are. The extension's filter is undone last.
#include "formats/mesh/gltf/meshopt.hpp"

#include <fmt/format.h>
#include <meshoptimizer.h>

namespace nif::mesh::detail {
namespace {

/// The vertex codec turns 256 zero bytes into 4; the index codecs compress less.
constexpr uint64_t kMostCompressed = 64;

}  // namespace

std::string decode_meshopt(const Input& input, const MeshoptData& data) {
  const auto fail = [&](const std::string& reason) {
    input.fail(Status::malformed_mesh, fmt::format("{} {}", data.where, reason));
  };
  const bool attributes = data.mode == "ATTRIBUTES", triangles = data.mode == "TRIANGLES",
             indices = data.mode == "INDICES";
  if (!attributes && !triangles && !indices) fail(fmt::format("has the unknown mode '{}'", data.mode));
  const bool stride_fits = attributes ? data.stride % 4 == 0 && data.stride >= 4 && data.stride <= 256
                                      : data.stride == 2 || data.stride == 4;
  if (!stride_fits) fail(fmt::format("has elements of {} bytes", data.stride));
  if (triangles && data.count % 3 != 0)
    fail(fmt::format("has {} triangle corners, not a multiple of 3", data.count));
  if (data.count > kMostCompressed * data.bytes.size() / data.stride + 1)
    fail(fmt::format("would become {} elements, more than {} bytes can hold", data.count, data.bytes.size()));

  std::string out(data.count * data.stride, '\0');
  const auto* bytes = reinterpret_cast<const unsigned char*>(data.bytes.data());
  const size_t size = data.bytes.size();
  const int failed = attributes ? meshopt_decodeVertexBuffer(out.data(), data.count, data.stride, bytes, size)
                     : triangles
                         ? meshopt_decodeIndexBuffer(out.data(), data.count, data.stride, bytes, size)
                         : meshopt_decodeIndexSequence(out.data(), data.count, data.stride, bytes, size);
  if (failed != 0) fail("cannot be decoded");
  if (data.filter == "NONE") return out;
  if (data.filter == "EXPONENTIAL" && attributes) {
    meshopt_decodeFilterExp(out.data(), data.count, data.stride);
  } else if (data.filter == "OCTAHEDRAL" && attributes && (data.stride == 4 || data.stride == 8)) {
    meshopt_decodeFilterOct(out.data(), data.count, data.stride);
  } else if (data.filter == "QUATERNION" && attributes && data.stride == 8) {
    meshopt_decodeFilterQuat(out.data(), data.count, data.stride);
  } else {
    fail(fmt::format("has a filter '{}' that does not fit its elements", data.filter));
  }
  return out;
}

}  // namespace nif::mesh::detail
