// What a camera sees of an object on the ground: the part of an engine's rasteriser, done here by nifIntersect.
#pragma once

#include <nif/nif.hpp>

#include <array>
#include <cstdint>
#include <vector>

using Vec3 = std::array<float, 3>;

/// As light.comp reads it.
struct Pixel {
  Vec3 start;
  float kind;  ///< kNothing, kObject or kGround
  Vec3 normal;
  float unused;
};
inline constexpr float kNothing = 0, kObject = 1, kGround = 2;

struct View {
  uint32_t width, height;
  int up;                    ///< axis
  float azimuth, elevation;  ///< of the camera about the object's middle, in degrees
  // From place():
  Vec3 position{}, target{};
};
inline constexpr float kFov = 40;  ///< degrees, from bottom to top

/// A direction from angles in degrees, seen from the origin.
Vec3 towards(int up, float azimuth, float elevation);
/// Moves the camera so that the whole object is seen.
void place(View& view, const NifObjectInfo& object);
/// The pixels, row by row from the top. The scene has the object alone. It stands on the ground, which is infinite.
std::vector<Pixel> look(const View& view, const nifkit::Scene& scene, const NifObjectInfo& object);
