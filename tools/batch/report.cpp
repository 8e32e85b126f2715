#include "tools/batch/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>

#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "tools/batch/claims.hpp"
#include "tools/batch/record.hpp"
#include "tools/common/child.hpp"
#include "tools/common/interruption.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Outcome = BatchItem::Outcome;

size_t count(std::span<const BatchItem> items, Outcome outcome) {
  return size_t(std::ranges::count(items, outcome, &BatchItem::outcome));
}

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[word >> (18 - 6 * k) & 63];
  }
  return out;
}

/// A number of a report, as text; a dash where there is none.
template <class Use>
std::string from(const Json& report, const char* pointer, Use&& use) {
  const Json::json_pointer at(pointer);
  return report.is_object() && report.contains(at) && report[at].is_number() ? use(report[at].get<double>())
                                                                             : "\u2013";
}

constexpr const char* kStyle =
    "body{font:15px/1.4 system-ui,sans-serif;margin:2em;color:#222;background:#fff}"
    "table{border-collapse:collapse}img{display:block}.failed{background:#fdeaea}.note{color:#666;font-size:"
    "13px}"
    "td,th{padding:.35em .8em;text-align:right;border-bottom:1px solid "
    "#ddd;vertical-align:middle;white-space:nowrap}"
    "th{position:sticky;top:0;background:#fff}td:first-child,th:nth-child(-n+2){text-align:left;white-space:"
    "normal}";

}  // namespace

Json to_json(const Manifest& manifest, std::span<const BatchItem> items, double seconds) {
  Json assets = Json::array();
  for (const BatchItem& item : items) {
    Json json{{"output", item.asset.output},
              {"mesh", item.asset.mesh},
              {"options", item.asset.options},
              {"outcome", name_of(item.outcome)},
              {"reason", item.reason}};
    if (item.outcome == Outcome::failed) {
      json["code"] = item.code;
      json["error"] = item.error;
    }
    json["report"] = item.report;
    assets.push_back(std::move(json));
  }
  Json json{{"schema", kBatchSchema}, {"manifest", manifest.file}, {"seconds", seconds}};
  for (Outcome outcome : {Outcome::baked, Outcome::current, Outcome::failed, Outcome::left})
    json[name_of(outcome)] = count(items, outcome);
  json["assets"] = std::move(assets);
  return json;
}

void make_thumbnails(const Manifest& manifest, std::span<const BatchItem> items,
                     const std::function<void(double, const std::string&)>& progress) {
  const Records records(manifest);
  Claims claims(manifest);
  const std::atomic<bool>& cancel = interruption();
  for (size_t i = 0; i < items.size(); ++i) {
    const BatchAsset& asset = items[i].asset;
    const fs::path picture = records.path_for(asset, ".png"), folder = records.path_for(asset, ".pictures"),
                   scene = records.path_for(asset, ".toml");
    std::error_code ignored;
    if (!items[i].report.is_object() || fs::exists(picture, ignored)) continue;
    progress(double(i) / double(items.size()), "a picture of " + asset.name);
    while (!claims.claim(asset) && !cancel) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    // A string of JSON is one of TOML, too.
    const auto quoted = [](const std::string& path) { return Json(fs::absolute(path).string()).dump(); };
    const std::string text = fmt::format(
        "[picture]\nwidth = 320\nheight = 240\nsamples = 8\n[[object]]\nmesh = {}\nnif = {}\n[ground]\n"
        "[[light]]\ntype = \"sun\"\ndirection = [0.5, 0.8, 0.4]\nirradiance = 2\n"
        "[[light]]\ntype = \"sky\"\nradiance = 0.3\n[[camera]]\nfill = 0.8\n",
        quoted(asset.mesh), quoted(asset.output));
    write_output(scene.string(), std::as_bytes(std::span(text)));
    Child child({"render", scene.string(), "-o", folder.string(), "--sheet", picture.string(), "--thumbnail",
                 "160", "--quiet"});
    while (!child.ended()) {
      if (cancel) child.stop();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    fs::remove(scene, ignored);
    fs::remove_all(folder, ignored);
    claims.release(asset);
    if (cancel) throw Error(Status::interrupted, "the report was cancelled");
  }
}

std::string to_html(const Manifest& manifest, std::span<const BatchItem> items) {
  const Records records(manifest);
  const auto bytes = [](double value) { return format_bytes(value); };
  const auto percent = [](double value) { return fmt::format("{:.2f} %", value * 100); };
  const auto seconds = [](double value) { return fmt::format("{:.1f} s", value); };
  const auto whole = [](double value) { return fmt::format("{:.0f}", value); };

  std::string html = fmt::format(
      "<!DOCTYPE html>\n"
      "<html lang=\"en\"><meta charset=\"utf-8\"><title>{0}</title><style>{1}</style>\n"
      "<h1>{0}</h1>\n"
      "<p>{2}: {3} baked, {4} up to date, {5} failed, {6} not started. Pictures: Embree, the asset, and "
      "their difference times 3.</p>\n"
      "<table><tr><th>asset<th>picture<th>triangles<th>file<th>resident<th>wrong, outer-lines<th>wrong, "
      "inner-surface<th>certain, outer-lines<th>bake<th>memory</tr>\n",
      escaped(manifest.file), kStyle, count_of(items.size(), "asset"), count(items, Outcome::baked),
      count(items, Outcome::current), count(items, Outcome::failed), count(items, Outcome::left));
  std::vector<const BatchItem*> order;
  for (const BatchItem& item : items) order.push_back(&item);
  std::ranges::stable_partition(order,
                                [](const BatchItem* item) { return item->outcome == Outcome::failed; });
  for (const BatchItem* item : order) {
    std::string about = item->outcome == Outcome::failed ? item->error : item->reason;
    if (item->outcome == Outcome::current) about = "up to date";
    html += fmt::format("<tr{}><td>{}<div class=\"note\">{}: {}</div>",
                        item->outcome == Outcome::failed ? " class=\"failed\"" : "",
                        escaped(item->asset.name), name_of(item->outcome), escaped(about));
    try {
      const std::string picture(
          mesh::detail::load_file(records.path_for(item->asset, ".png"), 16 << 20).view());
      html += fmt::format("<td><img alt=\"\" src=\"data:image/png;base64,{}\">", base64(picture));
    } catch (const Error&) {
      html += "<td>";
    }
    const Json& report = item->report;
    html += fmt::format(
        "<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>\n", from(report, "/triangles", whole),
        from(report, "/bytes/file", bytes), from(report, "/bytes/resident", bytes),
        from(report, "/sets/outer-lines/error", percent), from(report, "/sets/inner-surface/error", percent),
        from(report, "/sets/outer-lines/certain", percent), from(report, "/seconds", seconds),
        from(report, "/peak_memory", bytes));
  }
  return html + "</table></html>\n";
}

}  // namespace nif::tools
