// Inserted text has one fixed form, so that it can be found and removed without a trace. A member or an
// element is appended to its container, preceded by a comma. A container that does not exist is created, and
// removed again. One that was there and empty gets a tab before its first content, to tell the two cases
// apart. What cannot be seen from the result, the original length of the binary data, is stored in the
// "extras" of the extension.
#include "formats/mesh/gltf/attach.hpp"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "formats/base/json_text.hpp"
#include "formats/mesh/gltf/gltf_json_text.hpp"
#include "formats/mesh/gltf/json.hpp"

namespace nif::mesh {
namespace {

using namespace detail;
using nlohmann::json;

// NIF_ASSET_ALIGNMENT of nif.h, so that an asset can be used in place.
constexpr uint64_t kAssetAlignment = 64;
constexpr uint64_t kLargestGlb = std::numeric_limits<uint32_t>::max();
constexpr uint64_t kGlbHeader = 12, kChunkHeader = 8;
constexpr const char* kMimeType = "model/vnd.nifkit.nif";

uint64_t padded(uint64_t bytes, uint64_t alignment) {
  return (bytes + alignment - 1) / alignment * alignment;
}

std::string quoted(std::string_view text) { return '"' + std::string(text) + '"'; }

/// The parts of a file that change, and those around them.
struct Parts {
  Input input;
  bool glb = false;
  std::string_view text;                   ///< JSON; for a GLB with its padding, for a .gltf the whole file
  std::optional<std::string_view> binary;  ///< the binary chunk of a GLB
  std::string_view tail;                   ///< for a GLB: everything after that, other chunks
  uint64_t tail_length = 0;                ///< the part of it that the GLB's header includes
};

Parts split(const std::filesystem::path& file, std::string_view bytes) {
  Parts parts{{file, {}, {}, bytes, {}}, bytes.starts_with("glTF"), bytes, {}, {}, 0};
  if (!parts.glb) return parts;
  const GltfContainer container = open_container(parts.input);
  parts.text = container.text;
  parts.binary = container.binary;
  const char *first = bytes.data() + kGlbHeader + kChunkHeader, *end = parts.text.data() + parts.text.size();
  bool in_order = parts.text.data() == first;
  if (in_order && parts.binary) {
    in_order = parts.binary->data() == end + kChunkHeader;
    end = parts.binary->data() + parts.binary->size();
  }
  if (!in_order) {
    parts.input.fail(
        Status::malformed_mesh,
        "has GLB chunks in another order than JSON, binary data, others, so nothing can be attached to it");
  }
  parts.tail = bytes.substr(size_t(end - bytes.data()));
  parts.tail_length = parts.tail.size() - (bytes.size() - container.length);
  return parts;
}

/// Numbers in the byte order of the container.
std::string words(std::initializer_list<uint64_t> values) {
  std::string out;
  for (const uint64_t value : values) {
    const uint32_t word = uint32_t(value);
    std::array<char, sizeof word> bytes{};
    std::memcpy(bytes.data(), &word, sizeof word);
    out.append(bytes.data(), bytes.size());
  }
  return out;
}

/// Appends the file with changed text and binary data to `out`. If `binary` is empty, there is no binary
/// chunk.
FilePieces assemble(const Parts& parts, const TextEdits& edits, const std::vector<std::string_view>& binary,
                    FilePieces out = {}) {
  if (!parts.glb) {
    edits.apply(parts.text, out);
    return out;
  }
  constexpr uint64_t kMagic = 0x46546C67, kVersion = 2, kJson = 0x4E4F534A, kBinary = 0x004E4942;
  const uint64_t text = uint64_t(int64_t(parts.text.size()) + edits.growth());
  uint64_t bytes = 0;
  for (const std::string_view piece : binary) bytes += piece.size();
  const uint64_t length =
      kGlbHeader + kChunkHeader + text + (binary.empty() ? 0 : kChunkHeader + bytes) + parts.tail_length;
  if (length > kLargestGlb) {
    parts.input.fail(Status::too_large,
                     fmt::format("would take {} bytes, but a .glb can have at most {}", length, kLargestGlb));
  }
  out.own(words({kMagic, kVersion, length, text, kJson}));
  edits.apply(parts.text, out);
  if (!binary.empty()) out.own(words({bytes, kBinary}));
  for (const std::string_view piece : binary) out.refer(piece);
  out.refer(parts.tail);
  return out;
}

/// The parts of a JSON text that an attachment consists of.
struct Places {
  JsonText text;
  size_t root;
  std::vector<JsonItem> root_items;
  std::optional<JsonItem> used, extensions, views, buffers, nodes;

