// Renders the mesh from four sides with Embree and with the asset, and takes the tables from the JSON report.
// A full LossCurve drops every second point, so its memory stays bounded.
#include "tools/bake/bake_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/base/quantities.hpp"
#include "tools/bake/surface_errors.hpp"
#include "tools/common/interruption.hpp"
#include "tools/common/page.hpp"
#include "tools/render/compare_pictures.hpp"
#include "tools/render/lighting.hpp"
#include "tools/render/renderer.hpp"
#include "tools/render/scene_meshes.hpp"
#include "tools/render/world.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;
using render::Image;

std::string percent(double share) { return fmt::format("{:.3f} %", 100 * share); }

/// The mesh with its asset on the ground, under a sun and a dim sky, from four sides.
render::SceneDescription scene_of(const std::string& mesh, const std::string& asset) {
  render::SceneDescription scene;
  scene.file = asset;
  scene.picture.width = 320, scene.picture.height = 240;
  render::ObjectDescription object{mesh, asset};
  object.lights = object.cameras = false;
  scene.objects.push_back(std::move(object));
  scene.ground.emplace();
  const Double3 towards{0.5, 0.8, 0.4};
  scene.lights.push_back(render::Sun{towards * (1 / length(towards)), {2, 2, 2}});
  render::Sky sky;
  sky.radiance = {0.3, 0.3, 0.3};
  scene.lights.push_back(sky);
  for (const double azimuth : {30, 120, 210, 300})
    scene.cameras.push_back({fmt::format("{:.0f}", azimuth), render::Orbit{azimuth, 20, 0.85}});
  return scene;
}

std::string picture(const Image& image, const std::string& what) {
  const std::vector<std::byte> png = render::encode_png(image);
  return fmt::format("<img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"{}\">", escaped(what), image.width,
                     image.height, png_address({reinterpret_cast<const char*>(png.data()), png.size()}));
}

std::string sets_section(const Json& report) {
  PageTable table({{"ray set"},
                   {"rays", PageTable::Kind::number},
                   {"wrong", PageTable::Kind::number},
                   {"leak", PageTable::Kind::number},
                   {"spurious", PageTable::Kind::number},
                   {"certain", PageTable::Kind::number},
                   {"certain and wrong", PageTable::Kind::number}});
  for (const auto& item : report.at("sets").items()) {
    const auto& set = item.value();
    table.row();
    table.cell(escaped(item.key()), item.key());
    const auto count = [&](const char* key) {
      const std::string text = fmt::format("{}", set.at(key).template get<uint64_t>());
      table.cell(text, text);
    };
    count("rays");
    for (const char* key : {"error", "leak", "spurious", "certain"})
      table.cell(percent(set.at(key)), fmt::format("{}", set.at(key).template get<double>()));
    count("certain_wrong");
  }
  return html_section("Errors by ray set",
                      "Measured against Embree on rays that training has not seen. Leak: blocked, called "
                      "visible. Spurious: "
                      "visible, called blocked. Certain: proven, so never wrong.",
                      report.at("sets").empty() ? "<p>Nothing was measured (--rays 0).</p>" : table.html());
}

template <size_t N, class Name>
std::string asked_bars(const std::array<AskedRays, N>& asked, const Name& name) {
  double most = 1e-9;
  const auto wrong = [](const AskedRays& a) {
    return a.rays ? double(a.leak + a.spurious) / double(a.rays) : 0.0;
  };
  for (const AskedRays& a : asked) most = std::max(most, wrong(a));
  PageBars bars;
  for (size_t i = 0; i < N; ++i)
    bars.add(name(i), wrong(asked[i]) / most,
             fmt::format("{} of {} rays", percent(wrong(asked[i])), asked[i].rays));
  return bars.html();
}

std::string bytes_section(const Json& report) {
  const Json& bytes = report.at("bytes");
  std::vector<std::pair<std::string, double>> parts;
  for (const auto& [name, part] : bytes.at("parts").items())
    if (part.at("file") > 0) parts.emplace_back(name, part.at("file").template get<double>());
  std::ranges::stable_sort(parts, std::greater(), &std::pair<std::string, double>::second);
  PageBars bars;
  for (auto& [name, count] : parts) {
    std::ranges::replace(name, '_', ' ');
    bars.add(name, count / parts.front().second, format_bytes(count));
  }
  return html_section("Bytes by part",
                      fmt::format("Of the file, {}. In memory the asset takes {}.",
                                  format_bytes(bytes.at("file")), format_bytes(bytes.at("resident"))),
                      bars.html());
}

