// The table of all objects that the process has handles to. It outlives every device, so it cannot use a
// device's memory: a fixed part holds 1,024 objects at once; for more, the table grows and never shrinks.
#include "api/handles.hpp"

#include <atomic>
#include <bit>
#include <cstddef>
#include <mutex>
#include <new>

namespace nif::runtime {
namespace {

// A handle contains, from its lowest bit: the slot's number, the kind, and how often the slot was used
// before.
constexpr uint32_t kSlotBits = sizeof(uintptr_t) == 8 ? 24 : 16, kKindBits = 3;
constexpr uintptr_t kKindShift = kSlotBits, kUseShift = kSlotBits + kKindBits;
// Handles are never reused: a slot stays empty after its last use. With 32 bits that is the 8,192nd.
constexpr uintptr_t kMostUses = uintptr_t{1} << (8 * sizeof(uintptr_t) - kUseShift);
constexpr uintptr_t kSlotMask = (uintptr_t{1} << kSlotBits) - 1, kKindMask = (uintptr_t{1} << kKindBits) - 1;

struct Slot {
  std::atomic<uintptr_t> handle = 0;  ///< 0: free
  std::atomic<Object*> object = nullptr;
  // The members below are guarded by the mutex.
  uintptr_t uses = 0;
  uint32_t references = 0;
  uint32_t next_free = 0;
};

// Part 0 has 1,024 slots, and each later part as many as all parts before it. Parts never move.
constexpr uint32_t kFirstPart = 1024;
constexpr uint32_t kParts = kSlotBits - uint32_t(std::countr_zero(kFirstPart)) + 1;
constexpr uint32_t kNone = 0xffffffffu;

constinit Slot first_part[kFirstPart];
constinit std::atomic<Slot*> parts[kParts] = {first_part};
uint32_t slots = 0;          ///< how many were ever used
uint32_t free_slot = kNone;  ///< the slot freed last; the first of a list

/// Guards the table. Made at its first use, since not every standard library can make it at compile time.
/// Never destroyed: a program's globals may release handles after the globals of this file are destroyed.
std::mutex& mutex() {
  alignas(std::mutex) static std::byte place[sizeof(std::mutex)];
  static std::mutex* const made = new (place) std::mutex;
  return *made;
}

uint32_t part_of(uint32_t slot) { return uint32_t(std::bit_width(slot / kFirstPart)); }
uint32_t begin_of(uint32_t part) { return part == 0 ? 0 : kFirstPart << (part - 1); }

/// Returns null if the table has no such slot.
Slot* slot_at(uint32_t slot) {
  const uint32_t part = part_of(slot);
  Slot* begin = parts[part].load(std::memory_order_acquire);
  return begin ? begin + (slot - begin_of(part)) : nullptr;
}

/// Returns the handle's slot, or null if the handle is not alive.
Slot* slot_of(Kind kind, uintptr_t handle) {
  if ((handle >> kKindShift & kKindMask) != uintptr_t(kind)) return nullptr;
  Slot* slot = slot_at(uint32_t(handle & kSlotMask));
  return slot && slot->handle.load(std::memory_order_acquire) == handle ? slot : nullptr;
}

/// Returns the number of a free slot. The mutex must be held.
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
