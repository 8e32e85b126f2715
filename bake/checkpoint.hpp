// How far the trainings of a bake are, as bytes, so that one that was killed goes on to the same asset.
//
// A bake trains its objects one after the other, and that is what takes long. All else (planes, measuring,
// choosing) is done again by a bake that is resumed: it asks for each training what is kept of it, in the
// same order as before. To keep a state changes nothing in it, so bytes do not depend on when that happens.
#pragma once

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/mesh/scene.hpp"

namespace nif::bake {

struct BakeOptions;

/// Values one after the other, as they lie in memory: a state is read by the same program on a machine of the
/// same kind.
class StateWriter {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    append(&value, sizeof(T));
  }
  /// How many there are, and all of them.
  template <class Values>
  void put_all(const Values& values) {
    put(uint64_t{values.size()});
    append(values.data(), values.size() * sizeof(*values.data()));
  }
  std::span<const std::byte> bytes() const { return bytes_; }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void append(const void* from, size_t size);

  std::vector<std::byte> bytes_;
};

/// Reads what a StateWriter has written. Throws Error(checkpoint_refused) where that is something else. Who
/// reads asks by require() for whatever memory and loops depend on: a checksum is no proof of who wrote it.
class StateReader {
 public:
  explicit StateReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  void get(T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    take(&value, sizeof(T));
  }
  template <class T>
  T get() {
    T value;
    get(value);
    return value;
  }
  /// As many as there are.
  template <class Values>
  void get_all(Values& values) {
    const auto count = get<uint64_t>();
    if (count > bytes_.size() / sizeof(values[0])) refuse();
    values.resize(count);
    if (count > 0) take(values.data(), count * sizeof(values[0]));
  }
  /// As many as `values` has.
  template <class Values>
  void get_same(Values& values) {
    if (get<uint64_t>() != values.size()) refuse();
    if (!values.empty()) take(values.data(), values.size() * sizeof(values[0]));
  }
  void end() const { require(bytes_.empty()); }
  /// That what was read can be.
  static void require(bool holds) {
    if (!holds) refuse();
  }
  /// As many numbers as `values` has, none of them beyond +-limit.
  template <class Numbers>
  void get_within(Numbers& values, float limit) {
    get_same(values);
    for (const auto value : values) require(std::abs(float(value)) <= limit);
  }
  template <class Numbers>
  void get_finite(Numbers& values) {
    get_within(values, std::numeric_limits<float>::max());
  }

 private:
  [[noreturn]] static void refuse();
  void take(void* to, size_t size) {
    if (size > bytes_.size()) refuse();
    std::memcpy(to, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
  }

  std::span<const std::byte> bytes_;
};

/// One training: its result, or the state from which it goes on.
struct KeptTraining {
  std::string object;  ///< what is trained, to be sure of it
  bool finished = false;
  std::vector<std::byte> state;
};

/// What is kept of a bake's trainings, in their order. Not thread-safe: for the thread that bakes.
class TrainingLog {
 public:
  using Save = std::function<void(std::span<const KeptTraining>)>;

  /// Keeps nothing.
  TrainingLog() = default;
  /// `earlier`: what a bake that did not end has kept. `save` is told all that is kept, not before so many
  /// seconds after the start or the last time; what it throws ends the bake.
  TrainingLog(std::vector<KeptTraining> earlier, double seconds, Save save);

  /// The next training begins. Returns what is kept of it from before, if anything is; valid until the log's
  /// next call. Throws Error(checkpoint_refused) where that is of another object.
  const KeptTraining* begin(const std::string& object);
  /// Is it time to keep the state of the training that has begun?
  bool due() const { return save_ && Clock::now() >= next_; }
  void keep(StateWriter&& state);
  /// The training that has begun has ended so.
  void finish(StateWriter&& result);
  /// The same where begin() returned its result.
  void finish_as_before() { ++ended_; }

 private:
  using Clock = std::chrono::steady_clock;

  std::vector<KeptTraining> kept_;
  std::string object_;  ///< of the training that has begun
  size_t ended_ = 0;    ///< trainings
  Clock::duration pause_{};
  Clock::time_point next_;
  Save save_;
};

/// What the bytes of a bake depend on, as texts to be compared.
struct BakeKey {
  std::string program, mesh, options;
  bool operator==(const BakeKey&) const = default;
};
/// `inputs`: what the caller knows besides, for example of the scene that given rays are drawn in.
BakeKey key_of(const mesh::Scene& scene, const BakeOptions& options, std::string_view inputs);

/// A checkpoint as a file: with checksum, key and trainings.
std::vector<std::byte> encode_checkpoint(const BakeKey& key, std::span<const KeptTraining> trainings);

/// What they begin with.
inline constexpr std::array<char, 8> kCheckpointMagic{'N', 'I', 'F', 'B', 'A', 'K', 'E', '\n'};
/// Throws Error(checkpoint_refused) with the rest of a sentence ("is damaged") where the bytes are none, are
/// damaged, or have another key. Safe on any bytes.
std::vector<KeptTraining> decode_checkpoint(std::span<const std::byte> file, const BakeKey& key);

}  // namespace nif::bake
