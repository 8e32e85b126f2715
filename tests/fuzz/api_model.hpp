// What fuzz_api knows of the library's state: files, handles, instances as they were set, and callbacks.
#pragma once

#include <nif/nif.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "formats/nif/writer.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {

using File = std::vector<std::byte>;

/// Files of every encoding, coded and not.
inline const std::vector<File>& files() {
  static const std::vector<File> files = [] {
    using Options = RandomAssetOptions;
    std::vector<File> made;
    for (const Options& options :
         {Options{.objects = 1, .instances = 2, .max_voxels = 6, .features = 2},
          Options{.objects = 0,
          .instances = 3,
          .max_voxels = 6,
          .bvhs = 2,
          .skins = 1,
          .sources = 1,
          .translations = true},
          Options{.objects = 0, .instances = 1, .max_voxels = 6, .exacts = 1, .colors = 1},
          Options{.objects = 0, .instances = 0, .max_voxels = 6, .proofs = 2},
          Options{.objects = 0, .instances = 1, .max_voxels = 6, .sphericals = 1, .primaries = 1},
          Options{.objects = 1,
          .instances = 5,
          .max_voxels = 9,
          .bvhs = 1,
          .sphericals = 1,
          .exacts = 1,
          .proofs = 1,
          .coded = kCodedAll}})
      made.push_back(format::encode(random_asset(made.size(), options)));
    return made;
  }();
  return files;
}

/// Bytes to be borrowed, with the required alignment. They must outlive all handles.
inline const void* borrowed(uint32_t which) {
  struct alignas(NIF_ASSET_ALIGNMENT) Line {
    std::byte bytes[NIF_ASSET_ALIGNMENT];
  };
  static std::array<std::vector<Line>, 6> copies;
  std::vector<Line>& copy = copies[which];
  if (copy.empty()) {
    copy.resize(files()[which].size() / sizeof(Line) + 1);
    std::memcpy(copy.data(), files()[which].data(), files()[which].size());
  }
  return copy.data();
}

/// A handle, and how many references to it we hold. The value of a dead handle stays.
template <class Handle>
struct Slot {
  Handle handle = nullptr;
  uint32_t references = 0;
  int device = -1;  ///< serial number of the device that it belongs to
  bool alive() const { return references > 0; }
};

/// What we have set for an instance.
struct Known {
  bool exists = true;
  uint32_t mask = 0xffffffffu, flags = 0;
  uint64_t user = 0;
  std::array<double, 3> origin{};
  /// Whether a ray with this mask meets it.
  bool lets_in(uint32_t ray) const { return exists && !(flags & NIF_INSTANCE_DISABLED) && (mask & ray) != 0; }
};

struct SceneSlot : Slot<NifScene> {
  std::vector<Known> instances{};  ///< the last one exists
  std::array<double, 3> origin{};
  bool committed = false, moved = false;

  bool has(uint32_t number) const { return number < instances.size() && instances[number].exists; }
  uint32_t count() const {
    return uint32_t(
        std::count_if(instances.begin(), instances.end(), [](const Known& k) { return k.exists; }));
  }
  /// The first of the lowest `row` consecutive free numbers.
  uint32_t lowest_free(uint32_t row) const {
    uint32_t first = 0;
    for (uint32_t number = 0; number < instances.size(); ++number) {
      if (has(number)) first = number + 1;
      if (row > 0 && number + 1 - first == row) return first;
    }
    return uint32_t(instances.size());
  }
};

/// A task runner that delays tasks.
struct LateRunner {
  struct Task {
    NifTask task;
    void* argument;
    uint64_t index;
  };
  std::vector<Task> waiting;

  void run(size_t most) {
    for (; most > 0 && !waiting.empty(); --most) {
      const Task next = waiting.back();
      waiting.pop_back();
      next.task(next.argument, next.index);
    }
  }
};

/// Everything that callbacks of a device are given.
struct Caller {
  Budget budget;
  LateRunner runner;

