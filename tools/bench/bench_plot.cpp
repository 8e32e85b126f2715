// Layout only, in pixels: a panel for each number of threads, bars for medians, and thin lines from the
// lowest round to the highest.
#include "tools/bench/bench_plot.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "formats/base/quantities.hpp"
#include "tools/bench/bench_report.hpp"
#include "tools/common/svg.hpp"

namespace nif::tools {
namespace {

// Lengths are in pixels of the picture at its natural size.
constexpr double kWidth = 960, kMargin = 32;
constexpr double kBarLeft = 150, kBarRight = 630, kCallLeft = 690;
constexpr double kBarHeight = 15, kBarStep = 20;
constexpr double kSetHeader = 26, kSetGap = 14;
constexpr double kPanelHeader = 34, kAxis = 40;

constexpr const char *kNifColour = "#c2410c", *kEntrantColour = "#0f766e";
constexpr std::array<const char*, kEmbreeBuilds.size()> kBuildColours{"#475569", "#64748b", "#94a3b8",
                                                                      "#b6c2d2"};

/// A step of 1, 2 or 5 times a power of ten that divides the axis into four to ten.
double tick_step(double most) {
  const double power = std::pow(10, std::floor(std::log10(most / 4)));
  const double rest = most / 4 / power;
  return power * (rest >= 5 ? 5 : rest >= 2 ? 2 : 1);
}

/// Converts million rays per second to pixels.
struct Scale {
  double most, step;
  double x(double rate) const { return kBarLeft + (kBarRight - kBarLeft) * rate / most; }
};

Scale scale_for(const ThreadRun& run) {
  double most = 1e-3;
  for (const SetSpeeds& speeds : run.sets) {
    most = std::max(most, speeds.rate().highest);
    for (size_t b = 0; b < kEmbreeBuilds.size(); ++b) most = std::max(most, speeds.best(b).rate().highest);
    for (const EntrantSpeed& one : speeds.entrants) most = std::max(most, one.rate().highest);
  }
  const double step = tick_step(most);
  return {std::ceil(most / step) * step, step};
}

double height_of(const SetSpeeds& speeds) {
  return kSetHeader + kBarStep * double(1 + kEmbreeBuilds.size() + speeds.entrants.size()) + kSetGap;
}

double height_of(const ThreadRun& run) {
  double height = kPanelHeader + kAxis;
  for (const SetSpeeds& speeds : run.sets) height += height_of(speeds);
  return height;
}

/// A name of others, for the space that there is.
std::string shortened(const std::string& name, size_t most) {
  if (name.size() <= most) return name;
  size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) --end;  // a whole UTF-8 character
  return name.substr(0, end) + "...";
}

struct Bar {
  std::string name, call;
  Spread rate;
  std::optional<double> bytes;
  const char* colour;
  bool ours;
};

void draw_bar(Svg& svg, const Scale& scale, const Bar& bar, double y) {
  const double base = y + kBarHeight - 3, middle = y + kBarHeight / 2, end = scale.x(bar.rate.median);
  svg.text(kBarLeft - 8, base, bar.ours ? "name nif" : "name", bar.name);
  svg.box(kBarLeft, y, end - kBarLeft, kBarHeight, bar.colour);
  const double low = scale.x(bar.rate.lowest), high = scale.x(bar.rate.highest);
  svg.line(low, middle, high, middle, "#0f172a");
  for (double x : {low, high}) svg.line(x, middle - 3, x, middle + 3, "#0f172a");
  svg.text(std::max(end, high) + 6, base, bar.ours ? "nif" : "", format_rate(bar.rate.median));
  svg.text(kCallLeft, base, "note", bar.call);
  if (bar.bytes) svg.text(kWidth - kMargin, base, bar.ours ? "name nif" : "name", format_bytes(*bar.bytes));
}

void draw_set(Svg& svg, const Scale& scale, const SetSpeeds& speeds, const BenchResult& result, double y) {
  const bake::Accuracy& a = speeds.accuracy;
  svg.text(kMargin, y + 16, "set", bake::name_of(speeds.set));
  svg.text(kBarLeft, y + 16, "",
           fmt::format("{:.3f} % wrong ({:.3f} % leak, {:.3f} % spurious), {:.1f} % certain", 100 * a.error(),
                       100 * a.rate(a.leak), 100 * a.rate(a.spurious), 100 * a.rate(a.certain)));
  svg.text(kCallLeft, y + 16, "set",
           fmt::format("{} x the best Embree", format_rate(speeds.ratio_to_best().median)));
  y += kSetHeader;
  draw_bar(svg, scale, {"nif", "", speeds.rate(), double(result.info.resident_bytes), kNifColour, true}, y);
  for (size_t b = 0; b < kEmbreeBuilds.size(); ++b) {
    const EmbreeVariant& variant = speeds.best(b);
    y += kBarStep;
    draw_bar(svg, scale,
             {fmt::format("Embree {}", name_of(kEmbreeBuilds[b])),
              fmt::format("{}{}", bake::name_of(variant.call), variant.coherent ? " coherent" : ""),
              variant.rate(), double(result.embree_bytes[b]), kBuildColours[b], false},
             y);
  }
  for (const EntrantSpeed& one : speeds.entrants) {
    y += kBarStep;
    const std::optional<double> bytes = one.bytes ? std::optional(double(*one.bytes)) : std::nullopt;
    draw_bar(
        svg, scale,
        {shortened(one.program, 20), shortened(one.variant, 26), one.rate(), bytes, kEntrantColour, false},
        y);
  }
}

void draw_run(Svg& svg, const ThreadRun& run, const BenchResult& result, double y) {
  const Scale scale = scale_for(run);
  const double bottom = y + height_of(run) - kAxis;
  svg.text(kMargin, y + 16, "panel", fmt::format("{}, isa {}", count_of(run.threads, "thread"), result.isa));
  svg.text(kCallLeft, y + 16, "note", "fastest call");
  svg.text(kWidth - kMargin, y + 16, "name note", "memory");
  y += kPanelHeader;
  for (double rate = 0; rate < scale.most + scale.step / 2; rate += scale.step) {
    svg.line(scale.x(rate), y, scale.x(rate), bottom - kSetGap + 6, "#e2e8f0");
    svg.text(scale.x(rate), bottom + 8, "tick", fmt::format("{:g}", rate));
  }
  svg.text((kBarLeft + kBarRight) / 2, bottom + 26, "tick", "million rays per second");
  for (const SetSpeeds& speeds : run.sets) {
    draw_set(svg, scale, speeds, result, y);
    y += height_of(speeds);
  }
}

}  // namespace

std::string bench_plot(const PlotHead& head, const BenchResult& result) {
  Svg svg;
  const std::string title =
      fmt::format("{} and Embree {}{}", std::filesystem::path(head.file).filename().string(),
                  bake::embree_version(), head.hits ? ": first hits" : "");
  double y = kMargin;
  svg.text(kMargin, y + 14, "title", title);
  svg.text(kMargin, y + 36, "note",
           fmt::format("{}, {} of each set, median of {} (lines: lowest to highest){}{}", head.measured,
                       count_of(head.rays, "ray"), count_of(head.rounds, "round"),
                       processor_name().empty() ? "" : ", ", processor_name()));
  y += 64;
  for (const ThreadRun& run : result.runs) {
    draw_run(svg, run, result, y);
    y += height_of(run) + 20;
  }
  return svg.document(kWidth, y - 20 + kMargin / 2, title);
}

}  // namespace nif::tools
