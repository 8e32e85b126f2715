// Unpacks gzip with zlib and Zstandard with libzstd, and enforces the limit while the output grows: a few
// kilobytes may claim to unpack to terabytes.
#include "formats/mesh/decompress.hpp"

#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <memory>

namespace nif::mesh::detail {
namespace {

class Output {
 public:
  Output(const std::string& name, uint64_t limit)
      : name_(name), limit_(std::min(limit, std::numeric_limits<uint64_t>::max() - 1)) {}

  /// Makes room for at least one more byte, or throws.
  void grow(size_t first_guess) {
    if (bytes.size() < bytes.capacity()) return;
    if (bytes.size() > limit_) {
      throw Error(Status::too_large,
                  fmt::format("{}: unpacks to more than the limit of {} bytes", name_, limit_));
    }
    // The buffer may hold one byte more than the limit, so that exceeding it can be detected.
    const uint64_t wanted = std::max<uint64_t>({first_guess, uint64_t{bytes.capacity()} * 2, 1 << 16});
    bytes.reserve(static_cast<size_t>(std::min(wanted, limit_ + 1)));
  }

  ByteBuffer finish() {
    if (bytes.size() > limit_) grow(0);
    bytes.shrink();
    return std::move(bytes);
  }

  ByteBuffer bytes;

 private:
  const std::string& name_;
  uint64_t limit_;
};

bool is_gzip(std::string_view bytes) { return bytes.substr(0, 2) == "\x1f\x8b"; }
bool is_zstd(std::string_view bytes) { return bytes.substr(0, 4) == "\x28\xb5\x2f\xfd"; }

[[noreturn]] void fail_truncated(const std::string& name, const char* kind, size_t at) {
  throw Error(Status::file_truncated,
              fmt::format("{}: the {} data ends too early, at byte {}", name, kind, at));
}

[[noreturn]] void fail_damaged(const std::string& name, const char* kind, size_t at, const char* why) {
  throw Error(Status::malformed_mesh,
              fmt::format("{}: the {} data is damaged near byte {} ({})", name, kind, at, why));
}

ByteBuffer gunzip(std::string_view packed, const std::string& name, uint64_t limit) {
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 16) != Z_OK) throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> closing(&stream, &inflateEnd);
  Output out(name, limit);
  constexpr size_t kStep = std::numeric_limits<uInt>::max() / 2;  // zlib counts in 32 bits
  size_t done = 0;
  for (;;) {
    out.grow(packed.size() * 4);
    const size_t room = std::min(out.bytes.capacity() - out.bytes.size(), kStep);
    const size_t feed = std::min(packed.size() - done, kStep);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + done));
    stream.avail_in = static_cast<uInt>(feed);
    stream.next_out = reinterpret_cast<Bytef*>(out.bytes.data() + out.bytes.size());
    stream.avail_out = static_cast<uInt>(room);
    const int code = inflate(&stream, Z_NO_FLUSH);
    done += feed - stream.avail_in;
    out.bytes.set_size(out.bytes.size() + room - stream.avail_out);
    if (code == Z_STREAM_END) {
      // gzip files may be concatenated; anything after a member that is not another member is padding.
      if (!is_gzip(packed.substr(done))) return out.finish();
      inflateReset(&stream);
    } else if (code == Z_MEM_ERROR) {
      throw std::bad_alloc();
    } else if (code != Z_OK && code != Z_BUF_ERROR) {
      fail_damaged(name, "gzip", done, stream.msg ? stream.msg : "not a gzip stream");
    } else if (done == packed.size() && stream.avail_out != 0) {
      fail_truncated(name, "gzip", packed.size());
    }
  }
}

ByteBuffer unzstd(std::string_view packed, const std::string& name, uint64_t limit) {
  const std::unique_ptr<ZSTD_DStream, size_t (*)(ZSTD_DStream*)> stream(ZSTD_createDStream(),
                                                                        &ZSTD_freeDStream);
  if (!stream) throw std::bad_alloc();
  Output out(name, limit);
  // The frame may state its size. It is trusted only up to the compression that ordinary meshes reach.
  const unsigned long long stated = ZSTD_getFrameContentSize(packed.data(), packed.size());
  const uint64_t guess = std::min<uint64_t>(stated < ZSTD_CONTENTSIZE_ERROR ? stated + 1 : packed.size() * 4,
                                            packed.size() * 16);
  ZSTD_inBuffer in{packed.data(), packed.size(), 0};
  for (;;) {
    out.grow(static_cast<size_t>(guess));
    ZSTD_outBuffer room{out.bytes.data(), out.bytes.capacity(), out.bytes.size()};
    const size_t code = ZSTD_decompressStream(stream.get(), &room, &in);
    out.bytes.set_size(room.pos);
    if (ZSTD_isError(code)) fail_damaged(name, "Zstandard", in.pos, ZSTD_getErrorName(code));
    if (in.pos == in.size) {
      if (code == 0) return out.finish();
      if (room.pos < room.size) fail_truncated(name, "Zstandard", packed.size());
    }
  }
}

}  // namespace

ByteBuffer decompress(ByteBuffer packed, const std::filesystem::path& file, const ReadLimits& limits) {
  const std::string name = file.string();
  if (is_gzip(packed.view())) return gunzip(packed.view(), name, limits.max_decompressed_bytes);
  if (is_zstd(packed.view())) return unzstd(packed.view(), name, limits.max_decompressed_bytes);
  return packed;
}

}  // namespace nif::mesh::detail
