// Writes a file in chunks, for text formats. Internal to formats/mesh.
#pragma once

#include <atomic>
#include <charconv>
#include <concepts>
#include <cstring>
#include <functional>
#include <string>
#include <string_view>

#include "formats/base/output_file.hpp"
#include "formats/base/status.hpp"

namespace nif::mesh::detail {

/// Buffers its input and writes it a megabyte at a time.
class Stream {
 public:
  /// `total` is the number of steps that will be reported.
  Stream(const std::string& path, uint64_t total, const std::function<void(double)>& progress,
         const std::atomic<bool>& cancel)
      : path_(path), file_(path), total_(total), progress_(progress), cancel_(cancel) {
    buffer_.reserve(kPiece + 256);
  }

  void put(std::string_view text) { buffer_ += text; }
  void put(char c) { buffer_ += c; }
  /// Writes the fewest digits that read back as the same number.
  void put(float number) { put_number(number); }
  void put(double number) { put_number(number); }
  void put(std::integral auto number) { put_number(number); }
  /// Writes the bytes of a value in memory order.
  template <class T>
  void put_bytes(const T& value) {
    buffer_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }

  /// To be called after each vertex or triangle: writes, reports progress and checks for cancellation now and
  /// then.
  void step() {
    ++done_;
    if (buffer_.size() >= kPiece) flush();
  }
  /// Returns the size of the file.
  uint64_t commit() {
    flush();
    file_.commit();
    return bytes_;
  }

 private:
  static constexpr size_t kPiece = 1 << 20;

  template <class T>
  void put_number(T number) {
    char text[32];
    const auto [end, error] = std::to_chars(text, text + sizeof(text), number);
    buffer_.append(text, end);
  }

  void flush() {
    if (cancel_) throw Error(Status::interrupted, path_ + ": the writing was cancelled");
    file_.write(std::as_bytes(std::span(buffer_)));
    bytes_ += buffer_.size();
    buffer_.clear();
    progress_(total_ == 0 ? 1 : double(done_) / double(total_));
  }

  std::string path_;
  OutputFile file_;
  std::string buffer_;
  uint64_t total_, done_ = 0, bytes_ = 0;
  const std::function<void(double)>& progress_;
  const std::atomic<bool>& cancel_;
};

}  // namespace nif::mesh::detail
