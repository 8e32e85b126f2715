// Rays of .npy files (https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html): arrays in
// either order of dimensions and of bytes. Python would evaluate the text of the header; here it is only
// parsed.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include "formats/base/status.hpp"
#include "tools/query/input_stream.hpp"
#include "tools/query/ray_files.hpp"
#include "tools/query/ray_line.hpp"

namespace nif::tools {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t kRows = 65536;           // read at a time
constexpr size_t kLongestHeader = 65536;  // bytes; numpy writes 118 for such an array
constexpr uint64_t kMostRows = uint64_t{1} << 56;

struct Layout {
  bool doubles = false, swapped = false, by_columns = false;
  uint64_t rows = 0;
  size_t columns = 0;
  size_t element_bytes() const { return doubles ? 8 : 4; }
  size_t row_bytes() const { return columns * element_bytes(); }
};

class Header {
 public:
  Header(std::string_view text, const std::string& file) : rest_(text), file_(file) {}

  Layout parse() {
    Layout layout;
    bool type = false, order = false, shape = false;
    need('{');
    while (!take('}')) {
      const std::string_view key = text();
      need(':');
      if (key == "descr" && !std::exchange(type, true))
        read_type(layout);
      else if (key == "fortran_order" && !std::exchange(order, true))
        layout.by_columns = boolean();
      else if (key == "shape" && !std::exchange(shape, true))
        read_shape(layout);
      else
        refuse(fmt::format("the header has {}, or has it twice", shown(key)));
      if (take(',')) continue;
      need('}');
      break;
    }
    skip_blanks();
    if (!rest_.empty()) refuse("the header has text after its '}'");
    if (!type || !order || !shape) refuse("the header lacks 'descr', 'fortran_order' or 'shape'");
    return layout;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Status::malformed_rays, file_ + ": " + what);
  }
  void skip_blanks() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size())); }
  bool take(char c) {
    skip_blanks();
    if (!rest_.starts_with(c)) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void need(char c) {
    if (!take(c)) refuse(fmt::format("the header is damaged: '{}' is needed before {}", c, shown(rest_)));
  }
  std::string_view text() {
    const char quote = take('"') ? '"' : '\'';
    if (quote == '\'') need('\'');
    const size_t length = rest_.find(quote);
    if (length == rest_.npos) refuse("the header is damaged: a string does not end");
    const std::string_view inside = rest_.substr(0, length);
    rest_.remove_prefix(length + 1);
    return inside;
  }
  bool boolean() {
    skip_blanks();
    for (const auto& [word, value] : {std::pair{"True", true}, std::pair{"False", false}})
      if (rest_.starts_with(word)) {
        rest_.remove_prefix(std::string_view(word).size());
        return value;
      }
    refuse("the header is damaged: fortran_order is neither True nor False");
  }

  void read_type(Layout& layout) {
    skip_blanks();
    if (rest_.starts_with('['))
      refuse("is an array of structures; an array of N x 6 or N x 8 floats is needed");
    const std::string_view type = text();
    const bool order = type.size() == 3 && std::string_view("<>=|").find(type[0]) != type.npos;
    const std::string_view kind = order ? type.substr(1) : type;
    if (kind != "f4" && kind != "f8")
      refuse(fmt::format("its elements are {}; float32 or float64 is needed (a.astype(numpy.float32))",
                         shown(type)));
    layout.doubles = kind == "f8";
    layout.swapped = order && type[0] == '>';
  }

  /// A one-dimensional array is one ray.
  void read_shape(Layout& layout) {
    std::vector<uint64_t> sizes;
    need('(');
    while (!take(')')) {
      skip_blanks();
      uint64_t size = 0;
      size_t digits = 0;
      for (; digits < rest_.size() && std::isdigit(uint8_t(rest_[digits])); ++digits) {
        size = size * 10 + uint64_t(rest_[digits] - '0');
        if (size > kMostRows) refuse("its shape is larger than any file");
      }
      if (digits == 0) refuse("the header is damaged: the shape is no tuple of numbers");
      rest_.remove_prefix(digits);
      take('L');  // Python 2
      sizes.push_back(size);
      if (take(',')) continue;
      need(')');
      break;
    }
    if (sizes.size() == 1) sizes.insert(sizes.begin(), 1);
    if (sizes.size() != 2 || (sizes[1] != 6 && sizes[1] != 8)) {
      std::string shape;
      for (const uint64_t size : sizes) shape += (shape.empty() ? "" : " x ") + std::to_string(size);
      refuse(fmt::format("its shape is {}; N x 6 (ox oy oz dx dy dz) or N x 8 (and tmin tmax) is needed",
                         shape.empty() ? "that of one number" : shape));
    }
    layout.rows = sizes[0];
    layout.columns = size_t(sizes[1]);
  }

  std::string_view rest_;
  const std::string& file_;
};

class NpyRays : public RaySource {
 public:
  explicit NpyRays(std::unique_ptr<InputStream> input) : input_(std::move(input)) {
    layout_ = read_header();
    const uint64_t bytes = layout_.rows * layout_.row_bytes();
    if (const auto rest = input_->rest()) {
      if (*rest < bytes) truncated(*rest);
      if (*rest > bytes) too_long();
    } else if (layout_.by_columns) {
      spool(bytes);
    }
  }

