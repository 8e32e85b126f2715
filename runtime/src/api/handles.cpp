// A table of all objects that the process's callers know. It outlives every device, so it cannot be of a
// device's memory: a fixed part is enough for 1,024 objects at once, and more of them make it grow for good.
#include "api/handles.hpp"

#include <atomic>
#include <bit>
#include <cstddef>
#include <mutex>
#include <new>

namespace nif::runtime {
namespace {

// A handle is, from its lowest bit: the number of its slot, its kind, and how often the slot was used before.
constexpr uint32_t kSlotBits = sizeof(uintptr_t) == 8 ? 24 : 16, kKindBits = 3;
constexpr uintptr_t kKindShift = kSlotBits, kUseShift = kSlotBits + kKindBits;
// Handles are never reused: a slot whose uses are all used up stays empty. In 32 bits that is after 8,192.
constexpr uintptr_t kMostUses = uintptr_t{1} << (8 * sizeof(uintptr_t) - kUseShift);
constexpr uintptr_t kSlotMask = (uintptr_t{1} << kSlotBits) - 1, kKindMask = (uintptr_t{1} << kKindBits) - 1;

struct Slot {
  std::atomic<uintptr_t> handle = 0;  ///< 0: free
  std::atomic<Object*> object = nullptr;
  // The rest is guarded by the mutex.
  uintptr_t uses = 0;
  uint32_t references = 0;
  uint32_t next_free = 0;
};

// Part 0 has 1,024 slots, and each other as many as all before it. Parts stay where they are.
constexpr uint32_t kFirstPart = 1024;
constexpr uint32_t kParts = kSlotBits - uint32_t(std::countr_zero(kFirstPart)) + 1;
constexpr uint32_t kNone = 0xffffffffu;

constinit Slot first_part[kFirstPart];
constinit std::atomic<Slot*> parts[kParts] = {first_part};
uint32_t slots = 0;          ///< that were ever used
uint32_t free_slot = kNone;  ///< the latest of those that are free again

/// Guards the table. Not a constant in every standard library, and never destroyed: a program's own globals
/// may release handles after those of this file have ended.
std::mutex& mutex() {
  alignas(std::mutex) static std::byte place[sizeof(std::mutex)];
  static std::mutex* const made = new (place) std::mutex;
  return *made;
}

uint32_t part_of(uint32_t slot) { return uint32_t(std::bit_width(slot / kFirstPart)); }
uint32_t begin_of(uint32_t part) { return part == 0 ? 0 : kFirstPart << (part - 1); }

/// Null where the table does not reach so far.
Slot* slot_at(uint32_t slot) {
  const uint32_t part = part_of(slot);
  Slot* begin = parts[part].load(std::memory_order_acquire);
  return begin ? begin + (slot - begin_of(part)) : nullptr;
}

/// The handle's slot; null where it stands for nothing.
Slot* slot_of(Kind kind, uintptr_t handle) {
  if ((handle >> kKindShift & kKindMask) != uintptr_t(kind)) return nullptr;
  Slot* slot = slot_at(uint32_t(handle & kSlotMask));
  return slot && slot->handle.load(std::memory_order_acquire) == handle ? slot : nullptr;
}

/// With the mutex held: the number of a free slot.
uint32_t take_slot() {
  if (free_slot != kNone) {
    const uint32_t slot = free_slot;
    free_slot = slot_at(slot)->next_free;
    return slot;
  }
  if (slots > kSlotMask) throw std::bad_alloc();
  const uint32_t part = part_of(slots);
  if (!parts[part].load(std::memory_order_relaxed))
    parts[part].store(new Slot[kFirstPart << (part - 1)], std::memory_order_release);
  return slots++;
}

}  // namespace

uintptr_t make_handle(Kind kind, Object* object) {
  const std::lock_guard lock(mutex());
  const uint32_t number = take_slot();
  Slot& slot = *slot_at(number);
  slot.references = 1;
  slot.object.store(object, std::memory_order_relaxed);
  const uintptr_t handle = slot.uses++ << kUseShift | uintptr_t(kind) << kKindShift | number;
  slot.handle.store(handle, std::memory_order_release);
  return handle;
}

Object* find_object(Kind kind, uintptr_t handle) {
  const Slot* slot = slot_of(kind, handle);
  return slot ? slot->object.load(std::memory_order_relaxed) : nullptr;
}

bool retain_handle(Kind kind, uintptr_t handle) {
  const std::lock_guard lock(mutex());
  Slot* slot = slot_of(kind, handle);
  if (slot) ++slot->references;
  return slot;
}

Object* release_handle(Kind kind, uintptr_t handle) {
  const std::lock_guard lock(mutex());
  Slot* slot = slot_of(kind, handle);
  if (!slot || --slot->references > 0) return nullptr;
  slot->handle.store(0, std::memory_order_relaxed);
  if (slot->uses < kMostUses) {
    slot->next_free = free_slot;
    free_slot = uint32_t(handle & kSlotMask);
  }
  return slot->object.exchange(nullptr, std::memory_order_relaxed);
}

}  // namespace nif::runtime
