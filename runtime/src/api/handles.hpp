// The caller's handles: numbers that are never used twice. So a released or made-up handle is recognised, and
// nothing is read through it.
#pragma once

#include <cstdint>

#include "api/object.hpp"

namespace nif::runtime {

enum class Kind : uintptr_t { device = 1, asset, scene, job };

/// Makes a handle with one caller's reference. It holds one reference to the object, however many references
/// the caller has. Throws std::bad_alloc.
uintptr_t make_handle(Kind kind, Object* object);

/// Returns the handle's object, or null if the handle is not alive. Takes no lock.
Object* find_object(Kind kind, uintptr_t handle);

/// Adds a caller's reference. Returns false if the handle is not alive.
bool retain_handle(Kind kind, uintptr_t handle);

/// Removes a caller's reference. If it was the last, the handle dies, and its object is returned so that the
/// caller can release the handle's reference to it. Otherwise returns null.
Object* release_handle(Kind kind, uintptr_t handle);

}  // namespace nif::runtime
