// `nif info`: prints what an asset contains, without querying it.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "bake/describe.hpp"
#include "bake/spherical/describe_spherical.hpp"
#include "formats/base/json_text.hpp"
#include "formats/base/printable.hpp"
#include "formats/base/quantities.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "tools/common/asset_bytes.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/options.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/info/info_hierarchy.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

constexpr const char* kSchema = "nifkit.info/2";

struct Arguments {
  std::string file;
  bool json = false;
};

nlohmann::ordered_json describe_object(const format::AssetView& view, uint32_t index) {
  nlohmann::ordered_json json = bake::describe(view.objects[index]);
  if (const format::PrimaryView* primary = view.primary_of(index)) json["primary"] = bake::to_json(*primary);
  const format::ObjectView& object = view.objects[index];
  json["level"] = object.level;
  json["error"] = object.error;
  if (object.unsupported) json["unsupported"] = std::string("it ") + object.unsupported;
  if (const format::NumbersView* source = view.numbers_of(index, format::kSourceTriangles))
    json["source_triangles"] = source->below;
  if (const format::NumbersView* source = view.numbers_of(index, format::kSourceVertices))
    json["source_vertices"] = source->below;
  if (const format::SkinView* skin = view.skin_of(index)) {
    json["joints"] = skin->field.joint_count;
    json["influences"] = skin->field.influences;
    json["targets"] = skin->field.target_count;
  }
  if (view.colors_of(index)) json["colors"] = true;
  return json;
}

nlohmann::ordered_json describe(const Arguments& arguments, const format::AssetView& view) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  for (uint32_t i = 0; i < view.objects.size(); ++i) objects.push_back(describe_object(view, i));
  nlohmann::ordered_json instances = nlohmann::ordered_json::array();
  for (const format::InstanceView& instance : view.instances) {
    instances.push_back(
        {{"name", instance.name}, {"object", instance.object}, {"transform", instance.transform}});
    if (instance.mask != 0xffffffff) instances.back()["mask"] = instance.mask;
    if (instance.flags & format::kDisabled) instances.back()["disabled"] = true;
    if (instance.user != 0) instances.back()["user"] = instance.user;
    if (instance.parent != format::kNoParent) instances.back()["parent"] = instance.parent;
    if (instance.remainder != std::array<float, 3>{}) {
      nlohmann::ordered_json& translation = instances.back()["translation"];
      for (size_t a = 0; a < 3; ++a)
        translation.push_back(double(instance.transform[4 * a + 3]) + double(instance.remainder[a]));
    }
  }
  // Metadata is whatever the baker wrote: shown, never trusted.
  nlohmann::ordered_json metadata = parse_untrusted<nlohmann::ordered_json>(view.metadata);
  if (metadata.is_discarded()) metadata = nullptr;
  return {{"schema", kSchema},
          {"file", arguments.file},
          {"version", format::kVersion},
          {"experimental", true},
          {"arithmetic", view.arithmetic},
          {"prover", view.prover},
          {"proves", format::proves(view.prover)},
          {"objects", std::move(objects)},
          {"instances", std::move(instances)},
          {"places_nothing", view.places_nothing},
          {"bytes", bytes_json(view)},
          {"metadata", std::move(metadata)}};
}

/// How many instances are disabled, and how many others only some rays meet.
std::pair<size_t, size_t> restricted_instances(const format::AssetView& view) {
  size_t disabled = 0, masked = 0;
  for (const format::InstanceView& instance : view.instances)
    if (instance.flags & format::kDisabled)
      ++disabled;
    else if (instance.mask != 0xffffffff)
      ++masked;
  return {disabled, masked};
}

/// `metadata[a][b]` as text, or "unknown": metadata may contain anything, or be missing.
std::string text_at(const nlohmann::ordered_json& metadata, const std::string& pointer) {
  const nlohmann::ordered_json::json_pointer at(pointer);
  if (!metadata.is_object() || !metadata.contains(at)) return "unknown";
  const auto& value = metadata.at(at);
  return printable(value.is_string() ? value.get<std::string>() : value.dump());
}

