// Computes the mean base colours of an object's surface, voxel by voxel.
#pragma once

#include "bake/ground_truth/prepare.hpp"
#include "formats/nif/planes/colors_section.hpp"
#include "kernels/reference/planes/planes_field.hpp"

namespace nif::bake {

struct Form;

/// Whether any mesh of the scene has a colour.
bool has_colors(const mesh::Scene& scene);

/// Reserves room for the colours of an object in its laid-out form, so that they count in its bytes, if the
/// object has a grid and its source mesh has colours.
void reserve_colors(const Prepared& prepared, Form& form);
/// Fills that room, if there is any.
void fill_colors(const mesh::Scene& scene, const Prepared& prepared, Form& form);

/// For each surface voxel of an object's grid, the mean colour of the triangles within it, weighted by their
/// area there. `scene` has the object's source mesh with its appearance, and the materials. Runs on all
/// threads; the result does not depend on their number.
format::Colors mean_colors(const mesh::Scene& scene, const Prepared& prepared,
                           const kernels::PlanesField& field);

}  // namespace nif::bake
