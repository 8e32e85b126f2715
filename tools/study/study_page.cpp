// The verdicts come first: at each number of bytes, which of `segment` and the best simplified mesh answers
// fewer rays wrongly? Then tables, curves and pictures, with one colour for each family.
#include "tools/study/study_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "formats/base/quantities.hpp"
#include "tools/common/curves.hpp"
#include "tools/common/page.hpp"

namespace nif::tools {
namespace {

/// Resident bytes near which pictures are compared.
constexpr double kPictured = 300e3;

std::string percent(double share) { return fmt::format("{:.3g} %", 100 * share); }
std::string times(double ratio) { return fmt::format("{:.2f} x", ratio); }

/// nifkit's own encodings in warm colours, simplified meshes in cold ones, volumes in green, the rest in
/// grey.
std::string_view colour_of(const std::string& family) {
  static const std::map<std::string, std::string_view, std::less<>> kColours{
      {"segment", "#c2410c"},
      {"exact", "#b91c1c"},
      {"bvh", "#d97706"},
      {"proof, then Embree", "#db2777"},
      {"spherical", "#a16207"},
      {"OpenMesh: Embree", "#1d4ed8"},
      {"OpenMesh: Embree compact", "#60a5fa"},
      {"OpenMesh: exact", "#7c3aed"},
      {"meshoptimizer: Embree", "#0e7490"},
      {"meshoptimizer: Embree compact", "#22d3ee"},
      {"meshoptimizer: exact", "#a78bfa"},
      {"distance field", "#15803d"},
      {"voxels", "#65a30d"}};
  const auto found = kColours.find(family);
  return found == kColours.end() ? "#475569" : found->second;
}

using ValueOfPoint = std::function<std::optional<double>(const RivalPoint&)>;

std::vector<Curve> curves_of(const Study& study, const ValueOfPoint& value_of) {
  std::vector<Curve> curves;
  for (const std::string& family : families_of(study)) {
    Curve& curve = curves.emplace_back(Curve{family, colour_of(family), {}});
    for (const RivalPoint& point : study.points) {
      if (point.family != family || !point.measured()) continue;
      if (const auto value = value_of(point); value && *value > 0)
        curve.points.push_back({double(point.resident_bytes), *value});
    }
    std::ranges::stable_sort(curve.points, {}, &CurvePoint::bytes);
  }
  return curves;
}

std::string curves_section(const Study& study) {
  const auto error_percent = [](double value) { return fmt::format("{:g} %", value); };
  const auto ratio_times = [](double value) { return fmt::format("{:g} x", value); };
  std::vector<CurvePanel> panels{
      {"wrong answers, mean of all ray sets", true,
       curves_of(study, [](const RivalPoint& point) { return std::optional(100 * point.error()); }),
       error_percent}};
  for (const char* set : {"outer-lines", "inner-surface", "sun"}) {
    panels.push_back({fmt::format("wrong answers, {}", set), true,
                      curves_of(study,
                                [&](const RivalPoint& point) -> std::optional<double> {
                                  const auto found = point.sets.find(set);
                                  if (found == point.sets.end()) return std::nullopt;
                                  return 100 * found->second.error();
                                }),
                      error_percent});
  }
  for (const char* set : {"outer-lines", "inner-surface", "sun"}) {
    panels.push_back({fmt::format("speed on one thread, {}, times Embree on the whole mesh", set), true,
                      curves_of(study, [&](const RivalPoint& point) { return point.ratio(set); }),
                      ratio_times});
  }
  const std::string plot = curves_plot(study.key.mesh, panels);
  return html_section(
      "Curves", "Over bytes in memory, both axes logarithmic. An error of 0 has no point.",
      fmt::format("<img class=\"plot\" alt=\"Error and speed over bytes, by rival; the table below has all "
                  "figures\" src=\"{}\">\n",
                  data_address("image/svg+xml", plot)));
}

/// What the reader wants to know first: our encoding against the best simplified mesh, and where ours loses.
std::string verdicts(const Study& study) {
  std::string html;
  for (const double bytes : kBudgets) {
    const std::optional<AtBytes> own = at_bytes(study, "segment", bytes);
    std::string best;
    std::optional<AtBytes> other;
    for (const std::string& family : families_of(study)) {
      if (!is_simplified(family)) continue;
      const std::optional<AtBytes> at = at_bytes(study, family, bytes);
      if (at && (!other || at->error < other->error)) other = at, best = family;
    }
    if (!own && !other) continue;
    std::string said;
    if (!own) {
      said = "segment has no size that small";
    } else if (!other) {
      said = fmt::format("segment: {} wrong; no simplified mesh is that small", percent(own->error));
    } else {
      said = fmt::format("{}: segment answers {} wrongly, the best simplified mesh ({}) {}",
                         own->error < other->error ? "segment wins" : "segment loses", percent(own->error),
                         best, percent(other->error));
    }
    html += fmt::format("<li>At {} in memory: {}.</li>\n", format_bytes(bytes), escaped(said));
  }
  return html.empty() ? "" : "<ul>\n" + html + "</ul>\n";
}

std::string equal_bytes_section(const Study& study) {
  std::vector<PageTable::Column> columns{{"rival"}};
  for (const double bytes : kBudgets)
    for (const char* what : {"wrong", "outer-lines", "sun"})
      columns.push_back({fmt::format("{}: {}", format_bytes(bytes), what), PageTable::Kind::number});
  PageTable table(columns);
  for (const std::string& family : families_of(study)) {
    std::vector<std::optional<AtBytes>> all;
    for (const double bytes : kBudgets) all.push_back(at_bytes(study, family, bytes));
    if (std::ranges::none_of(all, [](const auto& at) { return at.has_value(); })) continue;
    table.row();
    table.cell(escaped(family), family);
    const auto cell = [&](const std::optional<double>& value, const auto& shown, const char* mark) {
      table.cell(value ? shown(*value) + mark : "", value ? fmt::format("{}", *value) : "");
    };
    for (const std::optional<AtBytes>& at : all) {
      const char* mark = at && at->largest ? "*" : "";
      cell(at ? std::optional(at->error) : std::nullopt, percent, mark);
      cell(at ? at->outer : std::nullopt, times, mark);
      cell(at ? at->sun : std::nullopt, times, mark);
    }
  }
  return html_section(
      "At equal bytes",
      "In memory, between the two nearest sizes of each rival. Wrong: the mean of all ray sets. "
      "Speeds are times that of Embree on the whole mesh. *: its largest size is smaller.",
      table.html());
}

std::string pictures_section(const Study& study,
                             const std::function<std::string(const std::string&)>& picture) {
  const auto shown = [&](const std::string& name, const std::string& what) {
    return fmt::format("<img alt=\"{}\" loading=\"lazy\" src=\"{}\">", escaped(what),
                       png_address(picture(name)));
  };
  std::string html = fmt::format(
      "<figure><div class=\"row\">{}</div><figcaption>All triangles, by Embree"
      "</figcaption></figure>\n",
      shown(kReferencePicture, "All triangles"));
  for (const std::string& family : families_of(study)) {
    const RivalPoint* nearest = nullptr;
    const auto distance = [](const RivalPoint& point) {
      return std::abs(std::log(double(point.resident_bytes) / kPictured));
    };
    for (const RivalPoint& point : study.points)
      if (point.family == family && point.measured() && (!nearest || distance(point) < distance(*nearest)))
        nearest = &point;
    if (!nearest) continue;
    html += fmt::format(
        "<figure><div class=\"row\">{}{}</div><figcaption>{}, {}: {} in memory, {} of these answers "
        "wrong</figcaption></figure>\n",
        shown(nearest->picture, family), shown(nearest->errors, "Where it is wrong"), escaped(family),
        escaped(nearest->size), format_bytes(double(nearest->resident_bytes)), percent(nearest->view_wrong));
  }
  return html_section(
      "Pictures",
      fmt::format("Each rival at the size nearest to {}. A sun and ambient light, 16 rays per pixel, "
                  "and where these are answered wrongly, from yellow (few) to red (many).",
                  format_bytes(kPictured)),
      "<div class=\"gallery\">\n" + html + "</div>\n");
}

std::string all_section(const Study& study) {
  std::vector<PageTable::Column> columns{{"rival"},
                                         {"in memory", PageTable::Kind::number},
                                         {"file", PageTable::Kind::number},
                                         {"made in", PageTable::Kind::number},
                                         {"wrong", PageTable::Kind::number},
                                         {"leak", PageTable::Kind::number},
                                         {"spurious", PageTable::Kind::number}};
  for (const char* set : {"outer-lines", "inner-surface", "sun"}) {
    columns.push_back({fmt::format("{}: wrong", set), PageTable::Kind::number});
    columns.push_back({fmt::format("{}: speed", set), PageTable::Kind::number});
  }
  PageTable table(columns);
  std::string left_out;
  for (const RivalPoint& point : study.points) {
    const std::string name = fmt::format("{}, {}", point.family, point.size);
    if (!point.measured()) {
      left_out += fmt::format("<li>{}: {}</li>\n", escaped(name), escaped(point.left_out));
      continue;
    }
    table.row();
    table.cell(escaped(name), name);
    const auto number = [&](const std::string& text, double value) {
      table.cell(text, fmt::format("{}", value));
    };
    number(format_bytes(double(point.resident_bytes)), double(point.resident_bytes));
    if (point.file_bytes)
      number(format_bytes(double(point.file_bytes)), double(point.file_bytes));
    else
      table.cell("", "");
    number(fmt::format("{:.1f} s", point.seconds), point.seconds);
    double leak = 0, spurious = 0;
    for (const auto& [key, set] : point.sets) leak += set.leak, spurious += set.spurious;
    const double count = std::max<double>(1, double(point.sets.size()));
    number(percent(point.error()), point.error());
    number(percent(leak / count), leak / count);
    number(percent(spurious / count), spurious / count);
    for (const char* set : {"outer-lines", "inner-surface", "sun"}) {
      const auto found = point.sets.find(set);
      if (found == point.sets.end() || !found->second.ratio) {
        table.cell("", ""), table.cell("", "");
        continue;
      }
      number(percent(found->second.error()), found->second.error());
      number(times(*found->second.ratio), *found->second.ratio);
    }
  }
  std::string html =
      html_section("All sizes",
                   "Wrong, leak and spurious: means of all ray sets. Speeds: times Embree's fastest "
                   "call on the whole mesh, on one thread, in the same rounds.",
                   table.html());
  if (!left_out.empty())
    html += html_section("Left out", "What could not be made of this mesh, and why.",
                         "<ul>\n" + left_out + "</ul>\n");
  return html;
}

}  // namespace

std::string study_page(const Study& study, const std::function<std::string(const std::string&)>& picture) {
  const StudyKey& key = study.key;
  std::string body = fmt::format(
      "<h1>{}: ways to answer visibility</h1>\n<p>{}; {} rays a set, seed {}; nifkit {}{}{}.</p>\n",
      escaped(key.mesh), count_of(key.triangles, "triangle"), key.rays, key.seed, escaped(key.version),
      key.processor.empty() ? "" : " on " + escaped(key.processor),
      key.quick ? "; a quick study: two sizes of each, and little training" : "");
  if (const std::string note = flattened_note(study); !note.empty())
    body += fmt::format("<p>{}.</p>\n", escaped(note));
  body += verdicts(study);
  body += equal_bytes_section(study) + curves_section(study) + pictures_section(study, picture) +
          all_section(study);
  return html_page(key.mesh, body);
}

}  // namespace nif::tools
