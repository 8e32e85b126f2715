// libpng and libjpeg report errors by longjmp, so code that runs under succeeds() must not create anything that
// needs a destructor. Limits on sides, text chunks and scans prevent a small hostile file from taking long.
#include "formats/mesh/image.hpp"

#include <fmt/format.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <new>
#include <vector>

// After <cstdio>, which it needs.
#include <jerror.h>
#include <jpeglib.h>
#include <png.h>
#include <webp/decode.h>

namespace nif::mesh::detail {
namespace {

/// Limit for a picture's side; no texture comes close.
constexpr uint32_t kMostSide = 65535;

/// The common part of both decoders: where to continue after the library has failed, and its message.
class Decoder {
 public:
  uint32_t width = 0, height = 0;
  char said[JMSG_LENGTH_MAX] = "";

 protected:
  /// Calls `steps`; returns false if the library failed in between. It returns from there by longjmp, so
  /// nothing that `steps` creates may need a destructor.
  template <class Steps>
  bool succeeds(const Steps& steps) {
    if (setjmp(back_) != 0) return false;
    steps();
    return true;
  }

  [[noreturn]] void fail() { std::longjmp(back_, 1); }

 private:
  std::jmp_buf back_;
};

class PngDecoder : public Decoder {
 public:
  static bool is_one(std::string_view bytes) { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }

  explicit PngDecoder(std::string_view bytes) : rest_(bytes) {}
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;
  ~PngDecoder() { png_destroy_read_struct(&png_, &info_, nullptr); }

  bool read_header() {
    return succeeds([&] {
      png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
      if (png_ == nullptr || (info_ = png_create_info_struct(png_)) == nullptr)
        on_error(*this, "Out of memory");
      png_set_user_limits(png_, kMostSide, kMostSide);
      png_set_chunk_cache_max(png_, 1);  // none: texts unpack to a thousand times their length
      png_set_read_fn(png_, this, take);
      png_read_info(png_, info_);
      width = png_get_image_width(png_, info_);
      height = png_get_image_height(png_, info_);
    });
  }

  /// As 8 bits each of red, green and blue, whatever the format. glTF requires that gamma and profiles are
  /// ignored.
  bool read_texels(uint8_t* texels) {
    return read_rows(texels, size_t{3} * width, [&] {
      png_set_palette_to_rgb(png_);
      png_set_expand_gray_1_2_4_to_8(png_);
      png_set_gray_to_rgb(png_);
      png_set_scale_16(png_);
      png_set_strip_alpha(png_);
    });
  }

  bool has_alpha() const {
    return (png_get_color_type(png_, info_) & PNG_COLOR_MASK_ALPHA) != 0 ||
           png_get_valid(png_, info_, PNG_INFO_tRNS) != 0;
  }
  bool read_alpha(uint16_t* alpha) {
    const bool deep = png_get_bit_depth(png_, info_) == 16;
    const size_t texel = deep ? 8 : 4, row_bytes = texel * width;
    const auto expand = [&] {
      png_set_expand(png_);
      png_set_gray_to_rgb(png_);
    };
    const auto take_alpha = [&](const uint8_t* from, size_t count, uint16_t* to) {
      for (size_t i = 0; i < count; ++i, from += texel)
        to[i] = uint16_t(deep ? from[6] << 8 | from[7] : from[3] * 257);
    };
    if (png_get_interlace_type(png_, info_) != PNG_INTERLACE_NONE) {
      std::vector<uint8_t> colors(row_bytes * height);
      if (!read_rows(colors.data(), row_bytes, expand)) return false;
      take_alpha(colors.data(), size_t{width} * height, alpha);
      return true;
    }
    std::vector<uint8_t> row(row_bytes);
    return succeeds([&] {
      begin_rows(row_bytes, expand);
      for (size_t y = 0; y < height; ++y) {
        png_read_row(png_, row.data(), nullptr);
        take_alpha(row.data(), width, alpha + y * width);
      }
      png_read_end(png_, nullptr);
    });
  }

