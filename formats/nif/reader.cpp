// Reads and checks the content of a .nif file: what is common to all objects here, the rest with the readers
// of parts.
#include "formats/nif/reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "formats/base/rounding.hpp"
#include "formats/base/utf8.hpp"

namespace nif::format {
namespace {

/// The records of a part, and how many objects have the part so far.
template <class Part>
struct RecordsOf {
  Records<typename Part::Record> records;
  uint32_t objects = 0;
};
template <class... Part>
struct AllRecords : RecordsOf<Part>... {
  AllRecords(const SectionTable& sections, std::string_view file)
      : RecordsOf<Part>{Records<typename Part::Record>(sections[Part::kRecords], file)}... {}
};

template <class Part>
concept SharesSomething = requires {
  typename Part::Shared;
};

/// A section of records, then perhaps one of their payloads.
template <class Kind>
constexpr KnownSection records_section(uint32_t flags) {
  return {Kind::kRecords, flags, sizeof(typename Kind::Record)};
}
constexpr auto kKnownSections = [] {
  struct {
    KnownSection sections[32]{{kMetadata, 0, 0},
                              {kObjects, kRequired, sizeof(ObjectRecord)},
                              {kInstances, kRequired, sizeof(InstanceRecord)},
                              {kNames, kRequired, 0},
                              {kData, kRequired | kPayloads, 0}};
    size_t count = 5;
  } known;
  for_each_part([&]<class Part>(Part) {
    known.sections[known.count++] = records_section<Part>(kRecordsFlags<Part>);
    if constexpr (SharesSomething<Part>)
      known.sections[known.count++] = records_section<typename Part::Shared>(kRecordsFlags<Part>);
  });
  for_each_optional([&]<class Kind>(Kind) {
    known.sections[known.count++] = records_section<Kind>(0);
    known.sections[known.count++] = {Kind::kValues, kPayloads, 0};
  });
  return known;
}();

/// Why this build cannot answer an object; null if it can.
const char* why_unsupported(const ObjectRecord& record) {
  const uint32_t known = with_all_parts([](auto... part) { return (flag_of(part) | ...); });
  const uint32_t unknown = unknown_flags(record.flags, known);
  if (unknown & kDeforms) return "deforms, which this build does not know";
  if (unknown != 0) return "has flags that this build does not know";
  return encoding_with_parts_of(record, [](uint32_t part) { return part != kNoPart; })
             ? nullptr
             : "has parts that this build does not read together";
}

class Reader {
 public:
  Reader(Bytes bytes, std::string_view file, std::pmr::memory_resource* memory)
      : file_(file), asset_(memory), data_({}) {
    asset_.bytes = bytes;
    asset_.sections = open_container(bytes, file, memory);
    Header header;
    std::memcpy(&header, bytes.data(), sizeof(header));
    asset_.places_nothing = header.flags & kPlacesNothing;
    asset_.arithmetic = header.arithmetic;
    asset_.prover = header.prover;
  }

  AssetView read() {
    check_sections();
    read_objects();
    for_each_optional([&](auto kind) { read_optional(kind); });
    read_instances();
    if (names_end_ != names_.size()) refuse(Rule::bytes_of_no_name, file_, "section NAME");
    return std::move(asset_);
  }

