// Reads and checks the content of a .nif file: what is common to all objects here, the rest with the readers
// of parts.
#include "formats/nif/reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "formats/base/utf8.hpp"

namespace nif::format {
namespace {

/// The reader of a part, and how many objects have the part so far.
template <class Part>
struct ReaderOf {
  typename Part::Reader reader;
  uint32_t objects = 0;
};
template <class... Part>
struct ReadersOf : ReaderOf<Part>... {
  ReadersOf(const SectionTable& sections, std::string_view file, AssetView& asset)
      : ReaderOf<Part>{typename Part::Reader(sections, file, asset)}... {}
};
using Readers = OfParts<ReadersOf>;

/// "planes and network".
std::string names_of_parts(const ObjectRecord& record) {
  std::string names;
  for_each_part([&]<class Part>(Part) {
    if (Part::of(record) != kNoPart) names += (names.empty() ? "" : " and ") + std::string(Part::kName);
  });
  return names.empty() ? "no part" : names;
}

class Reader {
 public:
  Reader(Bytes bytes, std::string_view file, std::pmr::memory_resource* memory)
      : file_(file), asset_(memory) {
    asset_.bytes = bytes;
    asset_.sections = open_container(bytes, file, memory);
    Header header;
    std::memcpy(&header, bytes.data(), sizeof(header));
    asset_.places_nothing = header.flags & kPlacesNothing;
  }

  AssetView read() {
    check_sections();
    read_objects();
    read_primaries();
    read_source_triangles();
    read_colors();
    read_instances();
    if (has_translations_) read_translations();
    if (names_end_ != names_.size()) refuse(Rule::bytes_of_no_name, file_, "section NAME");
    return std::move(asset_);
  }

 private:
  /// Every section must be known to this build, or optional.
  void check_sections() {
    bool found[3] = {};
    constexpr uint32_t kEverywhere[3] = {kObjects, kInstances, kNames};
    for (const SectionView& section : asset_.sections) {
      const auto place = [&] { return "section " + section_name(section.type); };
      const bool required = section.flags & kRequired;
      if (section.type == kMetadata) {
        asset_.metadata = {reinterpret_cast<const char*>(section.bytes.data()), section.bytes.size()};
        if (required || asset_.metadata.empty() || !is_utf8(asset_.metadata))
          refuse(Rule::metadata_text, file_, place());
        continue;
      }
      const auto* everywhere = std::find(std::begin(kEverywhere), std::end(kEverywhere), section.type);
      const bool primary = section.type == kPrimaries || section.type == kPrimaryValues,
                 source = section.type == kSourceRecords || section.type == kSourceNumbers,
                 color = section.type == kColorRecords || section.type == kColorValues,
                 translation = section.type == kTranslations,
                 optional = primary || source || color || translation;
      if (everywhere == std::end(kEverywhere) && !optional && !of_a_part(section.type)) {
        if (required) refuse(Rule::unknown_section, file_, place());
        continue;  // an optional section of a later version: skipped, as promised
      }
      if (required == optional)
        refuse(Rule::section_flag, file_, place(),
               required ? "is marked as required" : "is not marked as required");
      if (everywhere != std::end(kEverywhere)) found[everywhere - kEverywhere] = true;
      has_primaries_ = has_primaries_ || primary;
      has_sources_ = has_sources_ || source;
      has_colors_ = has_colors_ || color;
      has_translations_ = has_translations_ || translation;
    }
    for (size_t i = 0; i < std::size(found); ++i)
      if (!found[i]) refuse(Rule::section_missing, file_, "section " + section_name(kEverywhere[i]));
    names_ = table()[kNames];
  }

  static bool of_a_part(uint32_t type) {
    bool known = false;
    for_each_part([&](auto part) {
      for (const uint32_t own : part.kSections) known = known || own == type;
    });
    return known;
  }

  SectionTable table() const { return SectionTable(asset_.sections); }