  explicit Places(std::string_view bytes) : text(bytes), root(text.root()), root_items(text.items(root)) {
    used = find("extensionsUsed");
    extensions = find("extensions");
    views = find("bufferViews");
    buffers = find("buffers");
    nodes = find("nodes");
  }

 private:
  std::optional<JsonItem> find(std::string_view name) const { return text.find(root_items, name); }
};

// ---- Removing ---------------------------------------------------------------------------------------------

/// Removes some items of a container; returns true if it becomes empty and was created for them.
bool remove_items(const JsonText& text, size_t container, const std::vector<JsonItem>& items,
                  const std::vector<bool>& gone, TextEdits& edits) {
  size_t first_kept = 0;
  while (first_kept < items.size() && gone[first_kept]) ++first_kept;
  if (first_kept == items.size()) {
    const bool was_there = text.starts_with(container + 1, '\t');
    if (was_there) edits.replace(container + 1, items.back().end, "");
    return !was_there;
  }
  if (first_kept > 0) edits.replace(items.front().begin, items[first_kept].begin, "");
  for (size_t i = first_kept + 1; i < items.size(); ++i)
    if (gone[i]) edits.replace(items[i - 1].end, items[i].end, "");
  return false;
}

/// The same for a single item.
bool remove_item(const JsonText& text, size_t container, size_t begin, TextEdits& edits) {
  const std::vector<JsonItem> items = text.items(container);
  std::vector<bool> gone(items.size());
  for (size_t i = 0; i < items.size(); ++i) gone[i] = items[i].begin == begin;
  return remove_items(text, container, items, gone, edits);
}

/// The changes that restore the original file.
struct Removal {
  TextEdits edits;
  std::optional<uint64_t> binary;  ///< bytes of the binary chunk; nothing: it has none
};

class Remover {
 public:
  explicit Remover(const Parts& parts) : parts_(parts), places_(parts.text), text_(places_.text) {}

  /// The extension's member of the root's extensions.
  std::optional<JsonItem> attachment() const {
    return places_.extensions ? text_.find(places_.extensions->value, kName) : std::nullopt;
  }

  /// Returns nothing if there is no attachment. Throws malformed_mesh if it cannot be removed.
  std::optional<Removal> plan() {
    // Most files need no closer look.
    if (parts_.text.find(quoted(kName)) == std::string_view::npos) return std::nullopt;
    Removal removal;
    if (parts_.binary) removal.binary = parts_.binary->size();
    const bool in_nodes = remove_from_nodes(removal.edits);
    const std::optional<JsonItem> own = attachment();
    if (!own) {
      if (in_nodes || names_extension()) refuse("it does not say what is attached");
      return std::nullopt;
    }
    read_extension(*own);
    gone_.assign(places_.root_items.size(), false);
    if (embedded_) take_out_asset(removal);
    if (remove_item(text_, places_.extensions->value, own->begin, removal.edits)) go(*places_.extensions);
    if (names_extension()) {
      const std::vector<JsonItem> names = text_.items(places_.used->value);
      std::vector<bool> own_names(names.size());
      for (size_t i = 0; i < names.size(); ++i) own_names[i] = text_.of(names[i]) == quoted(kName);
      if (remove_items(text_, places_.used->value, names, own_names, removal.edits)) go(*places_.used);
    }
    remove_items(text_, places_.root, places_.root_items, gone_, removal.edits);
    return removal;
  }

 private:
  static constexpr const char* kName = kVisibilityExtension;

  [[noreturn]] void refuse(const std::string& why) const {
    parts_.input.fail(Status::malformed_mesh,
                      fmt::format("has an attachment by {} that cannot be removed: {}", kName, why));
  }

