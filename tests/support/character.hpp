// A character for tests: a tube that joints and a morph target bend.
#pragma once

#include <string>
#include <vector>

#include "formats/mesh/poser.hpp"
#include "tests/support/gltf.hpp"

namespace nif::test {

/// Adds a channel to the last animation; makes one if there is none. `per`: numbers of an element.
void add_channel(Gltf& gltf, size_t node, const char* path, const std::vector<float>& times,
                 const std::vector<float>& values, size_t per, const char* mode = "LINEAR");

/// A tube of 2 * `around` * `rings` triangles along y, with a chain of eight joints, all of which move every vertex, a morph target
/// that swells it, a cube that is not skinned on the last joint, and two clips: 'sway' (LINEAR) turns all joints, 'swell'
/// (CUBICSPLINE) moves one of them, scales another, and sets the weight.
Gltf tube_character(int around = 25, int rings = 40);

/// Expects that a scene with skins, bent by Poser, is where a scene has it that was read at that moment.
void expect_posed_as_read(const mesh::Scene& kept, const std::vector<mesh::PosedInstance>& posed,
                          const mesh::Scene& read);
/// The same for a file.
void expect_posed_as_read(const std::string& file, const std::string& bytes, const mesh::Moment& moment);

}  // namespace nif::test