 private:
  /// Every section must be known to this build, or optional.
  void check_sections() {
    for (const SectionView& section : asset_.sections) {
      const auto refused = [&](Rule rule, const std::string& what = {}) {
        refuse(rule, file_, "section " + section_name(section.type), what);
      };
      const KnownSection* known = known_section(section.type);
      if (!known) {
        if (section.flags & kRequired) refused(Rule::unknown_section);
        continue;  // an optional section of a later version: skipped, as promised
      }
      const uint32_t other = section.flags ^ known->flags;
      if (section.type == kMetadata) {
        asset_.metadata = {reinterpret_cast<const char*>(section.bytes.data()), section.bytes.size()};
        if ((other & kRequired) || asset_.metadata.empty() || !is_utf8(asset_.metadata))
          refused(Rule::metadata_text);
      }
      if (other & kRequired)
        refused(Rule::section_flag,
                known->flags & kRequired ? "is not marked as required" : "is marked as required");
      if (other & kPayloads)
        refused(Rule::section_flag, known->flags & kPayloads ? "is not marked as one of payloads"
                                                             : "is marked as one of payloads");
      if (known->record_bytes == 0 && section.record_size != 0)
        refused(Rule::record_size, "has a size of records, but no records");
    }
    for (const uint32_t type : {kObjects, kInstances, kNames, kData})
      if (!table().has(type)) refuse(Rule::section_missing, file_, "section " + section_name(type));
    names_ = table()[kNames].bytes;
    data_ = Payloads(table()[kData].bytes);
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
    const Records<ObjectRecord> records(table()[kObjects], file_);
    if (records.count() == 0) refuse(Rule::no_object, file_, "section OBJS");
    check_parts(records);
    for_each_part([&]<class Part>(Part) {
      if constexpr (SharesSomething<Part>) read_shared<typename Part::Shared>();
    });
    OfParts<AllRecords> parts(table(), file_);
    asset_.objects.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i)
      asset_.objects.push_back(read_object(records[i], parts, records.place(i)));
    if (asset_.objects.back().level != 0) records.place(records.count() - 1).damaged(Rule::level_order);
    for_each_part([&]<class Part>(Part) {
      const auto& [own, objects] = static_cast<RecordsOf<Part>&>(parts);
      if (own.count() != objects)
        refuse(Rule::records_of_no_object, file_, "section " + section_name(Part::kRecords));
    });
  }

  /// The file must have exactly the sections of the parts of its objects.
  void check_parts(const Records<ObjectRecord>& records) {
    for_each_part([&]<class Part>(Part) {
      size_t count = 0;
      for (uint32_t i = 0; i < records.count(); ++i) {
        const ObjectRecord record = records[i];
        count += Part::of(record) != kNoPart;
      }
      check_presence(Part::kRecords, count > 0);
      if constexpr (SharesSomething<Part>) check_presence(Part::Shared::kRecords, count > 0);
      // Objects point to these views, which must not move.
      std::get<std::pmr::vector<typename Part::View>>(asset_.parts).reserve(count);
    });
  }

  void check_presence(uint32_t type, bool expected) const {
    if (table().has(type) != expected)
      refuse(expected ? Rule::section_missing : Rule::section_unused, file_, "section " + section_name(type));
  }

  template <class Shared>
  void read_shared() {
    const Records<typename Shared::Record> records(table()[Shared::kRecords], file_);
    Shared::of(asset_).reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i)
      Shared::of(asset_).push_back(read_record(records[i], Reading{records.place(i), data_, asset_}));
  }

