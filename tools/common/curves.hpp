// Plots of curves over bytes, one panel below the other.
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

/// Points in the order in which a line joins them. A curve without any is left out.
struct Curve {
  std::string name;
  std::string_view colour;  ///< as CSS has it
  std::vector<CurvePoint> points;
};

struct CurvePanel {
  std::string title;
  bool logarithmic;  ///< the axis of values; that of bytes always is
  std::vector<Curve> curves;
  std::function<std::string(double)> tick;  ///< a value as its axis shows it
};

/// An SVG document.
std::string curves_plot(const std::string& title, const std::vector<CurvePanel>& panels);

}  // namespace nif::tools