 private:
  /// `transform` asks libpng for a form in which a row takes this many bytes. Fails by longjmp.
  template <class Transform>
  void begin_rows(size_t row_bytes, const Transform& transform) {
    transform();
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    if (png_get_rowbytes(png_, info_) != row_bytes) on_error(*this, "it has odd channels");
  }
  template <class Transform>
  bool read_rows(uint8_t* to, size_t row_bytes, const Transform& transform) {
    std::vector<uint8_t*> rows(height);
    for (size_t row = 0; row < height; ++row) rows[row] = to + row * row_bytes;
    return succeeds([&] {
      begin_rows(row_bytes, transform);
      png_read_image(png_, rows.data());
      png_read_end(png_, nullptr);
    });
  }

  [[noreturn]] static void on_error(PngDecoder& decoder, const char* what) {
    std::snprintf(decoder.said, sizeof(decoder.said), "%s", what);
    decoder.fail();
  }
  [[noreturn]] static void on_error(png_structp png, const char* what) {
    on_error(*static_cast<PngDecoder*>(png_get_error_ptr(png)), what);
  }
  static void on_warning(png_structp, const char*) {}

  static void take(png_structp png, uint8_t* to, size_t count) {
    std::string_view& rest = static_cast<PngDecoder*>(png_get_io_ptr(png))->rest_;
    if (count > rest.size()) png_error(png, "it ends too early");
    std::memcpy(to, rest.data(), count);
    rest.remove_prefix(count);
  }

  std::string_view rest_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

class JpegDecoder : public Decoder {
 public:
  static bool is_one(std::string_view bytes) { return bytes.starts_with("\xFF\xD8\xFF"); }

  explicit JpegDecoder(std::string_view bytes) : bytes_(bytes) {}
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;
  ~JpegDecoder() { jpeg_destroy_decompress(&jpeg_); }

  bool read_header() {
    return succeeds([&] {
      jpeg_.err = jpeg_std_error(&handlers_);
      jpeg_.client_data = this;
      handlers_.error_exit = on_error;
      handlers_.emit_message = on_message;
      jpeg_create_decompress(&jpeg_);
      progress_.progress_monitor = on_progress;
      jpeg_.progress = &progress_;
      jpeg_mem_src(&jpeg_, reinterpret_cast<const uint8_t*>(bytes_.data()), bytes_.size());
      jpeg_read_header(&jpeg_, TRUE);
      width = jpeg_.image_width;
      height = jpeg_.image_height;
    });
  }

  static bool has_alpha() { return false; }
  static bool read_alpha(uint16_t*) { return false; }
  bool read_texels(uint8_t* texels) {
    const bool inks = jpeg_.jpeg_color_space == JCS_CMYK || jpeg_.jpeg_color_space == JCS_YCCK;
    std::vector<uint8_t> row(inks ? size_t{4} * width : 0);
    return succeeds([&] {
      jpeg_.out_color_space = inks ? JCS_CMYK : JCS_RGB;
      jpeg_start_decompress(&jpeg_);
      while (jpeg_.output_scanline < height) {
        uint8_t* const at = texels + size_t{3} * width * jpeg_.output_scanline;
        uint8_t* to = inks ? row.data() : at;
        jpeg_read_scanlines(&jpeg_, &to, 1);
        if (inks) to_rgb(row.data(), at);
      }
      jpeg_finish_decompress(&jpeg_);
    });
  }

 private:
  static JpegDecoder& of(j_common_ptr jpeg) { return *static_cast<JpegDecoder*>(jpeg->client_data); }

  [[noreturn]] static void on_error(j_common_ptr jpeg) {
    JpegDecoder& decoder = of(jpeg);
    jpeg->err->format_message(jpeg, decoder.said);
    decoder.fail();
  }

  /// Levels below 0 are warnings. With any but these four kinds, part of the picture would be grey.
  static void on_message(j_common_ptr jpeg, int level) {
    const int code = jpeg->err->msg_code;
    const bool harmless = code == JWRN_EXTRANEOUS_DATA || code == JWRN_TOO_MUCH_DATA ||
                          code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM;
    if (level < 0 && !harmless) on_error(jpeg);
  }