  static void* allocate(void* user, uint64_t bytes, uint64_t alignment) {
    return Budget::allocate(&static_cast<Caller*>(user)->budget, bytes, alignment);
  }
  static void deallocate(void* user, void* memory, uint64_t bytes, uint64_t alignment) {
    Budget::deallocate(&static_cast<Caller*>(user)->budget, memory, bytes, alignment);
  }
  static void submit(void* user, NifTask task, void* argument, uint64_t count) {
    must(count > 0 && count <= 2);  // the device's threads
    for (uint64_t i = 0; i < count; ++i)
      static_cast<Caller*>(user)->runner.waiting.push_back({task, argument, i});
  }
  static void log(void* user, uint32_t level, const char* message) {
    must(user && (level == NIF_LOG_WARNING || level == NIF_LOG_INFO) && message[0] != 0);
    must(std::strchr(message, '\n') == nullptr);
  }
};

/// A file that is read in chunks, until a read fails on request.
struct Piecewise {
  const File* file;
  uint64_t next = 0;   ///< that is to be read
  uint32_t reads = 0;  ///< that succeed
  bool failed = false;

  static uint32_t read(void* user, uint64_t offset, void* to, uint64_t size) {
    auto& self = *static_cast<Piecewise*>(user);
    must(offset == self.next && size > 0 && !self.failed);
    self.next += size;
    self.failed = self.reads-- == 0 || self.next > self.file->size();
    if (self.failed) return 0;
    std::memcpy(to, self.file->data() + offset, size);
    return 1;
  }
};

/// Arguments, chosen by the input.
class Drawn {
 protected:
  explicit Drawn(Choices choices) : choices_(choices) {}

  std::array<float, 12> matrix() {
    std::array<float, 12> rows{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (uint32_t changes = choices_.below(4); changes > 0; --changes)
      rows[choices_.below(12)] = choices_.number();
    return rows;
  }
  static bool is_finite(const std::array<float, 12>& rows) {
    for (const float x : rows)
      if (!std::isfinite(x)) return false;
    return true;
  }

  uint32_t any_mask() {
    static constexpr uint32_t kMasks[] = {0xffffffffu, 0, 1, 2, 3, 0x80000000u};
    const uint32_t which = choices_.below(7);
    return which < 6 ? kMasks[which] : choices_.word();
  }

  /// Near, far, beyond the range of floats, or NaN.
  std::array<double, 3> place() {
    std::array<double, 3> at{};
    for (double& x : at) switch (choices_.below(8)) {
        case 0:
        case 1:
          break;
        case 2:
          x = std::ldexp(double(choices_.number()), int(choices_.word() % 2200) - 1100);
          break;
        case 3:
          x = double(choices_.number()) * 1e300 * 1e300;
          break;
        default:
          x = double(choices_.number()) + 0x1p23 * double(choices_.below(2));
      }
    return at;
  }
  static bool is_finite(const std::array<double, 3>& at) {
    return std::isfinite(at[0]) && std::isfinite(at[1]) && std::isfinite(at[2]);
  }

  std::vector<NifRay> rays() {
    std::vector<NifRay> rays(1 + choices_.below(24));
    for (NifRay& ray : rays) {
      for (float& x : ray.origin) x = choices_.number();
      for (float& x : ray.direction) x = choices_.number();
      ray.tmin = choices_.below(3) ? 0 : choices_.number();
      ray.tmax = choices_.below(3) ? INFINITY : choices_.number();
    }
    return rays;
  }

  /// No mask, one for all rays, or one per ray.
  std::vector<uint32_t> masks(size_t rays) {
    std::vector<uint32_t> masks(choices_.below(3) == 0 ? 0 : choices_.below(2) ? 1 : rays);
    for (uint32_t& mask : masks) mask = any_mask();
    return masks;
  }

  Choices choices_;
};

}  // namespace nif::test
