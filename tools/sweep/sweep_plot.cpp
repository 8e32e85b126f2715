// Selects the values, and leaves the drawing to curves.hpp. An error of 0 has no place on a logarithmic axis,
// so its point is left out.
#include "tools/sweep/sweep_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "tools/common/curves.hpp"

namespace nif::tools {
namespace {

constexpr std::array<const char*, bake::kRaySets.size()> kColours{"#c2410c", "#1d4ed8", "#7c3aed", "#15803d",
                                                                  "#ca8a04"};

using ValueOf = std::function<std::optional<double>(const SweepPoint&, bake::RaySet)>;

std::vector<Curve> curves_of(const std::vector<SweepPoint>& points, const ValueOf& value_of) {
  std::vector<Curve> curves;
  for (const bake::RaySet set : bake::kRaySets) {
    Curve& curve = curves.emplace_back(Curve{std::string(bake::name_of(set)), kColours[size_t(set)], {}});
    for (const SweepPoint& point : points)
      if (const auto value = value_of(point, set)) curve.points.push_back({double(point.file_bytes), *value});
  }
  return curves;
}

std::optional<double> error_of(const SweepPoint& point, bake::RaySet set) {
  const double error = 100 * point.sets[size_t(set)].error();
  return error > 0 ? std::optional(error) : std::nullopt;
}

std::optional<double> certain_of(const SweepPoint& point, bake::RaySet set) {
  const bake::Accuracy& a = point.sets[size_t(set)];
  return a.rays > 0 ? std::optional(100 * a.rate(a.certain)) : std::nullopt;
}

std::optional<double> ratio_of(const SweepPoint& point, bake::RaySet set) {
  for (const SetSpeeds& speeds : point.speeds)
    if (speeds.set == set) return speeds.ratio_to_best().median;
  return std::nullopt;
}

}  // namespace

std::string sweep_plot(const std::string& title, const std::vector<SweepPoint>& points) {
  const auto percent = [](double value) { return fmt::format("{:g} %", value); };
  std::vector<CurvePanel> panels{
      {"wrong answers, against the bytes of the file", true, curves_of(points, error_of), percent},
      {"certain answers", false, curves_of(points, certain_of), percent}};
  if (std::ranges::any_of(points, [](const SweepPoint& point) { return !point.speeds.empty(); }))
    panels.push_back({"speed on one thread, times that of the fastest Embree", false,
                      curves_of(points, ratio_of),
                      [](double value) { return fmt::format("{:g} x", value); }});
  return curves_plot(title, panels);
}

}  // namespace nif::tools
