// Rays of CSV and of JSON lines. Reads the file in chunks and cuts them into lines, which all threads parse.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <mutex>
#include <span>
#include <string_view>
#include <utility>

#include "formats/base/status.hpp"
#include "tools/query/input_stream.hpp"
#include "tools/query/ray_files.hpp"
#include "tools/query/ray_line.hpp"

namespace nif::tools {
namespace {

constexpr size_t kPiece = 4 << 20;      // most bytes read at a time
constexpr size_t kLongestLine = 65536;  // bytes

class TextRays : public RaySource {
 public:
  explicit TextRays(std::unique_ptr<InputStream> input) : input_(std::move(input)), all_(input_->rest()) {
    const std::span<const std::byte> start = input_->peek(3);
    std::byte mark[3];
    if (start.size() == 3 && std::memcmp(start.data(), "\xef\xbb\xbf", 3) == 0) input_->read(mark);
  }

  bool next(std::vector<NifRay>& rays) override {
    lines_.clear();
    while (lines_.empty())
      if (!read_lines()) return false;
    rays.resize(lines_.size());
    parse(rays);
    return true;
  }

  double fraction() const override { return all_ ? double(input_->position()) / double(*all_ + 1) : 0; }

 private:
  enum class Form { unknown, table, json };
  struct Line {
    std::string_view text;
    uint64_t number;
  };

  [[noreturn]] void refuse(uint64_t line, const std::string& what) const {
    throw Error(Status::malformed_rays, fmt::format("{}: line {}: {}", input_->name(), line, what));
  }

  [[noreturn]] void refuse_longer(uint64_t line) const {
    refuse(line, fmt::format("is longer than {} bytes", kLongestLine));
  }

  /// Reads a chunk and cuts it into the lines that have rays, if any. Returns false at the end.
  bool read_lines() {
    if (full_) buffer_.resize(std::min(2 * buffer_.size(), kPiece));
    std::memmove(buffer_.data(), buffer_.data() + used_, size_ - used_);
    size_ -= used_;
    used_ = 0;  // no line is complete yet
    bool ended = false;
    // A program that waits for answers has sent complete lines: do not wait for more than these.
    const size_t enough = buffer_.size() - kLongestLine;
    while (!ended && size_ < enough && (used_ == 0 ? size_ <= kLongestLine : input_->ready())) {
      const auto read = input_->read(std::as_writable_bytes(std::span(buffer_).subspan(size_)));
      const size_t end = std::string_view(buffer_.data() + size_, read).find_last_of("\r\n");
      if (end != std::string_view::npos) used_ = size_ + end + 1;
      size_ += read;
      ended = read == 0;
    }
    full_ = size_ >= enough;
    if (ended) used_ = size_;
    if (used_ == 0 && size_ > kLongestLine) refuse_longer(number_ + 1);
    cut({buffer_.data(), used_});
    return !ended || size_ > 0;
  }

  void cut(std::string_view text) {
    while (!text.empty()) {
      if (std::exchange(after_return_, false) && text.front() == '\n') {
        text.remove_prefix(1);
        continue;
      }
      const size_t length = std::min(text.find_first_of("\r\n"), text.size());
      const std::string_view line = text.substr(0, length);
      after_return_ = length < text.size() && text[length] == '\r';
      text.remove_prefix(std::min(length + 1, text.size()));
      ++number_;
      take(line);
    }
  }

  void take(std::string_view line) {
    if (line.size() > kLongestLine) refuse_longer(number_);
    if (form_ != Form::json) line = line.substr(0, line.find('#'));
    const size_t first = line.find_first_not_of(" \t");
    if (first == line.npos || line[first] == '#') return;
    if (form_ == Form::unknown) {
      const bool json = line[first] == '{' || line[first] == '[';
      form_ = json ? Form::json : Form::table;
      try {
        if (!json && table_.begin(line)) return;
      } catch (const LineProblem& problem) {
        refuse(number_, problem.what);
      }
    }
    lines_.push_back({line, number_});
  }

  void parse(std::span<NifRay> rays) const {
    constexpr size_t kShare = 512;
    std::mutex mutex;
    size_t first = lines_.size();
    std::string what;
    tbb::parallel_for(size_t{0}, (lines_.size() + kShare - 1) / kShare, [&](size_t share) {
      size_t i = share * kShare;
      try {
        for (const size_t end = std::min(i + kShare, lines_.size()); i < end; ++i)
          rays[i] = form_ == Form::json ? parse_json_ray(lines_[i].text) : table_.parse(lines_[i].text);
      } catch (const LineProblem& problem) {
        const std::lock_guard lock(mutex);
        if (i >= first) return;
        first = i;
        what = problem.what;
      }
    });
    if (first < lines_.size()) refuse(lines_[first].number, what);
  }

  std::unique_ptr<InputStream> input_;
  std::optional<uint64_t> all_;
  std::vector<char> buffer_ = std::vector<char>(2 * kLongestLine + 1);
  size_t size_ = 0, used_ = 0;  ///< bytes in buffer_, and those that lines_ covers
  uint64_t number_ = 0;         ///< number of lines so far
  bool full_ = false, after_return_ = false;
  Form form_ = Form::unknown;
  RayTable table_;
  std::vector<Line> lines_;
};

}  // namespace

std::unique_ptr<RaySource> text_rays(std::unique_ptr<InputStream> input) {
  return std::make_unique<TextRays>(std::move(input));
}

}  // namespace nif::tools