std::string loss_section(std::span<const LossPoint> losses) {
  std::string html;
  for (size_t begin = 0, end; begin < losses.size(); begin = end) {
    for (end = begin; end < losses.size() && losses[end].object == losses[begin].object; ++end) {
    }
    const std::span<const LossPoint> own = losses.subspan(begin, end - begin);
    if (own.size() < 2) continue;
    constexpr double kWidth = 640, kHeight = 180;
    const double low = std::log(std::max(1e-9, std::ranges::min(own, {}, &LossPoint::loss).loss)),
                 high = std::log(std::max(1e-9, std::ranges::max(own, {}, &LossPoint::loss).loss));
    std::string points;
    for (size_t i = 0; i < own.size(); ++i)
      points +=
          fmt::format("{:.1f},{:.1f} ", kWidth * double(i) / double(own.size() - 1),
                      kHeight * (high - std::log(std::max(1e-9, own[i].loss))) / std::max(1e-9, high - low));
    html += fmt::format(
        "<figure><svg viewBox=\"-4 -4 {} {}\" role=\"img\" aria-label=\"Loss of {} while it was "
        "trained\"><polyline "
        "points=\"{}\"/></svg><figcaption>{}: loss from {:.4f} to {:.4f}, on a logarithmic axis; at the end "
        "{} of the rays "
        "that it was trained with were wrong</figcaption></figure>\n",
        kWidth + 8, kHeight + 8, escaped(own.front().object), points, escaped(own.front().object),
        own.front().loss, own.back().loss, percent(own.back().error));
  }
  return html.empty() ? "" : html_section("Training", "The mean loss of recent rays.", html);
}

/// "encoding: segment", with names within names joined by dots.
void list_settings(const Json& json, const std::string& prefix, std::string& html) {
  for (const auto& [name, value] : json.items()) {
    if (value.is_object()) {
      list_settings(value, prefix + name + ".", html);
    } else {
      html += fmt::format("<dt>{}</dt><dd>{}</dd>", escaped(prefix + name),
                          escaped(value.is_string() ? value.template get<std::string>() : value.dump()));
    }
  }
}

std::string settings_section(const Json& report, std::string_view text) {
  const Json metadata = Json::parse(text, nullptr, false);
  std::string html = "<dl>";
  if (metadata.is_object()) {
    if (metadata.contains("options")) list_settings(metadata["options"], "", html);
    if (metadata.contains("seed"))
      html += fmt::format("<dt>seed</dt><dd>{}</dd>", escaped(metadata["seed"].dump()));
    if (metadata.contains("tool"))
      html += fmt::format("<dt>nifkit</dt><dd>{}</dd>", escaped(metadata["tool"].value("version", "")));
  }
  html += "</dl>\n";
  constexpr size_t kShown = 50;
  const Json& objects = report.at("objects");
  for (size_t i = 0; i < std::min(kShown, objects.size()); ++i)
    html += fmt::format("<p>'{}', {}: {} ({})</p>\n", escaped(objects[i].at("name").get<std::string>()),
                        count_of(objects[i].at("triangles").get<uint64_t>(), "triangle"),
                        escaped(objects[i].at("encoding").get<std::string>()),
                        escaped(objects[i].at("reason").get<std::string>()));
  if (objects.size() > kShown) html += fmt::format("<p>and {} more</p>\n", objects.size() - kShown);
  for (const auto& note : report.at("notes"))
    html += fmt::format("<p>Note: {}</p>\n", escaped(note.get<std::string>()));
  return html_section("Settings and objects", "As the asset's metadata states them.", html);
}

}  // namespace

void LossCurve::add(const std::string& object, double loss, double error) {
  if (seen_++ % step_ != 0) return;
  points_.push_back({object, loss, error});
  if (points_.size() < kMostPoints) return;
  for (size_t i = 1; i < points_.size() / 2; ++i) points_[i] = std::move(points_[2 * i]);
  points_.resize(points_.size() / 2);
  step_ *= 2;
}