  bool next(std::vector<NifRay>& rays) override {
    const auto count = size_t(std::min<uint64_t>(kRows, layout_.rows - done_));
    if (count == 0) {
      std::byte more;
      if (!layout_.by_columns && input_->read({&more, 1}) != 0) too_long();
      return false;
    }
    elements_.resize(count * layout_.row_bytes());
    rays.resize(count);
    layout_.by_columns ? read_columns(count) : read_rows();
    layout_.doubles ? convert<uint64_t, double>(rays) : convert<uint32_t, float>(rays);
    done_ += count;
    return true;
  }

  std::optional<uint64_t> count() const override { return layout_.rows; }
  double fraction() const override { return double(done_) / double(std::max<uint64_t>(layout_.rows, 1)); }

 private:
  [[noreturn]] void truncated(uint64_t bytes) const {
    throw Error(Status::file_truncated,
                fmt::format("{}: ends in row {} of the {} that its header states", input_->name(),
                            (layout_.by_columns ? 0 : bytes / layout_.row_bytes()) + 1, layout_.rows));
  }
  [[noreturn]] void too_long() const {
    throw Error(Status::malformed_rays, fmt::format("{}: continues after the {} rows that its header states",
                                                    input_->name(), layout_.rows));
  }

  Layout read_header() {
    const std::string& file = input_->name();
    std::byte start[8];
    uint32_t length = 0;
    const auto need = [&](std::span<std::byte> to) {
      if (input_->read_fully(to) != to.size())
        throw Error(Status::file_truncated, file + ": ends within its header");
    };
    need(start);
    const auto version = uint8_t(start[6]);
    if (version < 1 || version > 3)
      throw Error(Status::malformed_rays,
                  fmt::format("{}: .npy version {}; 1 to 3 are known", file, version));
    need(std::as_writable_bytes(std::span(&length, 1)).first(version == 1 ? 2 : 4));
    if (length > kLongestHeader)
      throw Error(Status::malformed_rays,
                  fmt::format("{}: a header of {} bytes; at most {} are read", file, length, kLongestHeader));
    std::string text(length, '\0');
    need(std::as_writable_bytes(std::span(text)));
    return Header(text, file).parse();
  }

  /// Copies input that cannot be read out of order to a temporary file.
  void spool(uint64_t bytes) {
    spooled_.emplace();
    std::vector<std::byte> piece(1 << 20);
    while (const size_t count = input_->read(piece)) {
      if (spooled_->size() + count > bytes) too_long();
      spooled_->write(std::span(piece).first(count));
    }
    if (spooled_->size() < bytes) truncated(spooled_->size());
  }

  void read_rows() {
    const size_t read = input_->read_fully(elements_);
    if (read != elements_.size()) truncated(done_ * layout_.row_bytes() + read);
  }

  void read_columns(size_t count) {
    const size_t bytes = count * layout_.element_bytes();
    for (size_t c = 0; c < layout_.columns; ++c) {
      const uint64_t offset = (c * layout_.rows + done_) * layout_.element_bytes();
      const std::span<std::byte> to = std::span(elements_).subspan(c * bytes, bytes);
      if (spooled_)
        spooled_->read_at(offset, to);
      else if (input_->read_at(offset, to) != bytes)
        truncated(0);
    }
  }

  template <class Bits, class Float>
  float at(size_t element) const {
    Bits bits;
    std::memcpy(&bits, &elements_[element * sizeof(bits)], sizeof(bits));
    if (layout_.swapped)
      bits = sizeof(bits) == 4 ? Bits(__builtin_bswap32(uint32_t(bits))) : Bits(__builtin_bswap64(bits));
    return float(std::bit_cast<Float>(bits));
  }

  template <class Bits, class Float>
  void convert(std::vector<NifRay>& rays) const {
    const size_t next_row = layout_.by_columns ? 1 : layout_.columns;
    const size_t next_column = layout_.by_columns ? rays.size() : 1;
    for (size_t i = 0; i < rays.size(); ++i) {
      const auto number = [&](size_t column) { return at<Bits, Float>(i * next_row + column * next_column); };
      NifRay& ray = rays[i];
      for (size_t a = 0; a < 3; ++a) {
        ray.origin[a] = number(a);
        ray.direction[a] = number(3 + a);
      }
      ray.tmin = layout_.columns == 8 ? number(6) : 0;
      ray.tmax = layout_.columns == 8 ? number(7) : std::numeric_limits<float>::infinity();
    }
  }

  std::unique_ptr<InputStream> input_;
  Layout layout_;
  std::optional<TemporaryFile> spooled_;
  std::vector<std::byte> elements_;
  uint64_t done_ = 0;
};

}  // namespace

std::unique_ptr<RaySource> npy_rays(std::unique_ptr<InputStream> input) {
  return std::make_unique<NpyRays>(std::move(input));
}

}  // namespace nif::tools
