// Takes the .glb apart into JSON and binary, changes one of them, and puts it together with the right
// lengths. New values are often names and numbers that the reader looks for.
#include "tests/fuzz/mutate_gltf.hpp"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

namespace nif::test {
namespace {

using nlohmann::json;

constexpr uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;

uint32_t word_at(const uint8_t* at) {
  uint32_t word;
  std::memcpy(&word, at, sizeof word);
  return word;
}
void append(std::string& out, uint32_t word) {
  out.append(reinterpret_cast<const char*>(&word), sizeof word);
}

/// The container's reader bounds the depth, so recursion is safe.
bool is_deep(std::string_view text) {
  int depth = 0;
  for (const char c : text) {
    if (c == '{' || c == '[') ++depth;
    if (c == '}' || c == ']') --depth;
    if (depth > 40) return true;
  }
  return false;
}

/// Any value in it, with equal probability.
json* any_value(json& root, Random& random) {
  json* at = &root;
  while (at->is_structured() && !at->empty() && random.below(6) != 0) {
    auto next = at->begin();
    std::advance(next, ptrdiff_t(random.below(uint32_t(at->size()))));
    at = &*next;
  }
  return at;
}

void change_value(json& root, Random& random) {
  static const json kValues[] = {-1,
                                 0,
                                 1,
                                 2,
                                 3,
                                 4,
                                 7,
                                 16,
                                 64,
                                 255,
                                 5120,
                                 5121,
                                 5122,
                                 5123,
                                 5125,
                                 5126,
                                 65535,
                                 16777217,
                                 2147483647,
                                 4294967295u,
                                 18446744073709551615u,
                                 0.5,
                                 -0.0,
                                 1e-40,
                                 1e38,
                                 1e300,
                                 "",
                                 "x",
                                 "SCALAR",
                                 "VEC2",
                                 "VEC3",
                                 "VEC4",
                                 "MAT4",
                                 "ATTRIBUTES",
                                 "TRIANGLES",
                                 "INDICES",
                                 "OCTAHEDRAL",
                                 "QUATERNION",
                                 "EXPONENTIAL",
                                 "NONE",
                                 "data:application/octet-stream;base64,AAAA",
                                 "a%20b.bin",
                                 "../x.bin",
                                 nullptr,
                                 true,
                                 json::array(),
                                 json::object(),
                                 {0, 1, 2},
                                 {1, 0, 0, 0}};
  json* const value = any_value(root, random);
  switch (random.below(6)) {
    case 0:
      *value = kValues[random.below(uint32_t(std::size(kValues)))];
      break;
    case 1: {  // a value from elsewhere
      const json other = *any_value(root, random);
      *value = other;
      break;
    }
    case 2:
      if (value->is_array() && !value->empty())
        value->push_back((*value)[random.below(uint32_t(value->size()))]);
      break;
    case 3:
      if (value->is_array() && !value->empty())
        value->erase(size_t(random.below(uint32_t(value->size()))));
      else if (value->is_object() && !value->empty())
        value->erase(std::next(value->begin(), ptrdiff_t(random.below(uint32_t(value->size())))));
      break;
    case 4:
      if (value->is_number_integer())
        *value = value->get<int64_t>() + random.between(-4, 4);
      else if (value->is_number())
        *value = value->get<double>() * random.between(-2.0f, 2.0f);
      break;
    default: {
      static const char* const kKeys[] = {"skin",     "weights",  "targets",    "sparse",  "normalized",
                                          "matrix",   "rotation", "extensions", "indices", "mode",
                                          "children", "camera",   "material",   "extras",  "byteStride"};
      if (value->is_object())
        (*value)[kKeys[random.below(uint32_t(std::size(kKeys)))]] =
            kValues[random.below(uint32_t(std::size(kValues)))];
    }
  }
}

std::string mutate_text(std::string text, Random& random, MutateBytes mutate_bytes) {
  if (random.below(4) != 0 && !is_deep(text)) {
    json root = json::parse(text, nullptr, false);
    if (!root.is_discarded()) {
      for (uint32_t changes = 1 + random.below(3); changes > 0; --changes) change_value(root, random);
      return root.dump(-1, ' ', false, json::error_handler_t::replace);
    }
  }
  const size_t size = text.size();
  text.resize(size + 32);
  text.resize(mutate_bytes(reinterpret_cast<uint8_t*>(text.data()), size, text.size()));
  return text;
}

}  // namespace

size_t mutate_glb(uint8_t* data, size_t size, size_t room, unsigned seed, MutateBytes mutate_bytes) {
  std::string text, binary;
  bool has_binary = false;
  if (size < 12 || std::memcmp(data, "glTF", 4) != 0) return mutate_bytes(data, size, room);
  for (size_t at = 12; at + 8 <= size;) {
    const size_t length = std::min<size_t>(word_at(data + at), size - at - 8);
    const uint32_t kind = word_at(data + at + 4);
    const std::string chunk(reinterpret_cast<const char*>(data + at + 8), length);
    if (kind == kJson) text = chunk;
    if (kind == kBinary) binary = chunk, has_binary = true;
    at += 8 + length;
  }
  Random random(seed);
  if (has_binary && !binary.empty() && random.below(3) == 0) {
    const size_t before = binary.size();
    binary.resize(before + 32);
    binary.resize(mutate_bytes(reinterpret_cast<uint8_t*>(binary.data()), before, binary.size()));
  } else {
    text = mutate_text(std::move(text), random, mutate_bytes);
  }
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  std::string out("glTF");
  append(out, 2);
  append(out, uint32_t(12 + 8 + text.size() + (has_binary ? 8 + binary.size() : 0)));
  append(out, uint32_t(text.size()));
  append(out, kJson);
  out += text;
  if (has_binary) {
    append(out, uint32_t(binary.size()));
    append(out, kBinary);
    out += binary;
  }
  if (out.size() > room) return size;
  std::memcpy(data, out.data(), out.size());
  return out.size();
}

}  // namespace nif::test
