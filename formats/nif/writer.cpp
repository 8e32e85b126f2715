// Lays out the sections of a .nif file; formats/nif/layout.hpp and docs/format.md define the layout.
#include "formats/nif/writer.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include "formats/base/size.hpp"
#include "formats/base/status.hpp"
#include "formats/base/utf8.hpp"
#include "formats/nif/crc32c.hpp"

namespace nif::format {
namespace {

/// The sections of records of the parts that any object has, each followed by that of what is shared.
class PartSections {
 public:
  PartSections(const Asset& asset, Sections& sections) {
    size_t k = 0;
    for_each_part([&]<class Part>(Part) {
      const bool any = std::any_of(asset.objects.begin(), asset.objects.end(),
                                   [](const Object& object) { return Part::of(object).has_value(); });
      if (any) {
        records_[k] = &sections.add(Part::kRecords, kRecordsFlags<Part>, sizeof(typename Part::Record));
        if constexpr (requires { typename Part::Shared; })
          shared_[k] = &sections.add(Part::Shared::kRecords, kRecordsFlags<Part>,
                                     sizeof(typename Part::Shared::Record));
      }
      ++k;
    });
  }

  void add_shared(const Asset& asset, Section& data) {
    size_t k = 0;
    for_each_part([&]<class Part>(Part) {
      if constexpr (requires { typename Part::Shared; })
        if (shared_[k])
          for (const auto& one : Part::Shared::of(asset)) {
            const typename Part::Shared::Record record = write_record(one, data);
            shared_[k]->append(&record, 1);
          }
      ++k;
    });
  }

  /// Sets the numbers of its parts in `record`.
  void add_object(const Object& object, ObjectRecord& record, Section& data) {
    size_t k = 0;
    for_each_part([&]<class Part>(Part) {
      Part::of(record) = kNoPart;
      if (Part::of(object)) {
        const typename Part::Record own = write_record(*Part::of(object), object, data);
        records_[k]->append(&own, 1);
        Part::of(record) = counts_[k]++;
        record.flags |= flag_of(Part());
      }
      ++k;
    });
  }

