// Handles as the caller sees them: numbers that are never used twice. So a handle that was released, or never
// was one, is recognised, and nothing is read through it.
#pragma once

#include <cstdint>

#include "api/object.hpp"

namespace nif::runtime {

enum class Kind : uintptr_t { device = 1, asset, scene, job };

/// A new handle, with one reference of the caller's. It stands for one reference to the object, however many
/// the caller has. Throws std::bad_alloc.
uintptr_t make_handle(Kind kind, Object* object);

/// What the handle stands for; null for one that stands for nothing. Takes no lock.
Object* find_object(Kind kind, uintptr_t handle);

/// One more reference of the caller's. False for a handle that stands for nothing.
bool retain_handle(Kind kind, uintptr_t handle);

/// One less. With the last, the handle stands for nothing any more, and its object is returned, for its
/// reference to be given back; else null.
Object* release_handle(Kind kind, uintptr_t handle);

}  // namespace nif::runtime