  void go(const JsonItem& root_member) {
    for (size_t i = 0; i < gone_.size(); ++i)
      if (places_.root_items[i].begin == root_member.begin) gone_[i] = true;
  }

  bool names_extension() const {
    if (!places_.used) return false;
    for (const JsonItem& name : text_.items(places_.used->value))
      if (text_.of(name) == quoted(kName)) return true;
    return false;
  }

  bool remove_from_nodes(TextEdits& edits) const {
    bool any = false;
    if (!places_.nodes) return any;
    for (const JsonItem& node : text_.items(places_.nodes->value)) {
      if (text_.of(node).find(quoted(kName)) == std::string_view::npos) continue;
      const auto extensions = text_.find(node.value, "extensions");
      const auto own = extensions ? text_.find(extensions->value, kName) : std::nullopt;
      if (!own) continue;  // a node with that name
      any = true;
      if (remove_item(text_, extensions->value, own->begin, edits))
        remove_item(text_, node.value, extensions->begin, edits);
    }
    return any;
  }

  /// Stores what the extension states about its one asset.
  void read_extension(const JsonItem& extension) {
    const json own = parsed(extension), assets = member(own, "assets");
    if (!assets.is_array() || assets.size() != 1) refuse("it does not list one asset");
    const json &asset = assets[0], restore = member(member(own, "extras"), "restore");
    embedded_ = asset.is_object() && asset.contains("bufferView");
    if (!embedded_) return;
    if (!parts_.glb || !restore.is_object()) refuse("it does not say how long the binary data was before");
    view_ = number(asset, "bufferView");
    if (restore.contains("byteLength")) length_before_ = number(restore, "byteLength");
    if (restore.contains("chunkLength")) chunk_before_ = number(restore, "chunkLength");
  }

  json parsed(const JsonItem& item) const { return parse_untrusted<json>(text_.of(item)); }

  static json member(const json& object, const char* name) {
    const auto found = object.is_object() ? object.find(name) : object.end();
    return found == object.end() ? json() : *found;
  }

  uint64_t number(const json& object, const char* name) const {
    const auto found = object.find(name);
    if (found == object.end() || !found->is_number_unsigned())
      refuse(fmt::format("its {} is not a number", name));
    return found->get<uint64_t>();
  }

  /// Removes the asset's buffer view, and its bytes at the end of the binary chunk.
  void take_out_asset(Removal& removal) {
    const std::vector<JsonItem> views = places_.views ? text_.items(places_.views->value) : no_items_,
                                buffers = places_.buffers ? text_.items(places_.buffers->value) : no_items_;
    if (view_ + 1 != views.size() || buffers.empty() || !parts_.binary)
      refuse("its buffer view is not the last one");
    const json view = parsed(views.back());
    const std::optional<JsonItem> length = text_.find(buffers[0].value, "byteLength");
    const uint64_t before = chunk_before_.value_or(0), offset = padded(before, kAssetAlignment);
    if (!length || member(view, "buffer") != 0 || member(view, "byteOffset") != offset ||
        before > parts_.binary->size())
      refuse("its bytes are not where they were put");
    const uint64_t end = offset + number(view, "byteLength");
    if (parsed(*length) != end || parts_.binary->size() != padded(end, sizeof(uint32_t)))
      refuse("its bytes are not the last ones");
    if (remove_item(text_, places_.views->value, views.back().begin, removal.edits)) go(*places_.views);
    if (length_before_)
      removal.edits.replace(length->value, length->end, std::to_string(*length_before_));
    else if (remove_item(text_, places_.buffers->value, buffers[0].begin, removal.edits))
      go(*places_.buffers);
    removal.binary = chunk_before_;
  }

  const Parts& parts_;
  const Places places_;
  const JsonText& text_;
  const std::vector<JsonItem> no_items_{};
  std::vector<bool> gone_;  // [root member]
  bool embedded_ = false;
  uint64_t view_ = 0;
  std::optional<uint64_t> length_before_, chunk_before_;
};

std::vector<std::string_view> kept_binary(const Parts& parts, const Removal& removal) {
  if (!removal.binary) return {};
  return {parts.binary->substr(0, *removal.binary)};
}

// ---- Inserting --------------------------------------------------------------------------------------------

class Attacher {
 public:
  Attacher(const Parts& parts, const Attachment& attachment)
      : parts_(parts), attachment_(attachment), places_(parts.text), text_(places_.text) {}

