// Writes answers as CSV, JSON lines or .npy, to a file or to standard output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "formats/base/output_file.hpp"
#include "tools/query/answers.hpp"

namespace nif::tools {

enum class AnswerFormat { csv, jsonl, npy };

/// A file that is written whole or not at all; or standard output, written at once. Throws nif::Error.
class AnswerStream {
 public:
  /// "" means standard output.
  explicit AnswerStream(const std::string& path);
  void write(std::span<const std::byte> bytes);
  /// To be called once, at the end.
  void commit();

 private:
  std::optional<OutputFile> file_;
};

class AnswerWriter {
 public:
  virtual ~AnswerWriter() = default;
  virtual void write(const Answers& answers) = 0;
  /// To be called once, after the last answers.
  virtual void end() {}
};

/// `count`: the number of answers, if known. `hits`: with first hits. The stream must outlive the writer.
std::unique_ptr<AnswerWriter> make_answer_writer(AnswerFormat format, bool hits,
                                                 std::optional<uint64_t> count, AnswerStream& out);

}  // namespace nif::tools
