// Plots curves over bytes, one panel below the other.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace nif::tools {

struct CurvePoint {
  double bytes;  ///< above 0
  double value;  ///< above 0 in a panel with a logarithmic axis
};

/// Points in the order in which they are connected. An empty curve is left out.
struct Curve {
  std::string name;
  std::string_view colour;  ///< in CSS notation
  std::vector<CurvePoint> points;
};

struct CurvePanel {
  std::string title;
  bool logarithmic;  ///< whether the axis of values is; that of bytes always is
  std::vector<Curve> curves;
  std::function<std::string(double)> tick;  ///< formats a value for the axis
};

/// An SVG document.
std::string curves_plot(const std::string& title, const std::vector<CurvePanel>& panels);

}  // namespace nif::tools