  ObjectView read_object(const ObjectRecord& record, OfParts<AllRecords>& parts, const Place& place) {
    ObjectView view;
    view.name = read_name(record.name, place);
    place.require(all_finite(record.aabb_min) && all_finite(record.aabb_max), Rule::bounds_not_finite);
    for (int a = 0; a < 3; ++a) place.require(record.aabb_min[a] <= record.aabb_max[a], Rule::bounds_empty);
    place.require(std::isfinite(record.bias) && record.bias >= 0, Rule::bias_range);
    place.require(all_zero(record.reserved), Rule::reserved_not_zero);
    view.bias = record.bias;
    view.triangle_count = record.triangle_count;
    place.require(record.level <= kMaxLevel && (asset_.objects.empty() || asset_.objects.back().level == 0 ||
                                                asset_.objects.back().level == record.level + 1),
                  Rule::level_order);
    place.require(std::isfinite(record.error) && record.error >= 0, Rule::error_range);
    view.level = record.level;
    view.error = record.error;
    view.proven = proves(asset_.prover);
    view.unsupported = why_unsupported(record);
    std::copy_n(record.aabb_min, 3, view.aabb_min.begin());
    std::copy_n(record.aabb_max, 3, view.aabb_max.begin());
    for_each_part([&]<class Part>(Part) {
      if constexpr (CameLater<Part>)  // others must not answer the object without it
        place.require(((record.flags & Part::kFlag) != 0) == (Part::of(record) != kNoPart),
                      Rule::record_missing);
      if (Part::of(record) == kNoPart) return;
      auto& [records, objects] = static_cast<RecordsOf<Part>&>(parts);
      place.require(Part::of(record) == objects, Rule::record_order);
      place.require(objects < records.count(), Rule::record_missing);
      const uint32_t own = objects++;
      if (view.unsupported) return;  // its payloads are skipped
      auto& views = std::get<std::pmr::vector<typename Part::View>>(asset_.parts);
      Part::of(view) =
          &views.emplace_back(read_record(records[own], view, Reading{records.place(own), data_, asset_}));
    });
    return view;
  }

  template <class Kind>
  void read_optional(Kind) {
    const Records<typename Kind::Record> records(table()[Kind::kRecords], file_);
    Payloads payloads(table()[Kind::kValues].bytes);
    auto& views = Kind::of(asset_);
    if (!table().has(Kind::kRecords) && !table().has(Kind::kValues)) return;
    for (const uint32_t type : {Kind::kRecords, Kind::kValues})
      if (!table().has(type)) refuse(Rule::section_missing, file_, "section " + section_name(type));
    if (records.count() == 0) refuse(Rule::section_unused, file_, "section " + section_name(Kind::kRecords));
    views.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i) {
      const auto record = records[i];
      const Place place = records.place(i);
      place.require(record.object < asset_.objects.size(), Rule::object_range);
      place.require(i == 0 || Kind::rank(record) > Kind::rank(records[i - 1]), Kind::kOrder);
      const ObjectView& object = asset_.objects[record.object];
      if (object.unsupported) continue;
      if (const auto view = read_record(record, object, Reading{place, payloads, asset_}))
        views.push_back(*view);
    }
  }

  void read_instances() {
    const Records<InstanceRecord> records(table()[kInstances], file_);
    if (asset_.places_nothing && records.count() != 0) refuse(Rule::places_after_all, file_, "section INST");
    asset_.instances.reserve(records.count());
    for (uint32_t i = 0; i < records.count(); ++i)
      asset_.instances.push_back(read_instance(records[i], i, records.place(i)));
  }

  InstanceView read_instance(const InstanceRecord& record, uint32_t number, const Place& place) {
    InstanceView view;
    view.name = read_name(record.name, place);
    place.require(record.object < asset_.objects.size(), Rule::object_range);
    place.require(asset_.objects[record.object].level == 0, Rule::level_placed);
    place.require(record.parent == kNoParent || record.parent < number, Rule::parent_order);
    place.require(unknown_flags(record.flags, kDisabled) == 0, Rule::unknown_flags);
    place.require(record.reserved == 0, Rule::reserved_not_zero);
    place.require(all_finite(record.linear), Rule::transform_not_finite);
    for (size_t a = 0; a < 3; ++a) {
      const double exact = record.translation[a];
      place.require(std::abs(exact) <= double(std::numeric_limits<float>::max()), Rule::transform_not_finite);
      const auto rounded = static_cast<float>(exact);
      const double remainder = lost_to_float(exact);
      view.remainder[a] = static_cast<float>(remainder);
      place.require(double(view.remainder[a]) == remainder, Rule::translation_sum);
      std::copy_n(record.linear + 3 * a, 3, view.transform.begin() + ptrdiff_t(4 * a));
      view.transform[4 * a + 3] = rounded;
    }
    view.object = record.object;
    view.user = record.user;
    view.mask = record.mask;
    view.flags = record.flags & kDisabled;
    view.parent = record.parent;
    return view;
  }

  std::string_view file_;
  AssetView asset_;
  Bytes names_;
  size_t names_end_ = 0;
  Payloads data_;
};

}  // namespace

