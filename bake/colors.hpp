// The mean base colours of an object's surface, voxel by voxel.
#pragma once

#include "bake/oracle/prepare.hpp"
#include "formats/nif/planes/colors.hpp"
#include "kernels/reference/planes/field.hpp"

namespace nif::bake {

struct Form;

/// Whether any mesh of the scene says what colour it has.
bool has_colors(const mesh::Scene& scene);

/// Makes room in a form that is laid out for the colours of its object, which count for its bytes: if the
/// object has a grid, and its source mesh says what colour it has.
void reserve_colors(const Prepared& prepared, Form& form);
/// Fills that room, if there is some.
void fill_colors(const mesh::Scene& scene, const Prepared& prepared, Form& form);

/// Of each surface voxel of an object's grid the mean colour of the triangles within it, weighted by the area
/// that they have there. `scene` has the object's source mesh with its appearance, and the materials. Runs on
/// all threads; the result does not depend on their number.
format::Colors mean_colors(const mesh::Scene& scene, const Prepared& prepared,
                           const kernels::PlanesField& field);

}  // namespace nif::bake
