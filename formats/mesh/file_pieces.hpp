// Represents a file as a sequence of pieces, so that a large file can be edited without a copy.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nif::mesh {

/// Most pieces are views of bytes that somebody else owns. Can be moved, not copied.
class FilePieces {
 public:
  FilePieces() = default;
  FilePieces(FilePieces&&) = default;
  FilePieces& operator=(FilePieces&&) = default;

  /// The bytes must stay valid as long as this object.
  void refer(std::string_view bytes) {
    if (!bytes.empty()) pieces_.push_back(bytes);
  }
  void own(std::string bytes) { refer(hold(std::move(bytes))); }
  /// Owns bytes for a piece that is added later.
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
  std::deque<std::string> owned_;  // a deque, so that the strings do not move when it grows
  std::vector<std::string_view> pieces_;
};

}  // namespace nif::mesh