  /// Each scan of a progressive picture takes time proportional to the picture's size, and may have just a
  /// few bytes.
  static void on_progress(j_common_ptr jpeg) {
    constexpr int kMostScans = 500;  // an encoder makes some ten
    if (!jpeg->is_decompressor || reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= kMostScans)
      return;
    std::snprintf(of(jpeg).said, sizeof(of(jpeg).said), "it has more than %d scans", kMostScans);
    of(jpeg).fail();
  }

  /// Ignores the profile of the inks. Adobe's programs, which write most of these, store inverted values.
  void to_rgb(const uint8_t* inks, uint8_t* texels) const {
    const uint32_t flip = jpeg_.saw_Adobe_marker ? 0 : 255;
    for (size_t x = 0; x < width; ++x)
      for (size_t c = 0; c < 3; ++c)
        texels[3 * x + c] = uint8_t(((inks[4 * x + c] ^ flip) * (inks[4 * x + 3] ^ flip) + 127) / 255);
  }

  std::string_view bytes_;
  jpeg_decompress_struct jpeg_{};
  jpeg_error_mgr handlers_{};
  jpeg_progress_mgr progress_{};
};

/// Animations are refused.
class WebpDecoder {
 public:
  uint32_t width = 0, height = 0;
  char said[JMSG_LENGTH_MAX] = "";

  static bool is_one(std::string_view bytes) {
    return bytes.size() >= 12 && bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WEBP";
  }

  explicit WebpDecoder(std::string_view bytes) : bytes_(bytes) {}

  bool read_header() {
    WebPBitstreamFeatures features;
    if (!fine(WebPGetFeatures(data(), bytes_.size(), &features))) return false;
    if (features.has_animation) return fine(VP8_STATUS_UNSUPPORTED_FEATURE);
    width = uint32_t(features.width);
    height = uint32_t(features.height);
    has_alpha_ = features.has_alpha != 0;
    return true;
  }
  bool read_texels(uint8_t* texels) { return decode(MODE_RGB, texels, size_t{3} * width); }
  bool has_alpha() const { return has_alpha_; }
  bool read_alpha(uint16_t* alpha) {
    std::vector<uint8_t> colors(size_t{4} * width * height);
    if (!decode(MODE_RGBA, colors.data(), size_t{4} * width)) return false;
    for (size_t i = 0; i < size_t{width} * height; ++i) alpha[i] = uint16_t(colors[4 * i + 3] * 257);
    return true;
  }

 private:
  const uint8_t* data() const { return reinterpret_cast<const uint8_t*>(bytes_.data()); }

  bool decode(WEBP_CSP_MODE mode, uint8_t* to, size_t row_bytes) {
    WebPDecoderConfig config;
    if (!WebPInitDecoderConfig(&config)) return fine(VP8_STATUS_INVALID_PARAM);
    config.output.colorspace = mode;
    config.output.is_external_memory = 1;
    config.output.u.RGBA = {to, int(row_bytes), row_bytes * height};
    return fine(WebPDecode(data(), bytes_.size(), &config));
  }

  /// Keeps libwebp's reason.
  bool fine(VP8StatusCode status) {
    constexpr const char* kReasons[] = {"",
                                        "Out of memory",
                                        "invalid parameters",
                                        "it is damaged",
                                        "it is an animation, or has features that are not known",
                                        "it was suspended",
                                        "it was aborted",
                                        "it ends too early"};
    if (status == VP8_STATUS_OK) return true;
    std::snprintf(said, sizeof(said), "%s",
                  size_t(status) < std::size(kReasons) ? kReasons[status] : "unknown");
    return false;
  }