  /// `out` owns the bytes that the parts refer to.
  FilePieces run(FilePieces out) {
    const bool embed = !attachment_.asset.empty();
    std::vector<std::string_view> binary;
    if (parts_.binary) binary.push_back(*parts_.binary);
    std::string restore;
    const std::string where = embed ? fmt::format(R"("bufferView":{})", embed_asset(binary, restore, out))
                                    : fmt::format(R"("uri":{})", json(attachment_.uri).dump());
    add_to_nodes();
    const std::string name = quoted(kVisibilityExtension);
    add(edits_, places_.used, "extensionsUsed", "[]", name);
    const auto add_extension = [&](TextEdits& edits, size_t spaces) {
      add(edits, places_.extensions, "extensions", "{}",
          fmt::format(R"({}:{{"assets":[{{{},"mimeType":"{}"}}]{}{}}})", name, where, kMimeType, restore,
                      std::string(spaces, ' ')));
    };
    // White space within the extension fills the alignment that a GLB needs between text and data, so that
    // existing padding stays as it is. It also aligns an embedded asset in the file.
    size_t spaces = 0;
    if (parts_.glb) {
      TextEdits trial = edits_;
      add_extension(trial, 0);
      const uint64_t end = kGlbHeader + 2 * kChunkHeader + parts_.text.size() + uint64_t(trial.growth());
      spaces = padded(end, embed ? kAssetAlignment : sizeof(uint32_t)) - end;
    }
    add_extension(edits_, spaces);
    return assemble(parts_, edits_, binary, std::move(out));
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    parts_.input.fail(Status::malformed_mesh, what + ", so nothing can be attached to it");
  }

  /// Appends an item to an existing container.
  void append(TextEdits& edits, size_t container, const std::string& item) const {
    const std::vector<JsonItem> items = text_.items(container);
    if (items.empty())
      edits.insert(container + 1, '\t' + item);
    else
      edits.insert(items.back().end, ',' + item);
  }

  /// Appends an item to a member of the root, which is created if it does not exist.
  void add(TextEdits& edits, const std::optional<JsonItem>& member, std::string_view name,
           std::string_view brackets, const std::string& item) const {
    if (!member) {
      append(edits, places_.root, fmt::format("\"{}\":{}{}{}", name, brackets[0], item, brackets[1]));
      return;
    }
    if (!text_.starts_with(member->value, brackets[0])) refuse(fmt::format("has {} of the wrong type", name));
    append(edits, member->value, item);
  }

  /// Returns the number of the buffer view.
  size_t embed_asset(std::vector<std::string_view>& binary, std::string& restore, FilePieces& out) {
    if (!parts_.glb) parts_.input.fail(Status::usage, "is a .gltf, which has no binary chunk for the asset");
    const uint64_t before = parts_.binary ? parts_.binary->size() : 0,
                   offset = padded(before, kAssetAlignment), length = attachment_.asset.size(),
                   end = offset + length;
    const std::vector<JsonItem> buffers =
        places_.buffers ? text_.items(places_.buffers->value) : std::vector<JsonItem>{};
    std::string fields;
    if (buffers.empty()) {
      add(edits_, places_.buffers, "buffers", "[]", fmt::format(R"({{"byteLength":{}}})", end));
    } else {
      const std::optional<JsonItem> bytes = text_.find(buffers[0].value, "byteLength");
      if (text_.find(buffers[0].value, "uri")) {
        parts_.input.fail(
            Status::usage,
            "has its first buffer in another file, so no asset can be embedded; use --reference instead");
      }
      if (!bytes || !parts_.binary) refuse("has a first buffer without bytes");
      fields = fmt::format(R"("byteLength":{})", text_.of(*bytes));
      edits_.replace(bytes->value, bytes->end, std::to_string(end));
    }
    if (parts_.binary) fields += fmt::format(R"({}"chunkLength":{})", fields.empty() ? "" : ",", before);
    restore = fmt::format(R"(,"extras":{{"restore":{{{}}}}})", fields);

    const size_t view = places_.views ? text_.items(places_.views->value).size() : 0;
    add(edits_, places_.views, "bufferViews", "[]",
        fmt::format(R"({{"buffer":0,"byteOffset":{},"byteLength":{}}})", offset, length));
    binary.push_back(out.hold(std::string(offset - before, '\0')));
    binary.push_back({reinterpret_cast<const char*>(attachment_.asset.data()), length});
    binary.push_back(out.hold(std::string(padded(end, sizeof(uint32_t)) - end, '\0')));
    return view;
  }

