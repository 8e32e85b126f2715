// Lays out the sections of a .nif file; formats/nif/layout.hpp and docs/format.md define the layout.
#include "formats/nif/writer.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>

#include "formats/base/size.hpp"
#include "formats/base/status.hpp"
#include "formats/base/utf8.hpp"
#include "formats/nif/crc32c.hpp"

namespace nif::format {
namespace {

/// The writer of a part.
template <class Part>
class WriterOf {
 public:
  /// Makes its sections if any object has the part.
  WriterOf(const Asset& asset, Sections& sections) {
    const bool any = std::any_of(asset.objects.begin(), asset.objects.end(),
                                 [](const Object& object) { return Part::of(object).has_value(); });
    if (any) writer_.emplace(sections, asset);
  }
  /// The index of the object's record, if the object has the part.
  uint32_t add(const Object& object) {
    if (!Part::of(object)) return kNoPart;
    writer_->add(*Part::of(object), object);
    return count_++;
  }

 private:
  std::optional<typename Part::Writer> writer_;
  uint32_t count_ = 0;
};
template <class... Part>
struct WritersOf : WriterOf<Part>... {
  WritersOf(const Asset& asset, Sections& sections) : WriterOf<Part>(asset, sections)... {}
};

void add_object(const Object& object, OfParts<WritersOf>& writers, Section& objects, Section& names) {
  ObjectRecord record{};
  for_each_part(
      [&]<class Part>(Part) { Part::of(record) = static_cast<WriterOf<Part>&>(writers).add(object); });
  record.name = names.append_name(object.name);
  std::copy(object.aabb_min.begin(), object.aabb_min.end(), record.aabb_min);
  std::copy(object.aabb_max.begin(), object.aabb_max.end(), record.aabb_max);
  record.bias = object.bias;
  record.triangle_count = object.triangle_count;
  objects.append(&record, 1);
}

void add_instance(const Instance& instance, Section& instances, Section& names) {
  InstanceRecord record{};
  std::copy(instance.transform.begin(), instance.transform.end(), record.transform);
  record.object = instance.object;
  record.name = names.append_name(instance.name);
  instances.append(&record, 1);
}

/// Adds translations if any is not a float.
void add_translations(const Asset& asset, Sections& sections) {
  const auto remains = [](const Instance& instance) { return instance.remainder != std::array<float, 3>{}; };
  if (!std::any_of(asset.instances.begin(), asset.instances.end(), remains)) return;
  Section& translations = sections.add(kTranslations, 0);
  for (const Instance& instance : asset.instances) {
    Translation translation;
    for (size_t a = 0; a < 3; ++a)
      translation.along[a] = double(instance.transform[4 * a + 3]) + double(instance.remainder[a]);
    translations.append(&translation, 1);
  }
}

/// Small tables first: one page holds everything that a tool needs to describe the file.
void fill(const Asset& asset, Sections& sections) {
  Section& objects = sections.add(kObjects);
  Section& instances = sections.add(kInstances);
  Section& names = sections.add(kNames);
  OfParts<WritersOf> writers(asset, sections);
  for (const Object& object : asset.objects) add_object(object, writers, objects, names);
  for (const Instance& instance : asset.instances) add_instance(instance, instances, names);
  add_translations(asset, sections);
  std::optional<PrimaryWriter> primaries;
  for (uint32_t i = 0; i < asset.objects.size(); ++i) {
    if (!asset.objects[i].primary) continue;
    if (!primaries) primaries.emplace(sections);
    primaries->add(*asset.objects[i].primary, i);
  }
  std::optional<SourceTrianglesWriter> sources;
  for (uint32_t i = 0; i < asset.objects.size(); ++i) {
    if (!asset.objects[i].source_triangles) continue;
    if (!sources) sources.emplace(sections);
    sources->add(*asset.objects[i].source_triangles, i);
  }
  std::optional<ColorsWriter> colors;
  for (uint32_t i = 0; i < asset.objects.size(); ++i) {
    if (!asset.objects[i].colors) continue;
    if (!colors) colors.emplace(sections);
    colors->add(*asset.objects[i].colors, i);
  }
  if (!asset.metadata.empty())
    sections.add(kMetadata, 0).append(asset.metadata.data(), asset.metadata.size());
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
  for (const auto& [type, flags, section] : sections.entries()) {
    file.resize(memory_size(aligned(file.size())));
    store(file, at, SectionEntry{type, flags, file.size(), section.size(), crc32c(section.bytes()), 0});
    file.insert(file.end(), section.bytes().begin(), section.bytes().end());
    at += sizeof(SectionEntry);
  }
  Header header{};
  std::copy(std::begin(kIdentifier), std::end(kIdentifier), header.identifier);
  header.version = kVersion;
  header.file_bytes = file.size();
  header.section_count = uint32_t(sections.entries().size());
  header.flags = asset.places_nothing ? uint32_t{kPlacesNothing} : 0;
  header.table_crc = crc32c(std::span(file).subspan(sizeof(Header), at - sizeof(Header)));
  header.header_crc = crc32c(std::as_bytes(std::span(&header, 1)));
  store(file, 0, header);

  try {
    AssetView view = read_asset(file, "the asset to be written");
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
