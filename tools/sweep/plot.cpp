#include "tools/sweep/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "formats/base/quantities.hpp"
#include "tools/common/svg.hpp"

namespace nif::tools {
namespace {

constexpr double kWidth = 760, kMargin = 32, kLeft = 90, kRight = 600, kPanelHeight = 200, kPanelStep = 270;
constexpr std::array<const char*, bake::kRaySets.size()> kColours{"#c2410c", "#1d4ed8", "#7c3aed", "#15803d",
                                                                  "#ca8a04"};

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

using ValueOf = std::function<std::optional<double>(const SweepPoint&, bake::RaySet)>;

struct Panel {
  std::string title;
  bool logarithmic;
  ValueOf value;
  std::function<std::string(double)> tick;
};

/// 1, 2 and 5 times powers of ten within the range; where these are few.
std::vector<double> ticks_of(const Axis& axis) {
  std::vector<double> ticks;
  if (axis.logarithmic) {
    for (double power = std::pow(10, std::floor(std::log10(axis.low))); power <= axis.high; power *= 10)
      for (const double digit : {1, 2, 5})
        if (power * digit >= axis.low * 0.999 && power * digit <= axis.high * 1.001)
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
  auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (logarithmic) return {*low / 1.2, *high * 1.2, from, to, true};
  const double room = std::max(0.05 * (*high - *low), 1e-3);
  return {std::max(0.0, *low - room), *high + room, from, to, false};
}

void draw(Svg& svg, const Panel& panel, const std::vector<SweepPoint>& points, double top) {
  svg.text(kMargin, top, "panel", panel.title);
  top += 16;
  std::vector<double> bytes, values;
  for (const SweepPoint& point : points) {
    bytes.push_back(double(point.file_bytes));
    for (const bake::RaySet set : bake::kRaySets)
      if (const auto value = panel.value(point, set)) values.push_back(*value);
  }
  const Axis x = axis_over(bytes, true, kLeft, kRight),
             y = axis_over(values, panel.logarithmic, top + kPanelHeight, top);
  for (const double tick : ticks_of(x)) {
    svg.line(x.at(tick), top, x.at(tick), top + kPanelHeight, "#e2e8f0");
    svg.text(x.at(tick), top + kPanelHeight + 16, "tick", format_bytes(tick));
  }
  for (const double tick : ticks_of(y)) {
    svg.line(kLeft, y.at(tick), kRight, y.at(tick), "#e2e8f0");
    svg.text(kLeft - 8, y.at(tick) + 4, "name", panel.tick(tick));
  }
  double legend = top + 10;
  for (const bake::RaySet set : bake::kRaySets) {
    const char* colour = kColours[size_t(set)];
    const SweepPoint* before = nullptr;
    for (const SweepPoint& point : points) {
      const auto value = panel.value(point, set);
      if (!value) continue;
      const double px = x.at(double(point.file_bytes)), py = y.at(*value);
      if (before)
        svg.line(x.at(double(before->file_bytes)), y.at(*panel.value(*before, set)), px, py, colour, 2);
      svg.dot(px, py, 3.5, colour);
      before = &point;
    }
    if (!before) continue;
    svg.dot(kRight + 18, legend - 4, 4, colour);
    svg.text(kRight + 28, legend, "", bake::name_of(set));
    legend += 18;
  }
}

std::optional<double> ratio_of(const SweepPoint& point, bake::RaySet set) {
  for (const SetSpeeds& speeds : point.speeds)
    if (speeds.set == set) return speeds.ratio_to_best().median;
  return std::nullopt;
}

}  // namespace

std::string sweep_plot(const std::string& title, const std::vector<SweepPoint>& points) {
  const auto percent = [](double value) { return fmt::format("{:g} %", value); };
  const auto measured = [](const SweepPoint& point, bake::RaySet set) {
    return point.sets[size_t(set)].rays > 0;
  };
  std::vector<Panel> panels{{"wrong answers, against the bytes of the file", true,
                             [&](const SweepPoint& point, bake::RaySet set) -> std::optional<double> {
                               const double error = 100 * point.sets[size_t(set)].error();
                               return measured(point, set) && error > 0 ? std::optional(error) : std::nullopt;
                             },
                             percent},
                            {"certain answers", false,
                             [&](const SweepPoint& point, bake::RaySet set) -> std::optional<double> {
                               const bake::Accuracy& a = point.sets[size_t(set)];
                               return measured(point, set) ? std::optional(100 * a.rate(a.certain))
                                                           : std::nullopt;
                             },
                             percent}};
  if (std::ranges::any_of(points, [](const SweepPoint& point) { return !point.speeds.empty(); }))
    panels.push_back({"speed on one thread, times that of the fastest Embree", false, ratio_of,
                      [](double value) { return fmt::format("{:g} x", value); }});
  Svg svg;
  double y = kMargin;
  svg.text(kMargin, y + 14, "title", title);
  y += 50;
  for (const Panel& panel : panels) {
    draw(svg, panel, points, y);
    y += kPanelStep;
  }
  return svg.document(kWidth, y - 20, title);
}

}  // namespace nif::tools
