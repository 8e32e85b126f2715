// Collects elements as text; document() puts the style sheet around them. Any text is escaped first.
#include "tools/common/svg.hpp"

#include <fmt/format.h>

#include "tools/common/page.hpp"

namespace nif::tools {

void Svg::text(double x, double y, std::string_view style, std::string_view content) {
  body_ +=
      fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"{}\">{}</text>\n", x, y, style, escaped(content));
}
void Svg::box(double x, double y, double width, double height, std::string_view colour) {
  body_ += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n",
                       x, y, width, height, colour);
}
void Svg::line(double x1, double y1, double x2, double y2, std::string_view colour, double width) {
  body_ += fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"{:g}\"/>\n",
      x1, y1, x2, y2, colour, width);
}
void Svg::dot(double x, double y, double radius, std::string_view colour) {
  body_ +=
      fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\"/>\n", x, y, radius, colour);
}
std::string Svg::document(double width, double height, std::string_view title) const {
  return fmt::format(
      R"(<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}">
<title>{2}</title>
<style>
text {{ font: 12px sans-serif; fill: #334155; }}
.title {{ font-size: 20px; font-weight: bold; fill: #0f172a; }}
.panel {{ font-size: 15px; font-weight: bold; fill: #0f172a; }}
.set {{ font-size: 13px; font-weight: bold; fill: #0f172a; }}
.name {{ text-anchor: end; }}
.nif {{ font-weight: bold; fill: #c2410c; }}
.tick {{ text-anchor: middle; fill: #64748b; }}
.note {{ fill: #64748b; }}
</style>
<rect width="100%" height="100%" fill="#ffffff"/>
{3}</svg>
)",
      width, height, escaped(title), body_);
}

}  // namespace nif::tools
