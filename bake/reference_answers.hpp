// What the reference kernels answer about an object: what bake/ground_truth judges while an asset is made.
#pragma once

#include "bake/ground_truth/evaluate.hpp"
#include "bake/ground_truth/evaluate_hits.hpp"
#include "kernels/reference/reference_encodings.hpp"

namespace nif::bake {

/// Answers about a field. What it points into must outlive the answerer.
Answerer reference_answerer(const kernels::AnyField& field);
/// The same for first hits.
HitFinder reference_finder(const kernels::AnyField& field);

/// Fineness of a grid for ObjectScale; 0 if the encoding has none.
double voxels_per_unit(const kernels::AnyField& field);

}  // namespace nif::bake