void print(const format::AssetView& view, const nlohmann::ordered_json& json) {
  fmt::print("{}: nif version {} (experimental), {}, {}\n", json["file"].get<std::string>(), format::kVersion,
             count_of(view.objects.size(), "object"),
             view.places_nothing ? "places nothing" : count_of(view.instances.size(), "instance"));
  fmt::print("revisions arithmetic {}, prover {}{}\n", view.arithmetic, view.prover,
             format::proves(view.prover) ? "" : ": nothing is proven, so no answer is certain");
  if (const auto [disabled, masked] = restricted_instances(view); disabled + masked != 0)
    fmt::print("instances {} disabled, {} with a mask\n", disabled, masked);
  fmt::print("bytes     {} as a file, {} resident\n", json["bytes"]["file"].get<uint64_t>(),
             json["bytes"]["resident"].get<uint64_t>());
  for (const auto& [name, part] : json["bytes"]["parts"].items()) {
    const uint64_t file = part["file"].get<uint64_t>(), resident = part["resident"].get<uint64_t>();
    if (file != 0 || resident != 0)
      fmt::print("          {:<16} {:>10} in the file, {:>10} resident\n", name, file, resident);
  }
  const auto& metadata = json["metadata"];
  // If nothing was trained, there is no preset.
  const std::string preset = text_at(metadata, "/options/preset");
  fmt::print("baked by  {} {}, encoding {}{}, seed {}, from {}\n", text_at(metadata, "/tool/name"),
             text_at(metadata, "/tool/version"), text_at(metadata, "/options/encoding"),
             preset == "unknown" ? "" : ", preset " + preset, text_at(metadata, "/seed"),
             text_at(metadata, "/source/hash"));
  for (const char* set : {"outer-lines", "inner-surface", "inner-volume", "segments", "sun"}) {
    const nlohmann::ordered_json::json_pointer at(std::string("/accuracy/") + set);
    if (!metadata.is_object() || !metadata.contains(at)) continue;
    const auto rate = [&](const char* key) {
      const auto& accuracy = metadata.at(at);
      return accuracy.is_object() && accuracy.contains(key) && accuracy[key].is_number()
                 ? 100 * accuracy[key].get<double>()
                 : -1.0;
    };
    fmt::print("stated    {:<14} {:.3f} % wrong ({:.3f} % leak, {:.3f} % spurious), {:.1f} % certain\n", set,
               rate("error"), rate("leak"), rate("spurious"), rate("certain"));
  }
  constexpr size_t kShown = 20;
  for (size_t i = 0; i < std::min(kShown, view.objects.size()); ++i) {
    const format::ObjectView& object = view.objects[i];
    const format::NumbersView* source = view.numbers_of(uint32_t(i), format::kSourceTriangles);
    fmt::print("object    '{}'{}: {} triangles{}, {}\n", printable(object.name),
               object.level ? fmt::format(", level {} with an error of {}", object.level, object.error) : "",
               object.triangle_count,
               source ? fmt::format(" with their numbers among {}", source->below) : "",
               bake::summary(object) + (view.colors_of(uint32_t(i)) ? ", with colours" : ""));
  }
  if (!view.primaries.empty()) fmt::print("primary   {}\n", bake::summary(view.primaries.front()));
  for (const std::string& line : bake::details(view)) fmt::print("{}\n", line);
  if (view.objects.size() > kShown)
    fmt::print("          and {} more; --json lists all\n", view.objects.size() - kShown);
  print_merged(view, metadata);
  print_hierarchy(view, metadata);
}

void run(const Arguments& arguments) {
  const format::FileMemory memory = format::FileMemory::load(arguments.file, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(memory.bytes(), arguments.file);
  const nlohmann::ordered_json json = describe(arguments, view);
  if (arguments.json) {
    write_json(json);
  } else {
    print(view, json);
  }
}

}  // namespace

void add_info(Command app) {
  const Command command = app.add_subcommand("info", "Print what an asset contains");
  auto a = std::make_shared<Arguments>();
  command.add_option("ASSET", a->file, "The .nif file to describe").required();
  add_json_option(command, a->json, kSchema);
  command.footer(
      "Examples:\n"
      "  nif info dragon.nif\n"
      "  nif info dragon.nif --json");
  command.callback([a] { run(*a); });
}

}  // namespace nif::tools