  std::string_view read_name(const Name& name, const Place& place) {
    place.require(name.offset == names_end_, Rule::name_order);
    place.require(names_.size() - names_end_ > name.bytes, Rule::name_past_end);
    const std::string_view text(reinterpret_cast<const char*>(names_.data()) + name.offset, name.bytes);
    place.require(names_[size_t(name.offset) + name.bytes] == std::byte{0}, Rule::name_end);
    place.require(text.find('\0') == text.npos && is_utf8(text), Rule::name_text);
    names_end_ += size_t(name.bytes) + 1;
    return text;
  }

  void read_objects() {
    const Records<ObjectRecord> records(table()[kObjects], "OBJS", file_);
    if (records.count() == 0) refuse(Rule::no_object, file_, "section OBJS");
    check_parts(records);
    Readers readers(table(), file_, asset_);
    asset_.objects.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i)
      asset_.objects.push_back(read_object(records[i], readers, Place{file_, "OBJS", i}));
    for_each_part([&]<class Part>(Part) {
      const auto& [reader, objects] = static_cast<ReaderOf<Part>&>(readers);
      if (reader.count() != objects)
        refuse(Rule::records_of_no_object, file_, "section " + section_name(Part::kSections[0]));
      reader.finish();
    });
  }

  /// This build must read the combination of parts of each object, and the file must have exactly the
  /// sections of its parts.
  void check_parts(const Records<ObjectRecord>& records) {
    for (uint32_t i = 0; i < records.count(); ++i) {
      const ObjectRecord record = records[i];
      if (!kernels::encoding_with(record.planes != kNoPart, record.triangles != kNoPart,
                                  record.network != kNoPart, record.spherical != kNoPart))
        refuse(Rule::unknown_encoding, file_, Place{file_, "OBJS", i}.text(),
               names_of_parts(record) + ", which this build does not read together");
    }
    for_each_part([&]<class Part>(Part) {
      size_t count = 0;
      for (uint32_t i = 0; i < records.count(); ++i) {
        const ObjectRecord record = records[i];
        count += Part::of(record) != kNoPart;
      }
      check_presence(Part::kSections, count > 0);
      // Objects point to these views, which must not move.
      std::get<std::pmr::vector<typename Part::View>>(asset_.parts).reserve(count);
    });
  }

  /// A file has all sections of a part, or none.
  void check_presence(std::span<const uint32_t> types, bool expected) const {
    for (const uint32_t type : types) {
      const bool there = std::any_of(asset_.sections.begin(), asset_.sections.end(),
                                     [&](const SectionView& section) { return section.type == type; });
      if (there != expected)
        refuse(expected ? Rule::section_missing : Rule::section_unused, file_,
               "section " + section_name(type));
    }
  }

  ObjectView read_object(const ObjectRecord& record, Readers& readers, const Place& place) {
    ObjectView view;
    view.name = read_name(record.name, place);
    place.require(all_finite(record.aabb_min) && all_finite(record.aabb_max), Rule::bounds_not_finite);
    for (int a = 0; a < 3; ++a) place.require(record.aabb_min[a] <= record.aabb_max[a], Rule::bounds_empty);
    place.require(std::isfinite(record.bias) && record.bias >= 0, Rule::bias_range);
    place.require(all_zero(record.reserved), Rule::reserved_not_zero);
    view.bias = record.bias;
    view.triangle_count = record.triangle_count;
    std::copy_n(record.aabb_min, 3, view.aabb_min.begin());
    std::copy_n(record.aabb_max, 3, view.aabb_max.begin());
    for_each_part([&]<class Part>(Part) {
      if (Part::of(record) == kNoPart) return;
      auto& [reader, objects] = static_cast<ReaderOf<Part>&>(readers);
      place.require(Part::of(record) == objects, Rule::record_order);
      place.require(objects < reader.count(), Rule::record_missing);
      auto& views = std::get<std::pmr::vector<typename Part::View>>(asset_.parts);
      Part::of(view) = &views.emplace_back(reader.read(objects++, view));
    });
    return view;
  }

