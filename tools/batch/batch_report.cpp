// Pictures come from `nif render` in child processes, on a small scene made for each asset. They are
// kept in the state folder until the asset is baked again.
#include "tools/batch/batch_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "tools/batch/claims.hpp"
#include "tools/batch/record.hpp"
#include "tools/common/child.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/page.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Outcome = BatchItem::Outcome;

size_t count(std::span<const BatchItem> items, Outcome outcome) {
  return size_t(std::ranges::count(items, outcome, &BatchItem::outcome));
}

std::optional<double> number_at(const Json& report, const char* pointer) {
  const Json::json_pointer at(pointer);
  if (!report.is_object() || !report.contains(at) || !report[at].is_number()) return std::nullopt;
  return report[at].get<double>();
}

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
    // A JSON string is also a TOML string.
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
  struct Number {
    const char *name, *pointer;
    std::string (*shown)(double);
  };
  const auto bytes = [](double value) { return format_bytes(value); };
  const auto percent = [](double value) { return fmt::format("{:.2f} %", value * 100); };
  const Number numbers[] = {
      {"triangles", "/triangles", [](double value) { return fmt::format("{:.0f}", value); }},
      {"file", "/bytes/file", bytes},
      {"resident", "/bytes/resident", bytes},
      {"wrong, outer-lines", "/sets/outer-lines/error", percent},
      {"wrong, inner-surface", "/sets/inner-surface/error", percent},
      {"certain, outer-lines", "/sets/outer-lines/certain", percent},
      {"bake", "/seconds", [](double value) { return fmt::format("{:.1f} s", value); }},
      {"memory", "/peak_memory", bytes}};

  std::vector<PageTable::Column> columns{{"asset"}};
  for (const Number& number : numbers) columns.push_back({number.name, PageTable::Kind::number});
  columns.push_back({"picture", PageTable::Kind::picture});
  PageTable table(std::move(columns));
  std::vector<const BatchItem*> order;
  for (const BatchItem& item : items) order.push_back(&item);
  std::stable_partition(order.begin(), order.end(),
                        [](const BatchItem* item) { return item->outcome == Outcome::failed; });
  for (const BatchItem* item : order) {
    const bool failed = item->outcome == Outcome::failed;
    const std::string about = failed                              ? item->error
                              : item->outcome == Outcome::current ? "up to date"
                                                                  : item->reason;
    table.row(failed ? "failed" : "");
    table.cell(fmt::format("{}<div class=\"note\">{}: {}</div>", escaped(item->asset.name),
                           name_of(item->outcome), escaped(about)),
               item->asset.name);
    for (const Number& number : numbers) {
      const std::optional<double> value = number_at(item->report, number.pointer);
      table.cell(value ? number.shown(*value) : "\u2013", value ? fmt::format("{}", *value) : "");
    }
    std::string picture;
    try {
      picture = png_address(mesh::detail::load_file(records.path_for(item->asset, ".png"), 16 << 20).view());
    } catch (const Error&) {  // there is no picture
    }
    if (!picture.empty())
      picture = fmt::format("<img alt=\"{}\" loading=\"lazy\" src=\"{}\">",
                            escaped("Embree, the asset, and their difference: " + item->asset.name), picture);
    table.cell(picture, "");
  }
  const std::string body = fmt::format(
      "<h1>{}</h1>\n<p>{}: {} baked, {} up to date, {} failed, {} not started. Pictures: Embree, the asset, "
      "and their difference times 3, from each camera.</p>\n{}",
      escaped(manifest.file), count_of(items.size(), "asset"), count(items, Outcome::baked),
      count(items, Outcome::current), count(items, Outcome::failed), count(items, Outcome::left),
      table.html());
  return html_page(manifest.file, body);
}

}  // namespace nif::tools
