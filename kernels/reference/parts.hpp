// What several encodings have in common, asked of a field of any encoding: a grid with planes, a BVH. Found
// by its type, so that nobody has to know which encodings have one.
#pragma once

#include <concepts>

#include "kernels/reference/bvh/field.hpp"
#include "kernels/reference/proof/field.hpp"

namespace nif::kernels {

/// Within the field; null where it has none.
template <class Field>
constexpr const ProofField* grid_of(const Field& field) {
  if constexpr (std::derived_from<Field, ProofField>)
    return &field;
  else if constexpr (requires {
                       { field.proof } -> std::same_as<const ProofField&>;
                     })
    return &field.proof;
  else
    return nullptr;
}

/// Likewise.
template <class Field>
constexpr const BvhField* tree_of(const Field& field) {
  if constexpr (std::derived_from<Field, BvhField>)
    return &field;
  else if constexpr (requires {
                       { field.bvh } -> std::same_as<const BvhField&>;
                     })
    return &field.bvh;
  else
    return nullptr;
}

}  // namespace nif::kernels
