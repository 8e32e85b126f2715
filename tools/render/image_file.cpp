// Reads and writes PNG with libpng, OpenEXR with its own library, and Radiance's .hdr with stb.
#include "tools/render/image_file.hpp"

#include <ImathBox.h>
#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <openexr.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <span>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_HDR
#define STBI_NO_STDIO
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace nif::render {
namespace {

constexpr int kMaxSide = 16384;

/// OpenEXR writes into memory, so that the file is then written whole or not at all.
class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("memory") {}
  void write(const char bytes[], int count) override {
    if (at_ + size_t(count) > bytes_.size()) bytes_.resize(at_ + size_t(count));
    std::memcpy(bytes_.data() + at_, bytes, size_t(count));
    at_ += size_t(count);
  }
  uint64_t tellp() override { return at_; }
  void seekp(uint64_t position) override { at_ = position; }
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(bytes_)); }

 private:
  std::vector<char> bytes_;
  size_t at_ = 0;
};

class MemorySource : public Imf::IStream {
 public:
  MemorySource(const char* name, std::string_view bytes) : Imf::IStream(name), bytes_(bytes) {}
  bool read(char to[], int count) override {
    if (count < 0 || uint64_t(count) > bytes_.size() - std::min<uint64_t>(at_, bytes_.size()))
      throw Iex::InputExc("the file ends too early");
    std::memcpy(to, bytes_.data() + at_, size_t(count));
    at_ += uint64_t(count);
    return at_ < bytes_.size();
  }
  uint64_t tellg() override { return at_; }
  void seekg(uint64_t position) override { at_ = position; }

 private:
  std::string_view bytes_;
  uint64_t at_ = 0;
};

[[noreturn]] void no_image(const std::string& path, const std::string& why) {
  throw Error(Status::not_an_image, path + ": " + why);
}

/// Called before memory for all pixels is allocated: a few hundred bytes may claim to be 16,384 pixels
/// square.
void check_pixels(const std::string& path, int width, int height, uint64_t most) {
  if (uint64_t(width) * uint64_t(height) > most)
    no_image(path, "is too short for the " + std::to_string(width) + " x " + std::to_string(height) +
                       " pixels that it claims to have");
}

/// OpenEXR's C++ reader allocates memory for an attribute before it checks that the bytes are there, and
/// trusts the lengths of some. Its newer C library checks the whole header against the length of the file, so
/// it reads the header first.
void check_header(const std::string& path, std::string_view bytes) {
  struct Source {
    std::string_view bytes;
    std::string complaint;  ///< it reports some faults, and continues
  } source{bytes, {}};
  exr_context_initializer_t about{};
  about.size = sizeof(about);
  about.flags = EXR_CONTEXT_FLAG_STRICT_HEADER;
  about.user_data = &source;
  about.max_image_width = about.max_image_height = kMaxSide;
  about.error_handler_fn = [](exr_const_context_t context, exr_result_t, const char* what) {
    void* user = nullptr;
    if (exr_get_user_data(context, &user) == EXR_ERR_SUCCESS) static_cast<Source*>(user)->complaint = what;
  };
  about.size_fn = [](exr_const_context_t, void* user) {
    return int64_t(static_cast<const Source*>(user)->bytes.size());
  };
  about.read_fn = [](exr_const_context_t, void* user, void* to, uint64_t count, uint64_t offset,
                     exr_stream_error_func_ptr_t) -> int64_t {
    const std::string_view all = static_cast<const Source*>(user)->bytes;
    if (offset > all.size()) return -1;
    count = std::min<uint64_t>(count, all.size() - offset);  // it requests more than it needs
    std::memcpy(to, all.data() + offset, count);
    return int64_t(count);
  };
  exr_context_t context = nullptr;
  const exr_result_t result = exr_start_read(&context, path.c_str(), &about);
  exr_finish(&context);
  if (result != EXR_ERR_SUCCESS || !source.complaint.empty())
    no_image(path, "cannot be read as an OpenEXR picture: " +
                       (source.complaint.empty() ? exr_get_default_error_message(result) : source.complaint));
}

Image read_exr(const std::string& path, std::string_view bytes) {
  check_header(path, bytes);
  try {
    Imf::Header::setMaxImageSize(kMaxSide, kMaxSide);
    MemorySource source(path.c_str(), bytes);
    Imf::InputFile file(source, 1);
    const Imath::Box2i window = file.header().dataWindow();
    const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
    // A pixel has at least 6 bytes; zlib compresses equal ones to a thousandth, and wavelets hardly less.
    constexpr uint64_t kSmall = 1 << 20, kMostPerByte = 4096;
    check_pixels(path, width, height, kSmall + kMostPerByte * bytes.size());
    for (const char* channel : {"R", "G", "B"})
      if (file.header().channels().findChannel(channel) == nullptr)
        no_image(path, std::string("has no channel ") + channel);
    Image image{uint32_t(width), uint32_t(height)};
    Imf::FrameBuffer frame;
    const size_t pixel = 3 * sizeof(float), row = pixel * size_t(width);
    for (size_t c = 0; c < 3; ++c)
      frame.insert(std::string(1, "RGB"[c]),
                   Imf::Slice::Make(Imf::FLOAT, image.values.data() + c, window, pixel, row));
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return image;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    no_image(path, std::string("cannot be read as an OpenEXR picture: ") + problem.what());
  }
}

