// `nif info`: what an asset holds, without querying it.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "bake/encoding.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "tools/common/command.hpp"
#include "tools/common/measuring.hpp"
#include "tools/info/hierarchy.hpp"
#include "tools/info/spherical.hpp"

namespace nif::tools {
namespace {

struct Arguments {
  std::string file;
  bool json = false;
};

nlohmann::ordered_json describe_encoding(const format::ObjectView& object) {
  nlohmann::ordered_json json{{"name", object.name},
                              {"encoding", bake::name_of(object.encoding)},
                              {"triangles", object.triangles},
                              {"bounds", {object.aabb_min, object.aabb_max}},
                              {"bias", object.bias}};
  if (object.encoding == format::kBvh) {
    json["nodes"] = object.bvh.node_count;
    json["vertices"] = object.bvh.vertex_count;
    json["bytes"] = {{"bvh", object.bvh_bytes}};
    return json;
  }
  if (object.encoding == format::kSpherical) {
    json["network"] = object.network;
    json.update(describe_spherical(object));
    return json;
  }
  std::vector<uint32_t> widths;
  const kernels::Network& network = object.field.network;
  for (uint32_t l = 0; l < network.layer_count; ++l) widths.push_back(network.layers[l].outputs);
  json["voxels"] = object.field.voxels;
  json["corners"] = object.field.corners;
  json["features_per_corner"] = object.field.features_per_corner;
  json["samples"] = object.field.samples;
  json["network"] = object.network;
  json["layers"] = widths;
  json["bytes"] = {{"occupancy", object.occupancy_bytes}, {"features", object.feature_bytes}};
  return json;
}

nlohmann::ordered_json describe_object(const format::AssetView& view, uint32_t index) {
  nlohmann::ordered_json json = describe_encoding(view.objects[index]);
  if (const format::PrimaryView* primary = view.primary_of(index))
    json["primary"] = describe_primary(*primary);
  return json;
}

nlohmann::ordered_json describe(const Arguments& arguments, const format::AssetView& view) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::array();
  uint64_t occupancy = 0, features = 0, networks = 0, bvhs = 0, grids = 0, primaries = 0;
  for (uint32_t i = 0; i < view.objects.size(); ++i) {
    const format::ObjectView& object = view.objects[i];
    objects.push_back(describe_object(view, i));
    occupancy += object.occupancy_bytes;
    features += object.feature_bytes;
    bvhs += object.bvh_bytes;
    grids += object.grid_bytes;
  }
  for (const format::NetworkView& network : view.networks) networks += network.bytes;
  for (const format::SphericalNetworksView& pair : view.spherical_networks) networks += pair.bytes;
  for (const format::PrimaryView& primary : view.primaries)
    primaries += primary.grid_bytes + primary.network_bytes;
  nlohmann::ordered_json instances = nlohmann::ordered_json::array();
  for (const format::InstanceView& instance : view.instances) {
    instances.push_back(
        {{"name", instance.name}, {"object", instance.object}, {"transform", instance.transform}});
  }
  // Metadata is what its baker wrote: shown, never trusted.
  nlohmann::ordered_json metadata = nlohmann::ordered_json::parse(view.metadata, nullptr, false);
  if (metadata.is_discarded()) metadata = nullptr;
  return {{"schema", "nifkit.info/1"},
          {"file", arguments.file},
          {"version", format::kVersion},
          {"objects", std::move(objects)},
          {"instances", std::move(instances)},
          {"bytes",
           {{"file", view.bytes.size()},
            {"resident", resident_bytes(view.bytes)},
            {"occupancy", occupancy},
            {"features", features},
            {"network", networks},
            {"bvh", bvhs},
            {"grids", grids},
            {"primary", primaries}}},
          {"metadata", std::move(metadata)}};
}

/// `metadata[a][b]` as text, or "unknown": metadata may hold anything, or be missing.
std::string text_at(const nlohmann::ordered_json& metadata, const std::string& pointer) {
  const nlohmann::ordered_json::json_pointer at(pointer);
  if (!metadata.is_object() || !metadata.contains(at)) return "unknown";
  const auto& value = metadata.at(at);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

void print(const format::AssetView& view, const nlohmann::ordered_json& json) {
  const auto& bytes = json["bytes"];
  fmt::print("{}: nif version {}, {}, {}\n", json["file"].get<std::string>(), format::kVersion,
             count_of(view.objects.size(), "object"), count_of(view.instances.size(), "instance"));
  fmt::print(
      "bytes     {} as a file, {} resident (occupancy {}, features {}, networks {}, BVHs {}, grids {})\n",
      bytes["file"].get<uint64_t>(), bytes["resident"].get<uint64_t>(), bytes["occupancy"].get<uint64_t>(),
      bytes["features"].get<uint64_t>(), bytes["network"].get<uint64_t>(), bytes["bvh"].get<uint64_t>(),
      bytes["grids"].get<uint64_t>());
  const auto& metadata = json["metadata"];
  // Without fields there is no preset.
  const std::string encoding = text_at(metadata, "/options/encoding"),
                    preset = encoding == "bvh" ? "" : ", preset " + text_at(metadata, "/options/preset");
  fmt::print("baked by  {} {}, encoding {}{}, seed {}, from {}\n", text_at(metadata, "/tool/name"),
             text_at(metadata, "/tool/version"), encoding, preset, text_at(metadata, "/seed"),
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
    const std::string form =
        object.encoding == format::kBvh ? fmt::format("bvh, {} nodes", object.bvh.node_count)
        : object.encoding == format::kSpherical
            ? fmt::format("spherical, networks {}", object.network)
            : fmt::format("segment, {} x {} x {} voxels, {} corners", object.field.voxels[0],
                          object.field.voxels[1], object.field.voxels[2], object.field.corners);
    fmt::print("object    '{}': {} triangles, {}\n", object.name, object.triangles, form);
  }
  print_spherical(view);
  if (view.objects.size() > kShown)
    fmt::print("          and {} more; --json lists all\n", view.objects.size() - kShown);
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
  const Command command = app.add_subcommand("info", "Say what an asset holds");
  auto a = std::make_shared<Arguments>();
  command.add_option("ASSET", a->file, "A .nif file").required();
  command.add_flag("--json", a->json, "Print it as one JSON object (nifkit.info/1)");
  command.footer("Example: nif info dragon.nif");
  command.callback([a] { run(*a); });
}

}  // namespace nif::tools
