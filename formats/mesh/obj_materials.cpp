// The libraries are read first, because a file may name them after the faces that need texture coordinates.
#include "formats/mesh/obj_materials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/mesh/readers.hpp"
#include "formats/mesh/text_cursor.hpp"

namespace nif::mesh::detail {
namespace {

/// Files that are tried.
constexpr size_t kMostLibraries = 100;

/// What remains of a line after its first word.
std::string_view after_word(std::string_view line, std::string_view word) {
  line.remove_prefix(size_t(word.data() - line.data()) + word.size());
  const size_t begin = line.find_first_not_of(" \t");
  return begin == line.npos ? std::string_view() : line.substr(begin);
}

/// How many words follow an option of a map; none for what is not an option.
std::optional<size_t> values_of(std::string_view option) {
  constexpr std::pair<std::string_view, size_t> kOptions[] = {
      {"-blendu", 1},  {"-blendv", 1}, {"-boost", 1},  {"-bm", 1}, {"-cc", 1}, {"-clamp", 1},
      {"-imfchan", 1}, {"-mm", 2},     {"-texres", 1}, {"-o", 3},  {"-s", 3},  {"-t", 3}};
  const auto found = std::ranges::find(kOptions, option, &std::pair<std::string_view, size_t>::first);
  return found == std::end(kOptions) ? std::nullopt : std::optional(found->second);
}

}  // namespace

ObjMaterials::ObjMaterials(const Input& input)
    : input_(input), bytes_(input.limits.max_decompressed_bytes), holes_(input.limits.alpha.resolution) {
  if (!input.limits.alpha.read) return;
  constexpr std::string_view kKeyword = "mtllib";
  for (size_t at = input.bytes.find(kKeyword); at != input.bytes.npos;
       at = input.bytes.find(kKeyword, at + kKeyword.size())) {
    const size_t before = input.bytes.substr(0, at).find_last_not_of(" \t");
    const bool begins =
        before == input.bytes.npos || input.bytes[before] == '\n' || input.bytes[before] == '\r';
    const size_t after = at + kKeyword.size();
    if (!begins || after == input.bytes.size() || (input.bytes[after] != ' ' && input.bytes[after] != '\t'))
      continue;
    TextCursor text(input.bytes.substr(after));
    read_libraries(text.rest_of_line());
  }
}

/// The bytes of a file beside the OBJ; nothing if it cannot be read, or if all files together are too large. Programs
/// on Windows write backslashes.
std::optional<ByteBuffer> ObjMaterials::load(std::string_view name) {
  if (clean_name(name) != name) return std::nullopt;  // JSON could not hold it
  std::string path(name);
  std::ranges::replace(path, '\\', '/');
  path = (input_.file.parent_path() / path).string();
  try {
    ByteBuffer bytes = load_named_file(path, bytes_);
    bytes_ -= bytes.size();
    files_.insert(path);
    return bytes;
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// A line names one file with spaces, or several without.
void ObjMaterials::read_libraries(std::string_view line) {
  if (line.empty() || (libraries_.size() < kMostLibraries && read_library(line))) return;
  TextCursor words(line);
  bool any = false;
  for (std::string_view name = words.word();
       !name.empty() && name != line && libraries_.size() < kMostLibraries; name = words.word())
    any = read_library(name) || any;
  if (!any || libraries_.size() >= kMostLibraries) missing_.insert(std::string(line.substr(0, 128)));
}

bool ObjMaterials::read_library(std::string_view name) {
  const auto [known, fresh] = libraries_.try_emplace(std::string(name), false);
  if (!fresh) return known->second;  // many programs repeat it for each object
  const std::optional<ByteBuffer> bytes = load(name);
  known->second = bytes.has_value();
  if (!bytes) return false;
  std::optional<Material> current;
  std::string_view lines = bytes->view();
  if (constexpr std::string_view kMark = "\xEF\xBB\xBF"; lines.starts_with(kMark))
    lines.remove_prefix(kMark.size());
  for (TextCursor text(lines); !text.at_end();) read_material_line(text.rest_of_line(), current);
  keep(current);
  return true;
}

void ObjMaterials::read_material_line(std::string_view line, std::optional<Material>& current) {
  TextCursor words(line);
  const std::string_view keyword = words.word();
  if (keyword == "newmtl") {
    keep(current);
    current.emplace().name = after_word(line, keyword);
  } else if (current && (keyword == "d" || keyword == "Tr")) {
    double value;
    std::string_view word = words.word();
    if (word == "-halo") word = words.word();
    // Some programs write both for what is opaque, with the same number.
    const bool better = keyword == "d" || !current->has_opacity;
    if (!parse_double(word, value) || !std::isfinite(value) || !better) return;
    current->opacity = std::clamp(keyword == "d" ? value : 1 - value, 0.0, 1.0);
    current->has_opacity = keyword == "d";
  } else if (current && same_word(keyword, "map_d")) {
    read_map(after_word(line, keyword), *current);
  }
}

/// "-clamp on -s 2 2 1 leaf mask.png". Options that matter only to colours and to filters are skipped.
void ObjMaterials::read_map(std::string_view line, Material& material) {
  TextCursor words(line);
  std::string_view rest = line;
  for (std::string_view word = words.word(); !word.empty();) {
    const std::optional<size_t> most = values_of(word);
    if (!most) {
      material.picture = rest.substr(size_t(word.data() - rest.data()));
      return;
    }
    const std::string_view option = word;
    std::array<double, 3> values{};
    size_t count = 0;
    bool channel = true;
    for (word = words.word(); count < *most && !word.empty(); ++count, word = words.word()) {
      double value;
      const bool number = parse_double(word, value) && std::isfinite(value);
      if (option == "-clamp") material.clamps = same_word(word, "on");
      if (option == "-imfchan") channel = word == "m" || word == "l";
      if (number) values[count] = value;
      // Of three numbers, the last ones may be missing.
      if (*most == 3 && !number) break;
    }
    if (option == "-o" && count > 0) material.offset = {values[0], count > 1 ? values[1] : 0};
    if (option == "-t" || !channel || (option == "-mm" && (values[0] != 0 || values[1] != 1)))
      material.unknown = option;
    if (option == "-s" && count > 0) material.scale = {values[0], count > 1 ? values[1] : 1};
  }
}

void ObjMaterials::keep(std::optional<Material>& material) {
  if (!material) return;
  const bool solid = material->opacity >= 1 && material->picture.empty();
  const auto [number, fresh] =
      numbers_.try_emplace(material->name, solid ? std::nullopt : std::optional(materials_.size()));
  if (fresh && !solid) materials_.push_back(*std::move(material));
  material.reset();
}

void ObjMaterials::use(std::string_view material) {
  const auto found = numbers_.find(material);
  current_ = found == numbers_.end() ? std::nullopt : found->second;
}

void ObjMaterials::add_coordinates(const std::array<float, 2>& place) { places_.push_back(place); }

void ObjMaterials::add_face(std::span<const ObjCorner> corners, uint64_t first, uint64_t end) {
  if (!current_ || first == end) return;
  faces_.push_back({first, end, corners_.size(), corners_.size() + corners.size(), *current_});
  corners_.insert(corners_.end(), corners.begin(), corners.end());
  std::stable_sort(corners_.end() - std::ptrdiff_t(corners.size()), corners_.end(),
                   [](const ObjCorner& a, const ObjCorner& b) { return a.vertex < b.vertex; });
}

/// A picture is read when the first of its faces is decided.
AlphaTest ObjMaterials::test_of(size_t number) {
  const Material& material = materials_[number];
  const Wrap wrap = material.clamps ? Wrap::clamp : Wrap::repeat;
  AlphaTest test{material.opacity, input_.limits.alpha.cutoff, nullptr, {wrap, wrap}};
  if (material.picture.empty() || input_.limits.alpha.blend != AlphaOptions::Blend::cutoff) return test;
  if (!material.unknown.empty()) {
    report_.cannot_read(number, fmt::format("has the option {}, which is not known", material.unknown));
    return test;
  }
  const auto [known, fresh] = pictures_.try_emplace(material.picture);
  ReadPicture& read = known->second;
  if (fresh) {
    if (const std::optional<ByteBuffer> bytes = load(material.picture))
      read.keep(decode_mask(bytes->view(), texels_, read.why));
    else
      read.why = fmt::format("is at '{}', which is missing or cannot be read", clean_name(material.picture));
  }
  if (!read.why.empty()) report_.cannot_read(number, read.why);
  test.picture = read.get();
  return test;
}

ObjMaterials::Placed ObjMaterials::place(const Face& face, const Triangle& triangle,
                                         const AlphaPicture& picture) const {
  const Material& material = materials_[face.material];
  const std::span<const ObjCorner> corners =
      std::span(corners_).subspan(face.first_corner, face.end_corner - face.first_corner);
  Placed placed;
  for (size_t k = 0; k < 3; ++k) {
    const auto corner = std::ranges::lower_bound(corners, triangle[k], {}, &ObjCorner::vertex);
    if (corner == corners.end() || corner->coordinates >= places_.size()) {
      placed.everywhere = false;
      break;
    }
    // A polygon may use a vertex twice, with different places.
    placed.ambiguous |= corner + 1 != corners.end() && corner[1].vertex == corner->vertex &&
                        std::ranges::any_of(corner + 1, corners.end(), [&](const ObjCorner& other) {
                          return other.vertex == corner->vertex && other.coordinates != corner->coordinates;
                        });
    const std::array<float, 2>& place = places_[corner->coordinates];
    // From the lower left corner of the picture.
    const double u = place[0] * material.scale[0] + material.offset[0],
                 v = 1 - (place[1] * material.scale[1] + material.offset[1]);
    placed.corners.places[k] = {std::isfinite(u) ? u * picture.width() : 0,
                                std::isfinite(v) ? v * picture.height() : 0};
  }
  return placed;
}

TriangleAlpha ObjMaterials::decide_one(const Face& face, const AlphaTest& test, const Triangle& triangle,
                                       size_t number, HoleCollector& holes) {
  const AlphaOptions::Blend blend = input_.limits.alpha.blend;
  AlphaTest own = test;
  Placed placed;
  if (own.picture) placed = place(face, triangle, *own.picture);
  if (!placed.everywhere) {
    report_.cannot_place(face.material);
    own.picture = nullptr;
  }
  if (own.picture && placed.ambiguous) {
    report_.count_filled(face.material, Filled::ambiguous);
    return TriangleAlpha::cut;
  }
  const TriangleAlpha shown = blend == AlphaOptions::Blend::opaque   ? TriangleAlpha::solid
                              : blend == AlphaOptions::Blend::ignore ? TriangleAlpha::clear
                                                                     : own.show(placed.corners, steps_);
  if (shown == TriangleAlpha::cut)
    report_.keep(face.material, own.holes(placed.corners, holes_), number, holes);
  else
    report_.count(face.material, shown);
  return shown;
}

std::vector<TriangleAlpha> ObjMaterials::decide(std::span<const Triangle> triangles, HoleCollector& holes) {
  std::vector<TriangleAlpha> alpha;
  std::vector<std::optional<AlphaTest>> tests(materials_.size());
  const AlphaOptions& options = input_.limits.alpha;
  for (const Face& face : faces_) {
    std::optional<AlphaTest>& test = tests[face.material];
    if (!test) {
      test = test_of(face.material);
      MaterialAlpha& described = report_.of(face.material);
      described.name = materials_[face.material].name;
      described.rule = MaterialAlpha::Rule::blend;
      if (options.blend == AlphaOptions::Blend::cutoff) described.cutoff = options.cutoff;
    }
    for (uint64_t t = face.first_triangle; t < face.end_triangle; ++t) {
      const TriangleAlpha shown = decide_one(face, *test, triangles[t], t, holes);
      if (shown == TriangleAlpha::solid) continue;
      alpha.resize(triangles.size(), TriangleAlpha::solid);
      alpha[t] = shown;
    }
  }
  return alpha;
}

void ObjMaterials::report(Scene& scene) const {
  scene.files.insert(scene.files.end(), files_.begin(), files_.end());  // in the order of their names
  report_.write(input_, scene);
  if (!missing_.empty())
    scene.notes.push_back(
        {NoteKind::materials,
         fmt::format("{}: cannot read the materials in '{}'{}: they count as opaque.", input_.file.string(),
                     clean_name(*missing_.begin()),
                     missing_.size() > 1 ? fmt::format(" and {} more", missing_.size() - 1) : "")});
}

}  // namespace nif::mesh::detail
