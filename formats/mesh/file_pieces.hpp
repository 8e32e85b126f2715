// A file as a sequence of pieces, so that a large file can be changed without a copy.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nif::mesh {

/// Most pieces are views of bytes that somebody else keeps. Can be moved, not copied.
class FilePieces {
 public:
  FilePieces() = default;
  FilePieces(FilePieces&&) = default;
  FilePieces& operator=(FilePieces&&) = default;

  /// The bytes must stay where they are for as long as this lives.
  void refer(std::string_view bytes) {
    if (!bytes.empty()) pieces_.push_back(bytes);
  }
  void own(std::string bytes) { refer(hold(std::move(bytes))); }
  /// Keeps bytes that a piece may refer to later.
  std::string_view hold(std::string bytes) { return owned_.emplace_back(std::move(bytes)); }

  const std::vector<std::string_view>& pieces() const { return pieces_; }

  uint64_t size() const {
    uint64_t size = 0;
    for (const std::string_view piece : pieces_) size += piece.size();
    return size;
  }

  std::string joined() const {
    std::string out;
    out.reserve(size());
    for (const std::string_view piece : pieces_) out += piece;
    return out;
  }

 private:
  std::deque<std::string> owned_;  // whose strings do not move when it grows
  std::vector<std::string_view> pieces_;
};

}  // namespace nif::mesh
