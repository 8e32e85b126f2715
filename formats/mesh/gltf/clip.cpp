// glTF 2.0, "Animations" and appendix C, "Animation Sampler Interpolation Modes". Parsed from the JSON and not with
// tinygltf, whose reader of animations refuses a whole file for errors in them.
#include "formats/mesh/gltf/clip.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

namespace nif::mesh::detail {
namespace {

using nlohmann::json;
using Path = GltfChannel::Path;
using Interpolation = GltfChannel::Interpolation;

constexpr std::pair<const char*, Path> kPaths[] = {{"translation", Path::translation},
                                                   {"rotation", Path::rotation},
                                                   {"scale", Path::scale},
                                                   {"weights", Path::weights}};

/// Numbers of keys that are read of a file: accessors may overlap, so a small file could ask for very many.
constexpr uint64_t kMostNumbers = uint64_t{1} << 28;

std::string shown(const GltfClip& clip, size_t number) {
  return clip.name.empty() ? fmt::format("clip {}", number) : fmt::format("clip '{}'", short_name(clip.name));
}

std::optional<Path> path_of(std::string_view name) {
  for (const auto& [known, path] : kPaths)
    if (name == known) return path;
  return std::nullopt;
}

std::optional<int> accessor_of(const json& sampler, const char* name) {
  const json* number = member(sampler, name);
  if (!number || !number->is_number_unsigned() || number->get<uint64_t>() >= uint64_t{1} << 31)
    return std::nullopt;
  return number->get<int>();
}

/// Sets node and path; returns false if the channel moves no node, or in another way.
bool read_target(const json& target, GltfChannel& channel) {
  const json *node = member(target, "node"), *path = member(target, "path");
  if (node && path && node->is_number_unsigned() && path->is_string()) {
    const std::optional<Path> known = path_of(path->get_ref<const std::string&>());
    if (!known) return false;
    channel.node = node->get<size_t>();
    channel.path = *known;
    return true;
  }
  const auto pointed = pointed_node(target);
  if (!pointed || !pointed->second.starts_with('/')) return false;
  const std::optional<Path> known = path_of(pointed->second.substr(1));
  if (!known) return false;
  channel.node = pointed->first;
  channel.path = *known;
  return true;
}

/// Returns false if the sampler is malformed.
bool read_sampler(const json& animation, const json& channel, GltfChannel& to) {
  const json *samplers = member(animation, "samplers"), *number = member(channel, "sampler");
  if (!samplers || !samplers->is_array() || !number || !number->is_number_unsigned() ||
      number->get<size_t>() >= samplers->size())
    return false;
  const json& sampler = (*samplers)[number->get<size_t>()];
  const std::optional<int> times = accessor_of(sampler, "input"), values = accessor_of(sampler, "output");
  if (!times || !values) return false;
  to.times = *times;
  to.values = *values;
  const json* mode = member(sampler, "interpolation");
  if (!mode || *mode == "LINEAR") return true;
  if (*mode == "STEP")
    to.interpolation = Interpolation::step;
  else if (*mode == "CUBICSPLINE")
    to.interpolation = Interpolation::cubic_spline;
  else
    return false;
  return true;
}

using Numbers = std::vector<double>;

double dot(const Numbers& a, const Numbers& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Between two unit quaternions, the short way.
Numbers slerp(const Numbers& a, Numbers b, double part) {
  double cosine = dot(a, b);
  if (cosine < 0) {
    cosine = -cosine;
    for (double& x : b) x = -x;
  }
  const double angle = std::acos(std::min(cosine, 1.0)), sine = std::sin(angle);
  // Quaternions that are nearly alike lie on a line, and any length will do.
  const double of_a = sine > 1e-6 ? std::sin((1 - part) * angle) / sine : 1 - part,
               of_b = sine > 1e-6 ? std::sin(part * angle) / sine : part;
  Numbers mean(a.size());
  for (size_t i = 0; i < a.size(); ++i) mean[i] = of_a * a[i] + of_b * b[i];
  return mean;
}

void normalise(Numbers& quaternion) {
  const double length = std::sqrt(dot(quaternion, quaternion));
  if (length > 0)
    for (double& x : quaternion) x /= length;
}

/// The value of a channel at a time. `values`: [keys][parts][width], where a cubic spline has three parts: the tangent
/// before, the value, and the tangent after.
Numbers value_at(const GltfChannel& channel, std::span<const float> times, std::span<const float> values,
                 size_t width, double time) {
  const bool cubic = channel.interpolation == Interpolation::cubic_spline;
  const size_t parts = cubic ? 3 : 1;
  const auto part_of = [&](size_t key, size_t part) {
    const auto from = values.begin() + std::ptrdiff_t((key * parts + part) * width);
    return Numbers(from, from + std::ptrdiff_t(width));
  };
  const auto value = [&](size_t key) {
    Numbers at = part_of(key, cubic ? 1 : 0);
    if (channel.path == Path::rotation && !cubic) normalise(at);
    return at;
  };
  const auto after = size_t(std::upper_bound(times.begin(), times.end(), time) - times.begin());
  if (after == 0) return value(0);
  const size_t before = after - 1;
  if (after == times.size() || channel.interpolation == Interpolation::step) return value(before);
  const double length = double{times[after]} - double{times[before]},
               t = (time - double{times[before]}) / length;
  const Numbers p = value(before), q = value(after);
  if (channel.path == Path::rotation && !cubic) return slerp(p, q, t);
  Numbers result(width);
  if (!cubic) {
    for (size_t i = 0; i < width; ++i) result[i] = (1 - t) * p[i] + t * q[i];
    return result;
  }
  const Numbers leaving = part_of(before, 2), arriving = part_of(after, 0);
  const double t2 = t * t, t3 = t2 * t;
  for (size_t i = 0; i < width; ++i)
    result[i] = (2 * t3 - 3 * t2 + 1) * p[i] + length * (t3 - 2 * t2 + t) * leaving[i] +
                (3 * t2 - 2 * t3) * q[i] + length * (t3 - t2) * arriving[i];
  return result;
}

int components_of(Path path) {
  switch (path) {
    case Path::rotation:
      return 4;
    case Path::weights:
      return 1;
    default:
      return 3;
  }
}

}  // namespace

std::vector<GltfClip> read_clips(const json& root) {
  std::vector<GltfClip> clips;
  const json* animations = member(root, "animations");
  if (!animations || !animations->is_array()) return clips;
  for (const json& animation : *animations) {
    GltfClip& clip = clips.emplace_back();
    if (const json* name = member(animation, "name"); name && name->is_string()) clip.name = *name;
    const json* channels = member(animation, "channels");
    if (!channels || !channels->is_array()) continue;
    for (const json& described : *channels) {
      const json* target = member(described, "target");
      GltfChannel channel;
      if (!target || !read_target(*target, channel)) continue;
      if (read_sampler(animation, described, channel))
        clip.channels.push_back(channel);
      else
        clip.malformed = true;
    }
  }
  return clips;
}

std::vector<Clip> describe_clips(const Input& input, const GltfData& data, const std::vector<GltfClip>& clips,
                                 std::vector<Note>& notes) {
  ClipKeys keys(input, data);
  std::vector<Clip> all;
  for (const GltfClip& clip : clips) {
    Clip about{clip.name, 0, 0, clip.channels.size(), size_t(&clip - clips.data())};
    try {
      for (const GltfChannel& channel : clip.channels) {
        const std::vector<float>& times = *keys.times(channel.times);
        const bool first = &channel == &clip.channels.front();
        about.begin = first ? double{times.front()} : std::min(about.begin, double{times.front()});
        about.end = first ? double{times.back()} : std::max(about.end, double{times.back()});
      }
      all.push_back(about);
    } catch (const Error& error) {
      notes.push_back({NoteKind::clips, fmt::format("{} ({} cannot be read)", error.what(),
                                                    shown(clip, size_t(&clip - clips.data())))});
    }
  }
  return all;
}

ClipKeys::Numbers ClipKeys::read(int accessor, int components) {
  read_ += data_.count(accessor) * uint64_t(components);
  if (read_ > kMostNumbers)
    input_.fail(Status::too_large,
                fmt::format("has more than {} numbers in keys of animations", kMostNumbers));
  return std::make_shared<const std::vector<float>>(data_.keys(accessor, components));
}

ClipKeys::Numbers ClipKeys::times(int accessor) {
  const auto [at, added] = times_.try_emplace(accessor);
  if (at->second) return at->second;
  at->second = read(accessor, 1);
  const std::vector<float>& times = *at->second;
  const bool ascending = std::adjacent_find(times.begin(), times.end(),
                                            [](float a, float b) { return !(a < b); }) == times.end();
  if (times.empty() || !ascending || !std::isfinite(times.front()) || !std::isfinite(times.back())) {
    times_.erase(at);
    input_.fail(
        Status::malformed_mesh,
        fmt::format("accessor {} has no times of keys: there must be some, each later than the one before",
                    accessor));
  }
  return at->second;
}

ClipKeys::Numbers ClipKeys::values(int accessor, int components) {
  Numbers& values = values_[{accessor, components}];
  if (!values) values = read(accessor, components);
  return values;
}

std::vector<KeyedChannel> ClipKeys::channels(const GltfClip& clip, size_t number,
                                             const tinygltf::Model& model) {
  const auto fail = [&](const std::string& why) {
    input_.fail(Status::malformed_mesh, fmt::format("{} {}", shown(clip, number), why));
  };
  if (clip.malformed) fail("has channels that cannot be read");
  if (clip.channels.empty()) fail("moves nothing");
  std::vector<KeyedChannel> keyed;
  for (const GltfChannel& channel : clip.channels) {
    if (channel.node >= model.nodes.size())
      fail(fmt::format("moves node {}, but there are only {}", channel.node, model.nodes.size()));
    KeyedChannel& keys = keyed.emplace_back();
    keys.channel = channel;
    keys.times = times(channel.times);
    const int components = components_of(channel.path);
    keys.values = values(channel.values, components);
    const size_t parts = keys.times->size() * (channel.interpolation == Interpolation::cubic_spline ? 3 : 1);
    keys.width = channel.path == Path::weights ? keys.values->size() / parts : size_t(components);
    if (keys.width == 0 || keys.values->size() != parts * keys.width)
      fail(fmt::format("has {} keys for node {}, and {} numbers instead of {}", keys.times->size(),
                       channel.node, keys.values->size(), parts * std::max<size_t>(keys.width, 1)));
    if (channel.path != Path::weights && !model.nodes[channel.node].matrix.empty())
      fail(fmt::format("moves node {}, which has a matrix", channel.node));
  }
  return keyed;
}

size_t number_of(const Input& input, const std::vector<GltfClip>& clips, const std::string& name) {
  for (size_t i = 0; i < clips.size(); ++i)
    if (clips[i].name == name) return i;
  size_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error == std::errc() && end == name.data() + name.size() && number < clips.size()) return number;
  if (clips.empty())
    input.fail(Status::usage, fmt::format("has no clip '{}', nor any other", short_name(name)));
  constexpr size_t kNamed = 20;
  std::vector<std::string> names;
  for (size_t i = 0; i < std::min(clips.size(), kNamed); ++i)
    names.push_back(clips[i].name.empty() ? fmt::format("{}", i) : short_name(clips[i].name));
  input.fail(Status::usage, fmt::format("has no clip '{}', but: {}{}", short_name(name),
                                        fmt::join(names, ", "), clips.size() > kNamed ? ", ..." : ""));
}

std::vector<double> value_at(const Input& input, const GltfClip& clip, size_t number,
                             const KeyedChannel& keys, double time) {
  Numbers value = value_at(keys.channel, *keys.times, *keys.values, keys.width, time);
  if (!std::all_of(value.begin(), value.end(), [](double x) { return std::isfinite(x); }))
    input.fail(Status::malformed_mesh, fmt::format("{} has values for node {} that are not finite",
                                                   shown(clip, number), keys.channel.node));
  return value;
}

void pose_nodes(const Input& input, const GltfData& data, const std::vector<GltfClip>& clips,
                const Moment& moment, tinygltf::Model& model) {
  const size_t number = number_of(input, clips, moment.clip);
  const GltfClip& clip = clips[number];
  for (const KeyedChannel& keys : ClipKeys(input, data).channels(clip, number, model)) {
    tinygltf::Node& node = model.nodes[keys.channel.node];
    const Path path = keys.channel.path;
    (path == Path::translation ? node.translation
     : path == Path::rotation  ? node.rotation
     : path == Path::scale     ? node.scale
                               : node.weights) = value_at(input, clip, number, keys, moment.time);
  }
}

}  // namespace nif::mesh::detail