  void read_primaries() {
    std::pmr::vector<Bounds> bounds(asset_.objects.get_allocator());
    if (has_primaries_)
      for (const ObjectView& object : asset_.objects) bounds.push_back(object.bounds());
    format::read_primaries(table(), has_primaries_, file_, bounds, asset_.primaries);
  }

  void read_source_triangles() {
    std::pmr::vector<std::optional<uint32_t>> counts(asset_.objects.get_allocator());
    if (has_sources_)
      for (const ObjectView& object : asset_.objects)
        counts.push_back(object.triangles ? std::optional(object.triangles->field.triangle_count)
                                          : std::nullopt);
    format::read_source_triangles(table(), has_sources_, file_, counts, asset_.source_triangles);
  }

  void read_colors() {
    std::pmr::vector<std::optional<uint32_t>> counts(asset_.objects.get_allocator());
    if (has_colors_)
      for (const ObjectView& object : asset_.objects)
        counts.push_back(object.planes ? std::optional(object.planes->field.surface_voxels) : std::nullopt);
    format::read_colors(table(), has_colors_, file_, counts, asset_.colors);
  }

  void read_instances() {
    const Records<InstanceRecord> records(table()[kInstances], "INST", file_);
    if (asset_.places_nothing && records.count() != 0) refuse(Rule::places_after_all, file_, "section INST");
    asset_.instances.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i) {
      const InstanceRecord record = records[i];
      const Place place{file_, "INST", i};
      InstanceView view;
      view.name = read_name(record.name, place);
      place.require(record.object < asset_.objects.size(), Rule::object_range);
      place.require(record.reserved == 0, Rule::reserved_not_zero);
      place.require(all_finite(record.transform), Rule::transform_not_finite);
      view.object = record.object;
      std::copy_n(record.transform, 12, view.transform.begin());
      asset_.instances.push_back(view);
    }
  }

  /// Each is two floats: the one in the transform, and the remainder. Some remainder must not be 0.
  void read_translations() {
    const Records<Translation> records(table()[kTranslations], "TRAN", file_);
    if (records.count() != asset_.instances.size()) refuse(Rule::translation_count, file_, "section TRAN");
    bool any = false;
    for (uint32_t i = 0; i < records.count(); ++i) {
      const Place place{file_, "TRAN", i};
      InstanceView& instance = asset_.instances[i];
      for (size_t a = 0; a < 3; ++a) {
        const double exact = records[i].along[a];
        const float rounded = instance.transform[4 * a + 3];
        place.require(std::abs(exact) <= double(std::numeric_limits<float>::max()) &&
                          static_cast<float>(exact) == rounded,
                      Rule::translation_value);
        const double remainder = exact - double(rounded);
        instance.remainder[a] = static_cast<float>(remainder);
        place.require(double(instance.remainder[a]) == remainder, Rule::translation_value);
        any = any || remainder != 0;
      }
    }
    if (!any) refuse(Rule::translation_count, file_, "section TRAN");
  }

  std::string_view file_;
  AssetView asset_;
  Bytes names_;
  size_t names_end_ = 0;
  bool has_primaries_ = false, has_sources_ = false, has_colors_ = false, has_translations_ = false;
};

}  // namespace

AssetView read_asset(std::span<const std::byte> bytes, std::string_view file_name,
                     std::pmr::memory_resource* memory) {
  if (reinterpret_cast<uintptr_t>(bytes.data()) % kAddressAlignment != 0)
    throw Error(Status::usage, std::string(file_name) +
                                   ": its bytes lie at an address that is no multiple of " +
                                   std::to_string(kAddressAlignment));
  return Reader(bytes, file_name, memory).read();
}

kernels::AnyField field_of(const ObjectView& object) {
  return kernels::join_parts(grid_of(object), object.triangles ? &object.triangles->field : nullptr,
                             object.network ? &object.network->field : nullptr,
                             object.spherical ? &object.spherical->field : nullptr);
}

const kernels::PlanesField* grid_of(const ObjectView& object) {
  return object.planes ? &object.planes->field : nullptr;
}

