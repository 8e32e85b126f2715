// Decodes base64, in the standard and in the URL alphabet, and percent-encoded file names. URIs with "://"
// are refused: nothing is ever fetched.
#include "formats/mesh/gltf/uri.hpp"

#include <cctype>
#include <cstdint>

namespace nif::mesh::detail {
namespace {

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

std::optional<std::string> decode_base64(std::string_view text) {
  while (text.ends_with('=')) text.remove_suffix(1);
  std::string out;
  out.reserve(text.size() / 4 * 3 + 3);
  uint32_t group = 0;
  int bits = 0;
  for (const char c : text) {
    const int digit = base64_digit(c);
    if (digit < 0) return std::nullopt;
    group = (group << 6 | static_cast<uint32_t>(digit)) & 0xFFFFFF;
    if ((bits += 6) >= 8) out.push_back(static_cast<char>(group >> (bits -= 8) & 0xFF));
  }
  return out;
}

/// "a%20b.bin" names the file "a b.bin".
std::string decode_percent(std::string_view uri) {
  const auto digit = [](char c) { return c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10; };
  std::string out;
  for (size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[i + 1])) &&
        std::isxdigit(static_cast<unsigned char>(uri[i + 2]))) {
      out.push_back(static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2])));
      i += 2;
    } else {
      out.push_back(uri[i]);
    }
  }
  return out;
}

}  // namespace

std::optional<std::string> decode_data_uri(std::string_view uri) {
  constexpr std::string_view kMark = ";base64,";
  const size_t mark = uri.find(kMark);
  return mark == std::string_view::npos ? std::nullopt : decode_base64(uri.substr(mark + kMark.size()));
}

std::optional<std::filesystem::path> local_file(const Input& input, const std::string& uri) {
  const std::string name = decode_percent(uri);
  if (name.empty() || name.find('\0') != std::string::npos || uri.find("://") != std::string::npos)
    return std::nullopt;
  return input.file.parent_path() / name;
}

}  // namespace nif::mesh::detail
