// Describes what lets light through: which materials, how their alpha is read, and what that makes of triangles.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace nif::mesh {

/// What a triangle lets through.
enum class TriangleAlpha : uint8_t {
  solid,  ///< nothing
  cut,    ///< it has holes, or may have some
  clear,  ///< everything: it blocks no ray
};

/// How alpha becomes holes: light passes where alpha is below a cutoff, and nothing is half blocked.
struct AlphaOptions {
  /// Of materials that blend with what is behind them.
  enum class Blend : uint8_t {
    cutoff,  ///< as those with a cutoff
    opaque,  ///< they are solid
    ignore,  ///< rays ignore them: they block nothing
  };

  bool read = false;    ///< otherwise everything is solid
  double cutoff = 0.5;  ///< of materials that blend; others have their own
  Blend blend = Blend::cutoff;
  bool opaque_glass = false;  ///< otherwise materials that transmit light block nothing

  bool operator==(const AlphaOptions&) const = default;
};

/// A material that may let light through, and what became of its triangles.
struct MaterialAlpha {
  /// What decided.
  enum class Rule : uint8_t { mask, blend, glass };

  std::string name;  ///< UTF-8; "material 3" if it has none
  Rule rule = Rule::mask;
  double cutoff = 0;  ///< alpha below it lets light through; 0 also if no alpha was compared
  uint64_t solid = 0, cut = 0, clear = 0;  ///< triangles, of all meshes of the file
};

}  // namespace nif::mesh