uint64_t bytes_of(const ObjectView& object) {
  uint64_t sum = 0;
  for_each_part([&]<class Part>(Part) {
    if (Part::of(object))
      for (const PartBytes& part : Part::of(object)->parts()) sum += part.bytes + part.decoded;
  });
  return sum;
}

uint64_t AssetView::view_bytes() const {
  uint64_t total = sections.capacity() * sizeof(SectionView) + objects.capacity() * sizeof(ObjectView) +
                   instances.capacity() * sizeof(InstanceView) + primaries.capacity() * sizeof(PrimaryView) +
                   source_triangles.capacity() * sizeof(SourceTrianglesView) +
                   colors.capacity() * sizeof(ColorsView);
  total += mlps.capacity() * sizeof(MlpView) + decoded.view_bytes() +
           spherical_networks.capacity() * sizeof(SphericalNetworksView);
  for_each_part([&]<class Part>(Part) {
    using View = typename Part::View;
    total += std::get<std::pmr::vector<View>>(parts).capacity() * sizeof(View);
  });
  return total;
}

namespace {

/// The view of an object, out of views in the order of their objects.
template <class View>
const View* view_of(const std::pmr::vector<View>& views, uint32_t object) {
  const auto at = std::lower_bound(views.begin(), views.end(), object,
                                   [](const View& view, uint32_t o) { return view.object < o; });
  return at != views.end() && at->object == object ? &*at : nullptr;
}

}  // namespace

const PrimaryView* AssetView::primary_of(uint32_t object) const { return view_of(primaries, object); }

const ColorsView* AssetView::colors_of(uint32_t object) const { return view_of(colors, object); }

const SourceTrianglesView* AssetView::source_triangles_of(uint32_t object) const {
  return view_of(source_triangles, object);
}

kernels::HitDetails hit_details(const AssetView& asset, uint32_t object) {
  kernels::HitDetails details;
  if (const SourceTrianglesView* source = asset.source_triangles_of(object))
    details.source_triangles = source->field;
  if (const ColorsView* colors = asset.colors_of(object))
    details.colors = {grid_of(asset.objects[object]), colors->values};
  return details;
}

FileParts bytes_by_part(const AssetView& asset) {
  FileParts parts;
  uint64_t networks = 0, primaries = 0, sources = 0, colors = 0;
  for_each_part([&]<class Part>(Part) {
    using View = typename Part::View;
    for (const PartBytes& part : View().parts()) parts.add(part);
    for (const View& view : std::get<std::pmr::vector<View>>(asset.parts))
      for (const PartBytes& part : view.parts()) parts.add(part);
  });
  for (const MlpView& mlp : asset.mlps) networks += mlp.bytes;
  for (const SphericalNetworksView& pair : asset.spherical_networks) networks += pair.bytes;
  for (const PrimaryView& primary : asset.primaries) primaries += primary.grid_bytes + primary.network_bytes;
  parts.add({"network", networks});
  parts.add({"primary", primaries});
  for (const SourceTrianglesView& source : asset.source_triangles) sources += source.bytes;
  parts.add({"source_triangles", sources});
  for (const ColorsView& one : asset.colors) colors += one.bytes();
  parts.add({"colors", colors});
  return parts;
}

uint32_t AssetView::network_of(const ObjectView& object) const {
  if (object.network) return object.network->mlp;
  return object.spherical ? uint32_t(mlps.size()) + object.spherical->network : 0;
}

void AssetView::drop_bytes() {
  std::apply(
      [](auto&... views) {
        (std::for_each(views.begin(), views.end(), [](auto& view) { view.drop_bytes(); }), ...);
      },
      parts);
  for (MlpView& mlp : mlps) mlp = {};
  for (SphericalNetworksView& networks : spherical_networks) networks = {};
  decoded.drop();
  sections = std::pmr::vector<SectionView>(sections.get_allocator());
  source_triangles.clear();
  colors.clear();
  bytes = {};
}

}  // namespace nif::format
