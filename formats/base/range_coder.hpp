// Entropy coding of bits: an adaptive binary range coder (after Martin 1979, and Pavlov's LZMA). A bit that
// its model expects takes little space, and models learn as they go. Everything is in integers, so that the
// bytes are the same on every machine.
//
// The encoder and the decoder have the same functions, so that the models of a kind of data are written once,
// for both: bit(model, value) returns `value` when it encodes, and the encoded value when it decodes.
//
// docs/format.md, "Bits", describes all of it; docs/results/coding.md says what its constants are worth.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace nif {

/// The probability that a bit is 1, estimated from the bits before it: the mean of two estimates. One forgets
/// quickly; the other weighs all bits equally until it has seen many.
class BitModel {
 public:
  /// In units of 2^-16; never 0 or 2^16.
  uint32_t probability() const { return (uint32_t{quick_} + steady_) >> 1; }
  void learn(bool bit) {
    const uint32_t share = kShares[seen_];
    seen_ = uint8_t(seen_ + (seen_ + 1u < kShares.size()));
    if (bit) {
      quick_ = uint16_t(quick_ + ((kOne - quick_) >> kQuick));
      steady_ = uint16_t(steady_ + ((kOne - steady_) * share >> 16));
    } else {
      quick_ = uint16_t(quick_ - (quick_ >> kQuick));
      steady_ = uint16_t(steady_ - (steady_ * share >> 16));
    }
  }

 private:
  static constexpr uint32_t kOne = 1 << 16, kQuick = 4;
  /// Weight of the next bit in units of 2^-16, by the number of bits so far: 1 / (bits + 1.5).
  static constexpr std::array<uint16_t, 255> kShares = [] {
    std::array<uint16_t, 255> shares{};
    for (uint32_t bits = 0; bits < shares.size(); ++bits) shares[bits] = uint16_t(2 * kOne / (2 * bits + 3));
    return shares;
  }();

  uint16_t quick_ = kOne / 2, steady_ = kOne / 2;
  uint8_t seen_ = 0;
};

/// Appends to the bytes that it is given. Like everything here, not thread-safe.
class RangeEncoder {
 public:
  bool bit(BitModel& model, bool value) {
    const uint32_t bound = (range_ >> 16) * model.probability();
    if (value) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    model.learn(value);
    while (range_ < kLeastRange) {
      shift();
      range_ <<= 8;
    }
    return value;
  }
  /// As the decoder's.
  static constexpr bool possible() { return true; }
  /// Returns the bytes; nothing can be encoded after this.
  std::vector<std::byte> finish() {
    for (int i = 0; i < 5; ++i) shift();
    bytes_.erase(bytes_.begin());  // a 0, which a carry never reaches
    return std::move(bytes_);
  }

 private:
  friend class RangeDecoder;
  static constexpr uint32_t kLeastRange = 1 << 24;

  /// Shifts the highest byte of low_ out. Bytes of 255 wait, because a carry may still come.
  void shift() {
    if (low_ < 0xff000000u || low_ > 0xffffffffu) {
      const auto carry = uint8_t(low_ >> 32);
      bytes_.push_back(std::byte(uint8_t(held_ + carry)));
      for (; waiting_ > 0; --waiting_) bytes_.push_back(std::byte(uint8_t(0xff + carry)));
      held_ = uint8_t(low_ >> 24);
    } else {
      ++waiting_;
    }
    low_ = (low_ & 0x00ffffff) << 8;
  }

  std::vector<std::byte> bytes_;
  uint64_t low_ = 0, waiting_ = 0;
  uint32_t range_ = 0xffffffffu;
  uint8_t held_ = 0;
};

/// Any bytes decode to something; complete() tells whether an encoder could have made them. Never reads
/// beyond them.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) shift();
    possible_ = code_ < range_;  // and so it stays
  }
  bool bit(BitModel& model, bool = false) {
    const uint32_t bound = (range_ >> 16) * model.probability();
    const bool value = code_ < bound;
    if (value) {
      range_ = bound;
    } else {
      code_ -= bound;
      range_ -= bound;
    }
    model.learn(value);
    while (range_ < RangeEncoder::kLeastRange) {
      shift();
      range_ <<= 8;
    }
    return value;
  }
  /// To be called after the last bit: whether all bytes were needed, and no more than may be left out at the
  /// end. RangeEncoder ends with the lowest number of its range, in four bytes; another encoder may end with
  /// any, such as one whose last bytes are zeros, and leave these out.
  bool complete() const { return possible() && at_ >= bytes_.size(); }
  /// Whether complete() may still become true. Few bytes could otherwise decode to very many bits.
  bool possible() const { return possible_ && at_ <= bytes_.size() + kMostLeftOut; }

 private:
  /// Any range holds a number of which only the highest of the four bytes is not 0.
  static constexpr size_t kMostLeftOut = 3;

  /// Bytes beyond the end are 0.
  void shift() {
    code_ = code_ << 8 | (at_ < bytes_.size() ? uint32_t(bytes_[at_]) : 0u);
    ++at_;
  }

  std::span<const std::byte> bytes_;
  size_t at_ = 0;
  uint32_t code_ = 0, range_ = 0xffffffffu;
  bool possible_ = false;
};

/// A number of kBits bits, the highest first, each in the context of those before it.
template <uint32_t kBits>
class SymbolModel {
 public:
  template <class Coder>
  uint32_t code(Coder& coder, uint32_t value) {
    uint32_t node = 1;
    for (uint32_t b = kBits; b-- > 0;) node = node << 1 | uint32_t(coder.bit(models_[node], value >> b & 1));
    return node - (1u << kBits);
  }

 private:
  std::array<BitModel, 1u << kBits> models_;
};

/// An unsigned number that is usually small: its number of bits, then these (exponential Golomb code). It
/// must be below 2^kMostBits - 1.
template <uint32_t kMostBits>
class NumberModel {
 public:
  template <class Coder>
  uint32_t code(Coder& coder, uint32_t value) {
    const uint32_t width = uint32_t(std::bit_width(value + 1)) - 1;  // without the leading 1
    uint32_t bits = 0;
    while (bits + 1 < kMostBits && coder.bit(widths_[bits], bits < width)) ++bits;
    uint32_t node = 1;
    for (uint32_t b = bits; b-- > 0;) {
      // The highest two are worth modelling; those below are nearly random.
      BitModel& model = bits - b <= 2 ? high_[bits][node & 3] : low_[b];
      node = node << 1 | uint32_t(coder.bit(model, (value + 1) >> b & 1));
    }
    return node - 1;
  }

 private:
  std::array<BitModel, kMostBits> widths_;
  std::array<std::array<BitModel, 4>, kMostBits> high_;
  std::array<BitModel, kMostBits> low_;
};

/// A difference that is usually small: from -2^kMostBits + 1 to 2^kMostBits - 1.
template <uint32_t kMostBits>
class DifferenceModel {
 public:
  template <class Coder>
  int32_t code(Coder& coder, int32_t value) {
    if (!coder.bit(some_, value != 0)) return 0;
    const bool negative = coder.bit(negative_, value < 0);
    const int32_t size = int32_t(size_.code(coder, uint32_t(value < 0 ? -value : value) - 1)) + 1;
    return negative ? -size : size;
  }

 private:
  BitModel some_, negative_;
  NumberModel<kMostBits> size_;
};

}  // namespace nif
