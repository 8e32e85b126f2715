// Payloads that may be coded: how readers take them, and how writers choose.
#pragma once

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "formats/nif/part_bytes.hpp"
#include "formats/nif/records.hpp"

namespace nif::format {

/// The next payload; a record's `forms` say whether it is coded. `bytes`: its uncoded size.
inline Bytes take_payload(Payloads& payloads, const Payload& payload, bool coded, uint64_t bytes,
                          const char* name, const Place& place) {
  return payloads.next(payload, coded ? payload.bytes : bytes, name, place);
}

/// Where a field reads a payload: in the file, or, if it is coded, in memory that decode(memory) has filled.
/// `bytes` is its size there.
template <class Decode>
const std::byte* usable(Bytes payload, bool coded, uint64_t bytes, const char* name, const Place& place,
                        DecodedPayloads& decoded, PayloadBytes& taken, const Decode& decode) {
  taken.file += payload.size();
  if (!coded) return payload.data();
  std::byte* const to = decoded.add(bytes, taken);
  if (!decode(to))
    place.damaged(Rule::not_as_encoded, std::string(name) + " payload is not what an encoder makes");
  return to;
}

/// A coded payload; empty if it must stay uncoded.
using Coded = std::vector<std::byte>;

/// Empty if it is no smaller than `bytes`.
inline Coded if_smaller(Coded coded, uint64_t bytes) {
  return coded.size() < bytes ? std::move(coded) : Coded();
}

/// Whether a decoded array equals the original.
template <class T>
bool equal(const T* coded, const std::vector<T>& data) {
  return data.empty() || std::memcmp(coded, data.data(), data.size() * sizeof(T)) == 0;
}

}  // namespace nif::format
