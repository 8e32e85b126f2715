// Draws all plots as SVG documents in one style.
#pragma once

#include <string>
#include <string_view>

namespace nif::tools {

/// Lengths are in pixels of the picture at its natural size; y grows downward. `style` is one of the classes
/// title, panel, set, name (ends at x), nif, tick (centred at x), note, or empty.
class Svg {
 public:
  void text(double x, double y, std::string_view style, std::string_view content);
  void box(double x, double y, double width, double height, std::string_view colour);
  void line(double x1, double y1, double x2, double y2, std::string_view colour, double width = 1);
  void dot(double x, double y, double radius, std::string_view colour);
  std::string document(double width, double height, std::string_view title) const;

 private:
  std::string body_;
};

}  // namespace nif::tools
