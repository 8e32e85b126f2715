// Finds a part that several encodings share, planes or triangles, in a field of any encoding. It goes by the
// type, so callers need not know which encodings have the part.
#pragma once

#include <concepts>

#include "kernels/reference/planes/field.hpp"
#include "kernels/reference/triangles/field.hpp"

namespace nif::kernels {

/// A pointer into the field; null if it has no such part.
template <class Field>
constexpr const PlanesField* grid_of(const Field& field) {
  if constexpr (std::derived_from<Field, PlanesField>)
    return &field;
  else if constexpr (requires {
                       { field.planes } -> std::same_as<const PlanesField&>;
                     })
    return &field.planes;
  else
    return nullptr;
}

/// Likewise.
template <class Field>
constexpr const TrianglesField* tree_of(const Field& field) {
  if constexpr (std::derived_from<Field, TrianglesField>)
    return &field;
  else if constexpr (requires {
                       { field.triangles } -> std::same_as<const TrianglesField&>;
                     })
    return &field.triangles;
  else
    return nullptr;
}

}  // namespace nif::kernels
