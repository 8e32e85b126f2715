// Linear and logarithmic axes with ticks at 1, 2 and 5 times powers of ten, curves of straight lines
// between dots, and a legend beside each panel.
#include "tools/common/curves.hpp"

#include <algorithm>
#include <cmath>

#include "formats/base/quantities.hpp"
#include "tools/common/svg.hpp"

namespace nif::tools {
namespace {

constexpr double kWidth = 860, kMargin = 32, kLeft = 90, kRight = 600, kLowestPanel = 200, kBelowPanel = 70,
                 kLegendStep = 18;

/// A logarithmic or a linear axis from pixel `from` to pixel `to`.
struct Axis {
  double low, high, from, to;
  bool logarithmic;
  double at(double value) const {
    const double share = logarithmic ? std::log(std::max(value, low) / low) / std::log(high / low)
                                     : (value - low) / (high - low);
    return from + (to - from) * share;
  }
};

/// 1, 2 and 5 times powers of ten within the range, or only 1 times powers of ten if those are many.
std::vector<double> ticks_of(const Axis& axis) {
  std::vector<double> ticks;
  if (axis.logarithmic) {
    const bool all = axis.high < 1e3 * axis.low;
    for (double power = std::pow(10, std::floor(std::log10(axis.low))); power <= axis.high; power *= 10)
      for (const double digit : {1, 2, 5})
        if ((all || digit == 1) && power * digit >= axis.low * 0.999 && power * digit <= axis.high * 1.001)
          ticks.push_back(power * digit);
  } else {
    const double rough = (axis.high - axis.low) / 4, power = std::pow(10, std::floor(std::log10(rough)));
    const double step = power * (rough / power >= 5 ? 5 : rough / power >= 2 ? 2 : 1);
    for (double tick = std::ceil(axis.low / step) * step; tick <= axis.high + step / 1000; tick += step)
      ticks.push_back(tick);
  }
  return ticks;
}

Axis axis_over(std::vector<double> values, bool logarithmic, double from, double to) {
  if (values.empty()) values = {1};
  const auto [low, high] = std::ranges::minmax_element(values);
  if (logarithmic) return {*low / 1.2, *high * 1.2, from, to, true};
  const double room = std::max(0.05 * (*high - *low), 1e-3);
  return {std::max(0.0, *low - room), *high + room, from, to, false};
}

/// Returns the height of the panel.
double draw(Svg& svg, const CurvePanel& panel, double top) {
  const auto shown = [](const Curve& curve) { return !curve.points.empty(); };
  const double height =
      std::max(kLowestPanel, 20 + kLegendStep * double(std::ranges::count_if(panel.curves, shown)));
  svg.text(kMargin, top, "panel", panel.title);
  top += 16;
  std::vector<double> bytes, values;
  for (const Curve& curve : panel.curves) {
    for (const CurvePoint& point : curve.points) {
      bytes.push_back(point.bytes);
      values.push_back(point.value);
    }
  }
  const Axis x = axis_over(bytes, true, kLeft, kRight),
             y = axis_over(values, panel.logarithmic, top + height, top);
  for (const double tick : ticks_of(x)) {
    svg.line(x.at(tick), top, x.at(tick), top + height, "#e2e8f0");
    svg.text(x.at(tick), top + height + 16, "tick", format_bytes(tick));
  }
  for (const double tick : ticks_of(y)) {
    svg.line(kLeft, y.at(tick), kRight, y.at(tick), "#e2e8f0");
    svg.text(kLeft - 8, y.at(tick) + 4, "name", panel.tick(tick));
  }
  double legend = top + 10;
  for (const Curve& curve : panel.curves) {
    if (!shown(curve)) continue;
    const CurvePoint* before = nullptr;
    for (const CurvePoint& point : curve.points) {
      const double px = x.at(point.bytes), py = y.at(point.value);
      if (before) svg.line(x.at(before->bytes), y.at(before->value), px, py, curve.colour, 2);
      svg.dot(px, py, 3.5, curve.colour);
      before = &point;
    }
    svg.dot(kRight + 18, legend - 4, 4, curve.colour);
    svg.text(kRight + 28, legend, "", curve.name);
    legend += kLegendStep;
  }
  return height + kBelowPanel;
}

}  // namespace

std::string curves_plot(const std::string& title, const std::vector<CurvePanel>& panels) {
  Svg svg;
  double y = kMargin;
  svg.text(kMargin, y + 14, "title", title);
  y += 50;
  for (const CurvePanel& panel : panels) y += draw(svg, panel, y);
  return svg.document(kWidth, y - 20, title);
}

}  // namespace nif::tools
