// What several encodings have in common, asked of a field of any encoding: a grid with planes, a BVH. Found
// by its type, so that nobody has to know which encodings have one.
#pragma once

#include <concepts>

#include "kernels/reference/planes/field.hpp"
#include "kernels/reference/triangles/field.hpp"

namespace nif::kernels {

/// Within the field; null where it has none.
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
