// All threads format rows of text, which are then written in order. A .npy states its length first; if that
// is unknown, rows wait in a temporary file.
#include "tools/query/answer_files.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>
#include <vector>

#include "formats/base/status.hpp"
#include "tools/query/input_stream.hpp"

namespace nif::tools {
namespace {

using namespace std::string_view_literals;

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kColumns = "visible,certain,probability";
constexpr std::string_view kHitColumns = ",t,nx,ny,nz,instance,object,triangle";

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

/// Rows of text, formatted by all threads at the same time.
class TextWriter : public AnswerWriter {
 public:
  TextWriter(bool hits, AnswerStream& out) : hits_(hits), out_(out) {}

  void write(const Answers& answers) override {
    constexpr size_t kShare = 1024;
    rows_.resize((answers.size() + kShare - 1) / kShare);
    tbb::parallel_for(size_t{0}, rows_.size(), [&](size_t share) {
      rows_[share].clear();
      const size_t end = std::min((share + 1) * kShare, answers.size());
      for (size_t i = share * kShare; i < end; ++i) row(answers, i, rows_[share]);
    });
    for (const std::string& rows : rows_) out_.write(bytes_of(rows));
  }

 protected:
  virtual void row(const Answers& answers, size_t i, std::string& to) const = 0;

  /// Uses the fewest digits that still read back as the same value.
  template <class Number>
  static void put(Number value, std::string& to) {
    char digits[32];
    to.append(digits, std::to_chars(digits, digits + sizeof(digits), value).ptr);
  }

  const bool hits_;
  AnswerStream& out_;

 private:
  std::vector<std::string> rows_;
};

class CsvWriter : public TextWriter {
 public:
  CsvWriter(bool hits, AnswerStream& out) : TextWriter(hits, out) {
    out_.write(bytes_of(kColumns));
    if (hits) out_.write(bytes_of(kHitColumns));
    out_.write(bytes_of("\n"));
  }

 private:
  void row(const Answers& a, size_t i, std::string& to) const override {
    to += a.visible[i] ? "1,"sv : "0,"sv;
    to += a.certain[i] ? "1,"sv : "0,"sv;
    put(a.probability[i], to);
    if (hits_ && a.instance[i] == NIF_NONE) {
      to += ",,,,,,,"sv;
    } else if (hits_) {
      for (const float value : {a.t[i], a.normal[3 * i], a.normal[3 * i + 1], a.normal[3 * i + 2]}) {
        to += ',';
        put(value, to);
      }
      for (const uint32_t value : {a.instance[i], a.object[i], a.triangle[i]}) {
        to += ',';
        if (value != NIF_NONE) put(value, to);
      }
    }
    to += '\n';
  }
};

class JsonLinesWriter : public TextWriter {
 public:
  using TextWriter::TextWriter;

 private:
  void row(const Answers& a, size_t i, std::string& to) const override {
    to += a.visible[i] ? R"({"visible":true,"certain":)"sv : R"({"visible":false,"certain":)"sv;
    to += a.certain[i] ? R"(true,"probability":)"sv : R"(false,"probability":)"sv;
    put(a.probability[i], to);
    if (hits_) {
      const bool hit = a.instance[i] != NIF_NONE;
      const auto field = [&](std::string_view name, auto value, bool known) {
        to += ",\""sv;
        to += name;
        to += "\":"sv;
        known ? put(value, to) : void(to += "null"sv);
      };
      field("t", a.t[i], hit);
      field("nx", a.normal[3 * i], hit);
      field("ny", a.normal[3 * i + 1], hit);
      field("nz", a.normal[3 * i + 2], hit);
      field("instance", a.instance[i], hit);
      field("object", a.object[i], hit);
      field("triangle", a.triangle[i], a.triangle[i] != NIF_NONE);
    }
    to += "}\n"sv;
  }
};

/// One structured array. A .npy states its length before the elements; if the length is unknown, the elements
/// wait in a temporary file.
class NpyWriter : public AnswerWriter {
 public:
  NpyWriter(bool hits, std::optional<uint64_t> count, AnswerStream& out) : hits_(hits), out_(out) {
    count ? write_header(*count) : void(waiting_.emplace());
  }

  void write(const Answers& a) override {
    rows_.resize(a.size() * row_bytes());
    std::byte* at = rows_.data();
    const auto put = [&](const auto& values, size_t i, size_t count) {
      std::memcpy(at, &values[i], count * sizeof(values[i]));
      at += count * sizeof(values[i]);
    };
    for (size_t i = 0; i < a.size(); ++i) {
      put(a.visible, i, 1);
      put(a.certain, i, 1);
      put(a.probability, i, 1);
      if (!hits_) continue;
      put(a.t, i, 1);
      put(a.normal, 3 * i, 3);
      put(a.instance, i, 1);
      put(a.object, i, 1);
      put(a.triangle, i, 1);
    }
    waiting_ ? waiting_->write(rows_) : out_.write(rows_);
  }

  void end() override {
    if (!waiting_) return;
    write_header(waiting_->size() / row_bytes());
    rows_.resize(1 << 20);
    for (uint64_t done = 0; done < waiting_->size(); done += rows_.size()) {
      rows_.resize(size_t(std::min<uint64_t>(rows_.size(), waiting_->size() - done)));
      waiting_->read_at(done, rows_);
      out_.write(rows_);
    }
  }

 private:
  size_t row_bytes() const { return hits_ ? 34 : 6; }

  void write_header(uint64_t count) {
    std::string fields = "('visible', '|b1'), ('certain', '|b1'), ('probability', '<f4')";
    if (hits_)
      fields +=
          ", ('t', '<f4'), ('nx', '<f4'), ('ny', '<f4'), ('nz', '<f4'), ('instance', '<u4'), ('object', "
          "'<u4'), ('triangle', '<u4')";
    std::string header =
        fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields, count);
    constexpr size_t kStart = 10, kAlignment = 64;  // offset and alignment of the elements in numpy's format
    header.resize((kStart + header.size() + kAlignment) / kAlignment * kAlignment - kStart - 1, ' ');
    header += '\n';
    out_.write(bytes_of("\x93NUMPY\x01\x00"sv));
    const auto length = uint16_t(header.size());
    out_.write(std::as_bytes(std::span(&length, 1)));
    out_.write(bytes_of(header));
  }

  bool hits_;
  AnswerStream& out_;
  std::optional<TemporaryFile> waiting_;
  std::vector<std::byte> rows_;
};

}  // namespace

AnswerStream::AnswerStream(const std::string& path) {
  if (!path.empty()) file_.emplace(path);
}

void AnswerStream::write(std::span<const std::byte> bytes) {
  if (file_) return file_->write(bytes);
  while (!bytes.empty()) {
    const ssize_t done = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0)
      throw Error(Status::output_not_writable, std::string("standard output: cannot be written: ") +
                                                   std::strerror(done < 0 ? errno : EIO));
    bytes = bytes.subspan(size_t(done));
  }
}

void AnswerStream::commit() {
  if (file_) file_->commit();
}

std::unique_ptr<AnswerWriter> make_answer_writer(AnswerFormat format, bool hits,
                                                 std::optional<uint64_t> count, AnswerStream& out) {
  switch (format) {
    case AnswerFormat::csv:
      return std::make_unique<CsvWriter>(hits, out);
    case AnswerFormat::jsonl:
      return std::make_unique<JsonLinesWriter>(hits, out);
    case AnswerFormat::npy:
      return std::make_unique<NpyWriter>(hits, count, out);
  }
  throw Error(Status::internal, "no such format of answers");
}

}  // namespace nif::tools