  void add_to_nodes() {
    const std::vector<JsonItem> nodes =
        places_.nodes ? text_.items(places_.nodes->value) : std::vector<JsonItem>{};
    for (const AttachedNode& attached : attachment_.nodes) {
      if (attached.node >= nodes.size()) refuse(fmt::format("has no node {}", attached.node));
      const size_t node = nodes[attached.node].value;
      const std::string item =
          fmt::format(R"("{}":{{"asset":0,"instance":{}}})", kVisibilityExtension, attached.instance);
      const std::optional<JsonItem> extensions = text_.find(node, "extensions");
      if (extensions && !text_.is_object(extensions->value))
        refuse(fmt::format("has extensions of the wrong type in node {}", attached.node));
      if (extensions)
        append(edits_, extensions->value, item);
      else
        append(edits_, node, fmt::format(R"("extensions":{{{}}})", item));
    }
  }

  const Parts& parts_;
  const Attachment& attachment_;
  const Places places_;
  const JsonText& text_;
  TextEdits edits_;
};

}  // namespace

GltfFile::GltfFile(std::filesystem::path file, uint64_t max_bytes)
    : file_(std::move(file)), bytes_(load_file(file_, max_bytes)) {
  std::string_view text = bytes();
  if (text.empty()) throw Error(Status::file_empty, file_.string() + ": is empty");
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const size_t first = text.find_first_not_of(" \t\r\n");
  if (!is_glb() && (first == std::string_view::npos || text[first] != '{'))
    throw Error(Status::not_a_mesh, file_.string() + ": contains neither glTF nor GLB data");
}

std::vector<std::string> GltfFile::relative_uris() const {
  const Parts parts = split(file_, bytes());
  const JsonText text(parts.text);
  std::vector<std::string> uris;
  for (const char* name : {"buffers", "images"}) {
    const std::optional<JsonItem> list = text.find(text.root(), name);
    if (!list) continue;
    for (const JsonItem& item : text.items(list->value)) {
      const std::optional<JsonItem> uri = text.find(item.value, "uri");
      if (!uri || text.of(*uri).starts_with("\"data:")) continue;
      const json value = parse_untrusted<json>(text.of(*uri));
      if (value.is_string() && value.get_ref<const std::string&>().find("://") == std::string::npos)
        uris.push_back(value.get<std::string>());
    }
  }
  return uris;
}

bool GltfFile::has_attachment() const { return Remover(split(file_, bytes())).plan().has_value(); }

FilePieces GltfFile::with(const Attachment& attachment) const {
  Parts parts = split(file_, bytes());
  FilePieces out;
  if (const auto removal = Remover(parts).plan()) {
    FilePieces text;
    removal->edits.apply(parts.text, text);
    parts.text = out.hold(text.joined());
    if (removal->binary)
      parts.binary = parts.binary->substr(0, *removal->binary);
    else
      parts.binary.reset();
  }
  return Attacher(parts, attachment).run(std::move(out));
}

FilePieces GltfFile::without() const {
  const Parts parts = split(file_, bytes());
  const auto removal = Remover(parts).plan();
  FilePieces out;
  if (!removal) {
    out.refer(bytes());
    return out;
  }
  return assemble(parts, removal->edits, kept_binary(parts, *removal));
}

FilePieces detail::without_attachment(const std::filesystem::path& file, std::string_view bytes) {
  FilePieces out;
  try {
    const Parts parts = split(file, bytes);
    if (const auto removal = Remover(parts).plan())
      return assemble(parts, removal->edits, kept_binary(parts, *removal));
  } catch (const Error&) {  // from an attachment that somebody has changed
  }
  out.refer(bytes);
  return out;
}

}  // namespace nif::mesh