/// Scans the run-length encoded rows as stb does. stb would loop forever on a run of zero pixels, and so also
/// at the end of a truncated file.
void check_runs(const std::string& path, std::string_view bytes, int width, int height) {
  const auto next_line = [&] {
    const size_t end = bytes.find('\n');
    const std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(end == std::string_view::npos ? bytes.size() : end + 1);
    return line;
  };
  while (!bytes.empty() && !next_line().empty()) continue;
  next_line();  // the line with the size
  const auto take = [&] {
    if (bytes.empty()) no_image(path, "ends too early");
    const auto value = uint8_t(bytes[0]);
    bytes.remove_prefix(1);
    return int(value);
  };
  const auto is_coded = [&] {
    return bytes.size() >= 4 && bytes[0] == 2 && bytes[1] == 2 && (uint8_t(bytes[2]) & 0x80) == 0;
  };
  if (width < 8 || width >= 32768 || !is_coded()) {
    if (bytes.size() / 4 / uint64_t(width) < uint64_t(height)) no_image(path, "ends too early");
    return;
  }
  for (int row = 0; row < height; ++row) {
    if (!is_coded()) no_image(path, bytes.size() < 4 ? "ends too early" : "mixes rows of two kinds");
    bytes.remove_prefix(4);
    for (int channel = 0; channel < 4; ++channel)
      for (int pixel = 0; pixel < width;) {
        const int count = take();
        if (count == 0) no_image(path, "has a run of no pixels");
        pixel += count > 128 ? count - 128 : count;
        for (int values = count > 128 ? 1 : count; values > 0; --values) take();
      }
  }
}

Image read_hdr(const std::string& path, std::string_view bytes) {
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  int width = 0, height = 0, channels = 0;
  if (bytes.size() > 0x7fffffff ||
      !stbi_info_from_memory(data, int(bytes.size()), &width, &height, &channels))
    no_image(path, "is not a valid Radiance picture");
  if (width <= 0 || height <= 0) no_image(path, "is not a valid Radiance picture");
  if (width > kMaxSide || height > kMaxSide) no_image(path, "is larger than 16,384 x 16,384 pixels");
  // A row has 4 bytes per pixel; or 4 bytes, and in each of 4 channels 2 bytes for 127 equal pixels.
  const uint64_t row = std::min<uint64_t>(4 * uint64_t(width), 4 + 8 * ((uint64_t(width) + 126) / 127));
  check_pixels(path, width, height, bytes.size() / row * uint64_t(width));
  check_runs(path, bytes, width, height);
  float* values = stbi_loadf_from_memory(data, int(bytes.size()), &width, &height, &channels, 3);
  if (values == nullptr)
    no_image(path, std::string("cannot be read as a Radiance picture: ") + stbi_failure_reason());
  Image image{uint32_t(width), uint32_t(height)};
  std::copy_n(values, image.values.size(), image.values.begin());
  stbi_image_free(values);
  return image;
}

}  // namespace

float srgb_encode(float linear) {
  const float x = std::clamp(linear, 0.0f, 1.0f);
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

float srgb_decode(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Image srgb_encoded(const Image& linear) {
  Image encoded = linear;
  for (float& value : encoded.values) value = srgb_encode(value);
  return encoded;
}

std::vector<std::byte> encode_png(const Image& encoded) {
  std::vector<uint8_t> bytes(encoded.values.size());
  std::transform(encoded.values.begin(), encoded.values.end(), bytes.begin(),
                 [](float value) { return uint8_t(std::lround(255 * std::clamp(value, 0.0f, 1.0f))); });
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = encoded.width;
  png.height = encoded.height;
  png.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::vector<std::byte> file(size);
  if (!png_image_write_to_memory(&png, file.data(), &size, 0, bytes.data(), 0, nullptr))
    throw Error(Status::internal, std::string("libpng failed: ") + png.message);
  file.resize(size);
  return file;
}

void write_png(const std::string& path, const Image& encoded) { write_output(path, encode_png(encoded)); }

void write_exr(const std::string& path, const Image& linear) {
  Imf::Header header(int(linear.width), int(linear.height));
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame;
  for (size_t c = 0; c < 3; ++c) {
    const std::string name(1, "RGB"[c]);
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    auto* base = reinterpret_cast<char*>(const_cast<float*>(linear.values.data() + c));
    frame.insert(name, Imf::Slice(Imf::FLOAT, base, 3 * sizeof(float), 3 * sizeof(float) * linear.width));
  }
  MemoryStream stream;
  {
    Imf::OutputFile file(stream, header, 1);
    file.setFrameBuffer(frame);
    file.writePixels(int(linear.height));
  }
  write_output(path, stream.bytes());
}

Image read_environment(const std::string& path) {
  const mesh::detail::ByteBuffer bytes = mesh::detail::load_file(path, uint64_t{4} << 30);
  const std::string_view view = bytes.view();
  Image image = view.starts_with("\x76\x2f\x31\x01") ? read_exr(path, view)
                : view.starts_with("#?")
                    ? read_hdr(path, view)
                    : (no_image(path, "is neither an OpenEXR nor a Radiance picture"), Image());
  for (const float value : image.values)
    if (!(value >= 0 && value <= 1e30f)) no_image(path, "has values that are negative or not finite");
  return image;
}

}  // namespace nif::render