std::string bake_page(const nlohmann::ordered_json& report, std::string_view metadata,
                      const std::string& mesh, std::span<const LossPoint> losses, Progress& progress) {
  const std::atomic<bool>& cancel = interruption();
  const auto asset = report.at("file").get<std::string>();
  render::SceneDescription scene = scene_of(mesh, asset);
  std::vector<std::string> ignored;
  render::ObjectMeshes meshes = render::read_meshes(scene, {}, ignored, progress);
  const bool leaves_open = std::ranges::any_of(
      report.at("objects"), [](const Json& object) { return object.at("encoding") == "proof"; });
  SurfaceErrors errors;
  {
    // without the ground, which would block rays in place of the asset
    render::SceneDescription alone = scene;
    alone.ground.reset();
    const render::World world(alone, meshes, "", progress);
    progress.begin();
    constexpr uint32_t kRaysAPixel = 16;
    errors = measure_surface(alone, world, kRaysAPixel, leaves_open, cancel, [&](double share) {
      progress.update(share, "report: tracing rays from the surface");
    });
  }
  const render::Lighting lighting(scene);
  const render::World world(scene, std::move(meshes), "", progress);
  progress.begin();
  const double exposure = render::find_exposure(scene, world, lighting);
  const size_t cameras = scene.cameras.size();

  std::string pictures;
  for (size_t i = 0; i < cameras; ++i) {
    const render::Camera camera = render::place_camera(scene.cameras[i], world.box(), scene.up,
                                                       scene.picture.width, scene.picture.height);
    const render::Rendering rendering = render::render(
        world, lighting, camera, {scene.picture, exposure},
        [&](double share, const auto&) {
          progress.update((double(i) + share) / double(cameras), "report: rendering");
        },
        cancel);
    const Image reference = render::srgb_encoded(rendering.images[size_t(render::Mode::reference)]),
                answered = render::srgb_encoded(rendering.images[size_t(render::Mode::bits)]),
                difference = render::difference(reference, answered, 3);
    pictures += fmt::format(
        "<figure><div class=\"row\">{}{}{}{}</div><figcaption>From {} degrees: Embree, the asset ({:.1f} dB "
        "PSNR), their "
        "difference times 3, and where answers are wrong</figcaption></figure>\n",
        picture(reference, "By Embree"), picture(answered, "By the asset"),
        picture(difference, "Their difference"), picture(errors.maps[i], "Map of wrong answers"),
        scene.cameras[i].name, render::psnr(reference, answered));
  }
  progress.finish();

  AskedRays surface;
  for (const AskedRays& asked : errors.by_angle) surface += asked;
  std::string body = fmt::format(
      "<h1>{}</h1>\n<p>{} in {}; {} as a file, {} in memory; baked in {:.1f} s. Of {} rays from what the "
      "cameras see of the surface{}, {} are answered wrongly.</p>\n",
      escaped(asset), count_of(report.at("triangles").get<uint64_t>(), "triangle"),
      count_of(report.at("objects").size(), "object"), format_bytes(report.at("bytes").at("file")),
      format_bytes(report.at("bytes").at("resident")), report.at("seconds").get<double>(), surface.rays,
      leaves_open ? " that the asset does not leave to the caller" : "",
      percent(surface.rays ? double(surface.leak + surface.spurious) / double(surface.rays) : 0));
  body += html_section(
      "Pictures",
      "Shadows of a sun and a dim sky, 16 rays per pixel. The map is grey where all 16 rays from a pixel "
      "into the half space above it are answered correctly, yellow where one is not, red where many are not.",
      pictures);
  body += sets_section(report);
  body += html_section("Errors by angle", "Rays from the surface, by their angle to its normal.",
                       asked_bars(errors.by_angle, [](size_t i) {
                         return fmt::format("{} to {} degrees", 10 * i, 10 * i + 10);
                       }));
  body += html_section(
      "Errors by distance",
      "Rays that start above the surface, by how far: in per cent of the diagonal of the object's box.",
      asked_bars(errors.by_height,
                 [](size_t i) { return fmt::format("{:g} %", 100 * SurfaceErrors::kHeights[i]); }));
  body += bytes_section(report) + loss_section(losses) + settings_section(report, metadata);
  return html_page(asset, body);
}

}  // namespace nif::tools