const KnownSection* known_section(uint32_t type) {
  const KnownSection* const end = kKnownSections.sections + kKnownSections.count;
  const KnownSection* const at =
      std::find_if(kKnownSections.sections, end, [&](const KnownSection& one) { return one.type == type; });
  return at == end ? nullptr : at;
}

AssetView read_asset(std::span<const std::byte> bytes, std::string_view file_name,
                     std::pmr::memory_resource* memory) {
  if (reinterpret_cast<uintptr_t>(bytes.data()) % kAddressAlignment != 0)
    throw Error(Status::usage, std::string(file_name) +
                                   ": its bytes lie at an address that is no multiple of " +
                                   std::to_string(kAddressAlignment));
  return Reader(bytes, file_name, memory).read();
}

kernels::AnyField field_of(const ObjectView& object) {
  return with_all_parts([&]<class... Part>(Part...) {
    return kernels::join_parts<FieldOf<Part>...>(Part::of(object) ? &Part::of(object)->field : nullptr...);
  });
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
                   numbers.capacity() * sizeof(NumbersView) + colors.capacity() * sizeof(ColorsView) +
                   skins.capacity() * sizeof(SkinView);
  total += mlps.capacity() * sizeof(MlpView) + decoded.view_bytes() +
           spherical_networks.capacity() * sizeof(SphericalNetworksView) +
           alpha_maps.capacity() * sizeof(kernels::AlphaMap);
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

const SkinView* AssetView::skin_of(uint32_t object) const { return view_of(skins, object); }

const NumbersView* AssetView::numbers_of(uint32_t object, NumbersKind kind) const {
  const auto rank = [](const NumbersView& view) { return std::pair(view.object, view.kind); };
  const std::pair wanted(object, uint32_t{kind});
  const auto at = std::lower_bound(numbers.begin(), numbers.end(), wanted,
                                   [&](const NumbersView& view, const auto& w) { return rank(view) < w; });
  return at != numbers.end() && rank(*at) == wanted ? &*at : nullptr;
}

size_t AssetView::placed_count() const {
  if (!instances.empty() || places_nothing) return instances.size();
  return size_t(
      std::count_if(objects.begin(), objects.end(), [](const ObjectView& o) { return o.level == 0; }));
}

kernels::HitDetails hit_details(const AssetView& asset, uint32_t object) {
  kernels::HitDetails details;
  if (const NumbersView* source = asset.numbers_of(object, kSourceTriangles))
    details.source_triangles = source->field;
  if (const ColorsView* colors = asset.colors_of(object))
    details.colors = {grid_of(asset.objects[object]), colors->values};
  return details;
}

FileParts bytes_by_part(const AssetView& asset) {
  FileParts parts;
  uint64_t networks = 0, primaries = 0, sources = 0, numbers = 0, colors = 0, skins = 0;
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
  parts.add({"alpha_maps", asset.alpha_map_bytes.file, asset.alpha_map_bytes.decoded});
  parts.add({"primary", primaries});
  for (const NumbersView& one : asset.numbers)
    (one.kind == kSourceTriangles ? sources : numbers) += one.bytes;
  parts.add({"source_triangles", sources});
  parts.add({"numbers", numbers});
  for (const ColorsView& one : asset.colors) colors += one.bytes();
  parts.add({"colors", colors});
  for (const SkinView& one : asset.skins) skins += one.bytes();
  parts.add({"skin", skins});
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
  alpha_maps.clear();
  alpha_map_bytes = {};
  decoded.drop();
  sections = std::pmr::vector<SectionView>(sections.get_allocator());
  numbers.clear();
  colors.clear();
  skins.clear();
  bytes = {};
}

}  // namespace nif::format