  std::string_view bytes_;
  bool has_alpha_ = false;
};

/// Calls `read(decoder)` once the picture's size is known, unless nothing of it is `needed`.
template <class OneDecoder, class Result>
std::optional<Result> decode(std::string_view bytes, uint64_t& texels, std::string& why,
                             bool (*read)(OneDecoder& decoder, uint64_t wanted, Result& result),
                             bool (*needed)(const OneDecoder& decoder) = nullptr) {
  OneDecoder decoder(bytes);
  const auto refused = [&] {
    // Both only report it as text.
    if (std::strcmp(decoder.said, "Out of memory") == 0 ||
        std::string_view(decoder.said).starts_with("Insufficient memory"))
      throw std::bad_alloc();
    why = fmt::format("cannot be decoded ({})", decoder.said);
    return std::nullopt;
  };
  if (!decoder.read_header()) return refused();
  Result result{decoder.width, decoder.height, {}};
  if (needed && !needed(decoder)) return result;
  const uint64_t wanted = uint64_t{decoder.width} * decoder.height;
  if (wanted > texels) {
    why = fmt::format("has {} x {} pixels, more than the limit ({} per file)", decoder.width, decoder.height,
                      kMostTexels);
    return std::nullopt;
  }
  texels -= wanted;  // also if it is damaged: it takes as long
  if (!read(decoder, wanted, result)) return refused();
  return result;
}

template <class OneDecoder>
bool read_colors(OneDecoder& decoder, uint64_t wanted, Texture& texture) {
  texture.texels.resize(3 * wanted);
  return decoder.read_texels(texture.texels.data());
}

template <class OneDecoder>
bool read_alpha(OneDecoder& decoder, uint64_t wanted, AlphaTexels& texels) {
  texels.alpha.resize(wanted);
  return decoder.read_alpha(texels.alpha.data());
}

template <class OneDecoder>
bool has_alpha(const OneDecoder& decoder) {
  return decoder.has_alpha();
}

template <class OneDecoder>
bool read_mask(OneDecoder& decoder, uint64_t wanted, AlphaTexels& texels) {
  if (decoder.has_alpha()) return read_alpha(decoder, wanted, texels);
  Texture texture;
  if (!read_colors(decoder, wanted, texture)) return false;
  texels.alpha.resize(wanted);
  for (uint64_t i = 0; i < wanted; ++i) {
    const uint8_t* const at = texture.texels.data() + 3 * i;
    texels.alpha[i] = uint16_t((at[0] + at[1] + at[2]) * 257 / 3);
  }
  return true;
}

std::nullopt_t refuse(std::string& why) {
  why = "is neither PNG nor JPEG nor WebP";
  return std::nullopt;
}

}  // namespace

std::optional<Texture> decode_image(std::string_view bytes, uint64_t& texels, std::string& why) {
  if (PngDecoder::is_one(bytes)) return decode(bytes, texels, why, read_colors<PngDecoder>);
  if (JpegDecoder::is_one(bytes)) return decode(bytes, texels, why, read_colors<JpegDecoder>);
  if (WebpDecoder::is_one(bytes)) return decode(bytes, texels, why, read_colors<WebpDecoder>);
  return refuse(why);
}

std::optional<AlphaTexels> decode_alpha(std::string_view bytes, uint64_t& texels, std::string& why) {
  if (PngDecoder::is_one(bytes))
    return decode(bytes, texels, why, read_alpha<PngDecoder>, has_alpha<PngDecoder>);
  if (JpegDecoder::is_one(bytes))
    return decode(bytes, texels, why, read_alpha<JpegDecoder>, has_alpha<JpegDecoder>);
  if (WebpDecoder::is_one(bytes))
    return decode(bytes, texels, why, read_alpha<WebpDecoder>, has_alpha<WebpDecoder>);
  return refuse(why);
}

std::optional<AlphaTexels> decode_mask(std::string_view bytes, uint64_t& texels, std::string& why) {
  if (PngDecoder::is_one(bytes)) return decode(bytes, texels, why, read_mask<PngDecoder>);
  if (JpegDecoder::is_one(bytes)) return decode(bytes, texels, why, read_mask<JpegDecoder>);
  if (WebpDecoder::is_one(bytes)) return decode(bytes, texels, why, read_mask<WebpDecoder>);
  return refuse(why);
}

}  // namespace nif::mesh::detail
