// Builds storeys with windows: the walls of a building, and the details of its windows.
#pragma once

#include "mesh/generate/assembly.hpp"

namespace nif::generate {

struct Facade {
  double storey = 2.9;  ///< height of a storey
  size_t storeys = 2;
  double plinth = 0.3;            ///< height of the lowest floor
  double sill = 0.9, head = 2.2;  ///< of windows, above their floor
  double bay = 3, window = 1.2;   ///< approximate distance between windows, and their width
  double recess = 0.16;           ///< depth of windows
  double top() const { return plinth + storey * double(storeys) + 0.2; }
};

/// A rectangle of this size around `centre`, whose first side is the front.
std::vector<Ground> rectangle(double x, double z, const Ground& centre = {0, 0});

/// An opening of a facade.
struct Opening {
  size_t side, bay, storey;
  double from, to, low, high;  ///< along the side, and heights
};

/// Windows in each bay of each storey on all sides, except where `closed` returns true. Returns the openings.
std::vector<Opening> windows_of(const Facade& facade, Wall& wall,
                                const std::function<bool(size_t side, size_t bay, size_t storey)>& closed);

/// A sill in front of the window, and bars in it: one vertical and `transoms` horizontal ones.
void add_window(Assembly& assembly, const Facade& facade, const Wall& wall, const Opening& opening,
                size_t transoms);
void add_shutters(Assembly& assembly, const Wall& wall, const Opening& opening);
/// A slab with a railing.
void add_balcony(Assembly& assembly, const Wall& wall, const Opening& opening, double floor);
/// A door with a frame, at `middle` along its side, and steps up to its floor.
void add_door(Assembly& assembly, const Wall& wall, size_t side, double middle, double floor);

}  // namespace nif::generate