 private:
  static constexpr size_t kParts = std::tuple_size_v<Parts>;
  std::array<Section*, kParts> records_{}, shared_{};
  std::array<uint32_t, kParts> counts_{};
};

/// Without what no object needs, so that files without parts that came later stay as they are.
uint32_t bytes_of_records(const Asset& asset) {
  bool later = false;
  for_each_part([&]<class Part>(Part) {
    if constexpr (CameLater<Part>)
      for (const Object& object : asset.objects) later = later || Part::of(object).has_value();
  });
  return later ? sizeof(ObjectRecord) : ObjectRecord::kFirstBytes;
}

void add_object(const Object& object, PartSections& parts, Section& objects, uint32_t record_bytes,
                Section& names, Section& data) {
  ObjectRecord record{};
  parts.add_object(object, record, data);
  record.level = object.level;
  record.name = names.append_name(object.name);
  std::copy(object.aabb_min.begin(), object.aabb_min.end(), record.aabb_min);
  std::copy(object.aabb_max.begin(), object.aabb_max.end(), record.aabb_max);
  record.bias = object.bias;
  record.triangle_count = object.triangle_count;
  record.error = object.error;
  objects.append(reinterpret_cast<const std::byte*>(&record), record_bytes);
}

void add_instance(const Instance& instance, Section& instances, Section& names) {
  InstanceRecord record{};
  for (size_t a = 0; a < 3; ++a) {
    const float rounded = instance.transform[4 * a + 3], remainder = instance.remainder[a];
    record.translation[a] = double(rounded);
    if (remainder != 0) record.translation[a] += double(remainder);  // adding 0 would lose the sign of -0
    std::copy_n(instance.transform.begin() + ptrdiff_t(4 * a), 3, record.linear + 3 * a);
  }
  record.object = instance.object;
  record.name = names.append_name(instance.name);
  record.user = instance.user;
  record.mask = instance.mask;
  record.flags = instance.flags;
  record.parent = instance.parent;
  instances.append(&record, 1);
}

template <class Kind>
void add_optional(const Asset& asset, Sections& sections) {
  if (std::none_of(asset.objects.begin(), asset.objects.end(), Kind::has)) return;
  Section& records = sections.add(Kind::kRecords, 0, sizeof(typename Kind::Record));
  Section& payloads = sections.add(Kind::kValues, kPayloads);
  for (uint32_t i = 0; i < asset.objects.size(); ++i)
    if (Kind::has(asset.objects[i])) records.append(Kind::write(asset.objects[i], i, payloads));
}

/// Small tables first: one page holds everything that a tool needs to describe the file.
void fill(const Asset& asset, Sections& sections) {
  const uint32_t record_bytes = bytes_of_records(asset);
  Section& objects = sections.add(kObjects, kRequired, record_bytes);
  Section& instances = sections.add(kInstances, kRequired, sizeof(InstanceRecord));
  Section& names = sections.add(kNames, kRequired);
  PartSections parts(asset, sections);
  Section& data = sections.add(kData, kRequired | kPayloads);
  parts.add_shared(asset, data);
  for (const Object& object : asset.objects) add_object(object, parts, objects, record_bytes, names, data);
  for (const Instance& instance : asset.instances) add_instance(instance, instances, names);
  for_each_optional([&]<class Kind>(Kind) { add_optional<Kind>(asset, sections); });
  if (!asset.metadata.empty())
    sections.add(kMetadata, 0).append(asset.metadata.data(), asset.metadata.size());
  for (const KeptSection& kept : asset.kept)
    sections.add(kept.type, kept.flags, kept.record_size).append(kept.bytes);
}

uint64_t table_end(const Sections& sections) {
  return sizeof(Header) + sections.entries().size() * sizeof(SectionEntry);
}

template <class T>
void store(std::vector<std::byte>& file, uint64_t offset, const T& value) {
  std::memcpy(file.data() + offset, &value, sizeof(value));
}

}  // namespace

uint64_t encoded_bytes(const Asset& asset) {
  Sections sections(true);
  fill(asset, sections);
  uint64_t end = table_end(sections);
  for (const Sections::Entry& entry : sections.entries()) end = aligned(end) + entry.section.size();
  return end;
}

SectionBytes section_bytes(const Asset& part) {
  Sections sections(true);
  fill(part, sections);
  SectionBytes bytes;
  for (const Sections::Entry& entry : sections.entries())
    bytes.emplace_back(entry.type, entry.section.padded_size());
  return bytes;
}

void FileSize::set(size_t part, const SectionBytes& bytes) {
  const std::lock_guard lock(changing_);
  if (part >= parts_.size()) parts_.resize(part + 1);
  for (const auto& [type, old] : parts_[part]) {
    Sum& sum = sections_[type];
    sum.bytes -= old;
    if (--sum.parts == 0) sections_.erase(type);
  }
  parts_[part] = bytes;
  for (const auto& [type, added] : bytes) {
    Sum& sum = sections_[type];
    ++sum.parts;
    sum.bytes += added;
  }
}

uint64_t FileSize::bytes() const {
  const std::lock_guard lock(changing_);
  uint64_t bytes = aligned(sizeof(Header) + sections_.size() * sizeof(SectionEntry));
  for (const auto& [type, sum] : sections_) bytes += aligned(sum.bytes);
  return bytes;
}

EncodedAsset encode_and_view(const Asset& asset) {
  Sections sections(false);
  fill(asset, sections);
  std::vector<std::byte> file(memory_size(table_end(sections)));
  size_t at = sizeof(Header);
  for (const auto& [type, flags, record_size, section] : sections.entries()) {
    file.resize(memory_size(aligned(file.size())));
    const uint32_t crc = flags & kPayloads ? 0 : crc32c(section.bytes());
    store(file, at, SectionEntry{type, flags, file.size(), section.size(), crc, record_size});
    file.insert(file.end(), section.bytes().begin(), section.bytes().end());
    at += sizeof(SectionEntry);
  }
  Header header{};
  std::copy(std::begin(kIdentifier), std::end(kIdentifier), header.identifier);
  header.version = kVersion;
  header.file_bytes = file.size();
  header.section_count = uint32_t(sections.entries().size());
  header.flags = asset.places_nothing ? uint32_t{kPlacesNothing} : 0;
  header.arithmetic = kArithmetic;
  header.prover = asset.prover;
  header.table_crc = crc32c(std::span(file).subspan(sizeof(Header), at - sizeof(Header)));
  header.header_crc = crc32c(std::as_bytes(std::span(&header, 1)));
  store(file, 0, header);

  try {
    AssetView view = read_asset(file, "the asset to be written");
    for (const ObjectView& object : view.objects)
      if (object.unsupported)
        throw Error(Status::internal, "object '" + std::string(object.name) + "' " + object.unsupported);
    return {std::move(file), std::move(view)};
  } catch (const Error& error) {
    throw Error(Status::internal, error.what());
  }
}

std::vector<std::byte> encode(const Asset& asset) { return encode_and_view(asset).bytes; }

std::string clean_name(std::string_view text) {
  std::string clean;
  while (!text.empty()) {
    const size_t bytes = text[0] == '\0' ? 0 : utf8_sequence(text);
    if (bytes == 0)
      clean += "\xef\xbf\xbd";
    else
      clean += text.substr(0, bytes);
    text.remove_prefix(std::max<size_t>(bytes, 1));
  }
  return clean;
}

}  // namespace nif::format
