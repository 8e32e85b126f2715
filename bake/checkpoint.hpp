// Stores how far the trainings of a bake are, as bytes, so that a bake that was killed can resume and give
// the same asset.
//
// A bake trains its objects one after the other, and that takes most of the time. A resumed bake repeats
// everything else (planes, measuring, choosing): for each training, in the same order as before, it asks for
// what was stored. Storing a state does not change it, so the asset does not depend on when that happens.
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
#include "formats/mesh/mesh_scene.hpp"

namespace nif::bake {

struct BakeOptions;

/// Writes values one after the other, as in memory: the same program reads a state on the same kind of
/// machine.
class StateWriter {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    append(&value, sizeof(T));
  }
  /// Writes their count, then all of them.
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

/// Reads what a StateWriter has written. Throws Error(checkpoint_refused) if the bytes are something else.
/// Callers check by require() whatever memory and loops depend on: a checksum does not prove who wrote it.
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
  /// As many as were written.
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
  /// Checks that what was read is possible.
  static void require(bool holds) {
    if (!holds) refuse();
  }
  /// As many numbers as `values` has, none beyond +-limit.
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

/// One training: its result, or the state from which it resumes.
struct KeptTraining {
  std::string object;  ///< what is trained, as a check
  bool finished = false;
  std::vector<std::byte> state;
};

/// The stored trainings of a bake, in order. Not thread-safe: for the baking thread.
class TrainingLog {
 public:
  using Save = std::function<void(std::span<const KeptTraining>)>;

  /// Stores nothing.
  TrainingLog() = default;
  /// `earlier`: what an unfinished bake has stored. `save` receives everything that is stored, at the
  /// earliest this many seconds after the start or the previous call; what it throws ends the bake.
  TrainingLog(std::vector<KeptTraining> earlier, double seconds, Save save);

  /// Starts the next training. Returns what was stored of it before, if anything; valid until the log's next
  /// call. Throws Error(checkpoint_refused) if that is of another object.
  const KeptTraining* begin(const std::string& object);
  /// Is it time to store the state of the current training?
  bool due() const { return save_ && Clock::now() >= next_; }
  void keep(StateWriter&& state);
  /// Ends the current training with this result.
  void finish(StateWriter&& result);
  /// The same if begin() returned its result.
  void finish_as_before() { ++ended_; }

 private:
  using Clock = std::chrono::steady_clock;

  std::vector<KeptTraining> kept_;
  std::string object_;  ///< of the current training
  size_t ended_ = 0;    ///< trainings
  Clock::duration pause_{};
  Clock::time_point next_;
  Save save_;
};

/// Everything that the bytes of a bake depend on, as texts to compare.
struct BakeKey {
  std::string program, mesh, options;
  bool operator==(const BakeKey&) const = default;
};
/// `inputs`: what else the caller depends on, for example the scene in which given rays are drawn.
BakeKey key_of(const mesh::Scene& scene, const BakeOptions& options, std::string_view inputs);

/// A checkpoint as a file: with checksum, key and trainings.
std::vector<std::byte> encode_checkpoint(const BakeKey& key, std::span<const KeptTraining> trainings);

/// Its first bytes.
inline constexpr std::array<char, 8> kCheckpointMagic{'N', 'I', 'F', 'B', 'A', 'K', 'E', '\n'};
/// Throws Error(checkpoint_refused) with the rest of a sentence ("is damaged") if the bytes are not a
/// checkpoint, are damaged, or have another key. Safe on any bytes.
std::vector<KeptTraining> decode_checkpoint(std::span<const std::byte> file, const BakeKey& key);

}  // namespace nif::bake
