// Answers as CSV, as JSON lines and as .npy, to a file or to standard output.
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

/// A file, written whole or not at all; or standard output, where bytes go at once. Throws nif::Error.
class AnswerStream {
 public:
  /// "": standard output.
  explicit AnswerStream(const std::string& path);
  void write(std::span<const std::byte> bytes);
  /// Once, at the end.
  void commit();

 private:
  std::optional<OutputFile> file_;
};

class AnswerWriter {
 public:
  virtual ~AnswerWriter() = default;
  virtual void write(const Answers& answers) = 0;
  /// Once, after the last answers.
  virtual void end() {}
};

/// `count`: how many answers there will be, where that is known. `hits`: with first hits. The stream outlives
/// the writer.
std::unique_ptr<AnswerWriter> make_answer_writer(AnswerFormat format, bool hits,
                                                 std::optional<uint64_t> count, AnswerStream& out);

}  // namespace nif::tools
