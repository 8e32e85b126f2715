// Stacks of the emulator's fibres, and what the address sanitizer has to be told of them.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

// The address sanitizer is told which stack is in use; frames take more room with it.
#if defined(__SANITIZE_ADDRESS__)
#define NIF_FIBRES_ARE_WATCHED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define NIF_FIBRES_ARE_WATCHED
#endif
#endif
#ifdef NIF_FIBRES_ARE_WATCHED
#include <sanitizer/common_interface_defs.h>
#endif

namespace nif::kernels::gpu {

#ifdef NIF_FIBRES_ARE_WATCHED
inline constexpr size_t kStackBytes = 512 * 1024;
#else
inline constexpr size_t kStackBytes = 64 * 1024;
#endif

/// A stack, as the address sanitizer wants to be told of it before and after a switch.
struct Stack {
  const void* bottom = nullptr;
  size_t bytes = 0;

  void leave_for([[maybe_unused]] const Stack& other) {
#ifdef NIF_FIBRES_ARE_WATCHED
    __sanitizer_start_switch_fiber(&fake_, other.bottom, other.bytes);
#endif
  }
  /// `from`: where it was come from; it learns where that is.
  void arrive([[maybe_unused]] Stack* from) {
#ifdef NIF_FIBRES_ARE_WATCHED
    __sanitizer_finish_switch_fiber(fake_, from ? &from->bottom : nullptr, from ? &from->bytes : nullptr);
#endif
  }

 private:
  [[maybe_unused]] void* fake_ = nullptr;
};

/// Room for the stacks of a block's fibres, which the next block on this thread takes over: with the address
/// sanitizer it takes longer to make than a small kernel.
class Stacks {
 public:
  explicit Stacks(size_t count) : memory_(std::exchange(spare(), {})) {
    if (memory_.count < count) memory_ = {std::unique_ptr<char[]>(new char[kStackBytes * count]), count};
  }
  /// Those of fibres that never came to an end are in disorder.
  void give_back() { spare() = std::move(memory_); }
  char* operator[](size_t i) const { return memory_.bytes.get() + kStackBytes * i; }

 private:
  struct Memory {
    std::unique_ptr<char[]> bytes;
    size_t count = 0;
  };
  static Memory& spare() {
    static thread_local Memory memory;
    return memory;
  }
  Memory memory_;
};

}  // namespace nif::kernels::gpu
