// An asset attached to a glTF: nothing else of the file changes, and taking it out gives the file from
// before.
#include "formats/mesh/gltf/attach.hpp"

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cstring>
#include <random>
#include <set>

#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Attachment;
using mesh::GltfFile;
using nlohmann::json;

constexpr const char* kName = "NIF_visibility";

std::span<const std::byte> as_bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

uint32_t word_at(std::string_view bytes, size_t at) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

std::string word(size_t value) {
  const auto narrow = static_cast<uint32_t>(value);
  return {reinterpret_cast<const char*>(&narrow), sizeof narrow};
}

/// The container with unchanged content.
std::string glb_of(const std::string& text, const std::optional<std::string>& binary,
                   const std::string& tail = "") {
  std::string chunks = word(text.size()) + "JSON" + text;
  if (binary) chunks += word(binary->size()) + std::string("BIN\0", 4) + *binary;
  return "glTF" + word(2) + word(12 + chunks.size() + tail.size()) + chunks + tail;
}

std::string_view json_of(std::string_view glb) { return glb.substr(20, word_at(glb, 12)); }
std::string_view binary_of(std::string_view glb) {
  const size_t at = 20 + word_at(glb, 12);
  return glb.substr(at + 8, word_at(glb, at));
}

/// A file must be read as the same scene, with the same hash, with and without an asset.
void expect_same_scene(const mesh::Scene& a, const mesh::Scene& b) {
  EXPECT_EQ(a.source_hash, b.source_hash);
  EXPECT_EQ(texts_of(a.notes), texts_of(b.notes));
  ASSERT_EQ(a.meshes.size(), b.meshes.size());
  for (size_t i = 0; i < a.meshes.size(); ++i) {
    EXPECT_EQ(a.meshes[i].positions, b.meshes[i].positions);
    EXPECT_EQ(a.meshes[i].triangles, b.meshes[i].triangles);
  }
  ASSERT_EQ(a.instances.size(), b.instances.size());
  for (size_t i = 0; i < a.instances.size(); ++i) {
    EXPECT_EQ(a.instances[i].name, b.instances[i].name);
    EXPECT_EQ(a.instances[i].transform, b.instances[i].transform);
    EXPECT_EQ(a.instances[i].node, b.instances[i].node);
  }
}

/// A schema of docs/schema, with the schemas that it refers to.
json schema_named(const std::string& name) {
  // glTF's own rules for every object and every index.
  if (name == "glTFProperty.schema.json") return json{{"type", "object"}};
  if (name == "glTFid.schema.json") return json{{"type", "integer"}, {"minimum", 0}};
  return json::parse(read_bytes(std::filesystem::path(NIF_SCHEMAS) / name));
}

/// JSON Schema, as far as those files use it. Any other keyword is an error, so that none is ignored.
bool satisfies(const json& value, const json& schema) {
  const auto all = [&](const json& schemas) {
    return std::ranges::all_of(schemas, [&](const json& one) { return satisfies(value, one); });
  };
  for (const auto& [word, rule] : schema.items()) {
    bool ok = true;
    if (word == "type") {
      ok = rule == "object"    ? value.is_object()
           : rule == "array"   ? value.is_array()
           : rule == "integer" ? value.is_number_integer()
                               : rule == "string" && value.is_string();
    } else if (word == "$ref") {
      ok = satisfies(value, schema_named(rule));
    } else if (word == "allOf") {
      ok = all(rule);
    } else if (word == "oneOf") {
      ok = std::ranges::count_if(rule, [&](const json& one) { return satisfies(value, one); }) == 1;
    } else if (word == "required") {
      ok = std::ranges::all_of(rule, [&](const json& name) { return value.contains(name); });
    } else if (word == "properties") {
      for (const auto& [name, inner] : rule.items())
        ok &= !value.contains(name) || satisfies(value[name], inner);
    } else if (word == "items") {
      const json& items = rule;  // clang 14 captures no structured binding
      ok = std::ranges::all_of(value, [&](const json& item) { return satisfies(item, items); });
    } else if (word == "minItems") {
      ok = value.size() >= rule;
    } else if (word == "minLength") {
      ok = value.get<std::string>().size() >= rule;
    } else if (word == "minimum") {
      ok = value >= rule;
    } else if (word == "const") {
      ok = value == rule;
    } else if (word != "title" && word != "description" && word != "$schema" && word != "$id") {
      ADD_FAILURE() << "the schema says " << word;
    }
    if (!ok) return false;
  }
  return true;
}

/// A reader written from docs/gltf-extension.md and its schemas alone.
void expect_valid(const json& root, size_t binary_bytes) {
  const json& used = root.at("extensionsUsed");
  EXPECT_EQ(std::count(used.begin(), used.end(), kName), 1);
  if (root.contains("extensionsRequired")) {
    const json& required = root["extensionsRequired"];
    EXPECT_EQ(std::count(required.begin(), required.end(), kName), 0);
  }
  const json& own = root.at("extensions").at(kName);
  ASSERT_TRUE(satisfies(own, schema_named("glTF.NIF_visibility.schema.json"))) << own;
  for (const json& asset : own["assets"]) {
    if (asset.contains("uri")) continue;
    const json& view = root.at("bufferViews").at(asset["bufferView"].get<size_t>());
    EXPECT_EQ(view.at("buffer"), 0);
    EXPECT_EQ(view.at("byteOffset").get<size_t>() % 64, 0u);
    EXPECT_FALSE(view.contains("byteStride") || view.contains("target"));
    const size_t end = view["byteOffset"].get<size_t>() + view.at("byteLength").get<size_t>();
    EXPECT_LE(end, root.at("buffers").at(0).at("byteLength").get<size_t>());
    EXPECT_LE(root["buffers"][0]["byteLength"].get<size_t>(), binary_bytes);
  }
  std::set<std::pair<size_t, size_t>> instances;
  for (const json& node : root.value("nodes", json::array())) {
    if (!node.contains("extensions") || !node["extensions"].contains(kName)) continue;
    const json& named = node["extensions"][kName];
    EXPECT_TRUE(node.contains("mesh"));
    EXPECT_TRUE(satisfies(named, schema_named("node.NIF_visibility.schema.json"))) << named;
    EXPECT_LT(named["asset"], own["assets"].size());
    EXPECT_TRUE(instances.emplace(named["asset"], named["instance"]).second) << "one node for each";
  }
}

TEST(GltfExtension, IsAsItsPageAndItsSchemasSay) {
  const std::string page = read_bytes(std::filesystem::path(NIF_SCHEMAS) / "../gltf-extension.md");
  const size_t begin = page.find("```json\n") + 8;
  expect_valid(json::parse(page.substr(begin, page.find("```", begin) - begin)), 14132);
  const json schema = schema_named("glTF.NIF_visibility.schema.json");
  const auto allowed = [&](const char* text) { return satisfies(json::parse(text), schema); };
  EXPECT_TRUE(allowed(R"({"assets":[{"uri":"a.nif","mimeType":"model/vnd.nifkit.nif"}],"extras":5})"));
  EXPECT_FALSE(allowed(R"({"assets":[]})"));
  EXPECT_FALSE(allowed("{}"));
  EXPECT_FALSE(allowed("[]"));
  EXPECT_FALSE(allowed(R"({"assets":[{"mimeType":"model/vnd.nifkit.nif"}]})"));
  EXPECT_FALSE(allowed(R"({"assets":[{"uri":"a.nif","bufferView":0,"mimeType":"model/vnd.nifkit.nif"}]})"));
  EXPECT_FALSE(allowed(R"({"assets":[{"bufferView":-1,"mimeType":"model/vnd.nifkit.nif"}]})"));
  EXPECT_FALSE(allowed(R"({"assets":[{"uri":"a.nif"}]})"));
}

class GltfAttach : public testing::Test {
 protected:
  GltfFile file(const std::string& name, std::string_view bytes) const {
    return GltfFile(folder_.write(name, bytes), uint64_t{1} << 30);
  }
  std::string with(const std::string& name, std::string_view bytes, const Attachment& attachment) const {
    return file(name, bytes).with(attachment).joined();
  }
  std::string without(const std::string& name, std::string_view bytes) const {
    return file(name, bytes).without().joined();
  }
  void refused(const std::string& name, std::string_view bytes, Status status,
               const std::string& fragment) const {
    SCOPED_TRACE(fragment);
    try {
      with(name, bytes, embedded_);
      ADD_FAILURE() << "attached to " << bytes.substr(0, 200);
    } catch (const Error& error) {
      const std::string sentence = error.what();
      EXPECT_EQ(error.status(), status) << sentence;
      EXPECT_NE(sentence.find(name), std::string::npos) << sentence;
      EXPECT_NE(sentence.find(fragment), std::string::npos) << sentence;
    }
  }

  const TempDir folder_;
  const std::string asset_ = "an asset of some length, not of four";
  const Attachment embedded_{as_bytes(asset_), "", {{0, 0}}};
  const Attachment referenced_{{}, "scene.nif", {{0, 0}}};
};

// Unusual spellings, order, white space, duplicates, extras and padding.
const std::string kOddText =
    "\n{ \"asset\" :{\"version\": \"2.0\" , "
    "\"extras\":{\"n\":1.50e+0,\"n\":-0.0,\"s\":\"\\u00e9\\/\xC3\xA9\"}},"
    "\r\n\t\"extensions\":{\"ACME_thing\":{\"deep\":[[[{}]]],\"NIF_visibility\":7}, \"ACME_other\" : null },"
    "\"extensionsUsed\" : [ \"ACME_thing\", \"ACME_other\" ], \"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],"
    "\"nodes\":[{\"mesh\":0 , \"name\":\"NIF_visibility\"}, {\"mesh\":0,\"extensions\":{ \"ACME_thing\":{} "
    "}}],"
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"
    "\"bufferViews\":[ {\"buffer\":0, \"byteLength\":36}\n ],\"buffers\":[{\"byteLength\":36 }] }";
const std::string kOddBinary =
    raw(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}) + std::string("\1\2\3\4", 4);

TEST_F(GltfAttach, LeavesEveryOtherByteOfAGlb) {
  const std::string padding("  \0\0\t", kOddText.size() % 4 ? 5 : 4), tail = word(8) + "ACMEeight by";
  const std::string before = glb_of(kOddText + padding, kOddBinary, tail) + "and what stands behind the end";
  Attachment attachment = embedded_;
  attachment.nodes = {{1, 0}, {0, 5}};
  const std::string after = with("odd.glb", before, attachment);

  // By hand, without the code that removes attachments.
  std::string text(json_of(after));
  const auto take = [&](const std::string& part) {
    const size_t at = text.find(part);
    ASSERT_NE(at, std::string::npos) << part;
    text.erase(at, part.size());
  };
  take(R"(,"NIF_visibility":{"asset":0,"instance":0})");
  take(R"(,"extensions":{"NIF_visibility":{"asset":0,"instance":5}})");
  const size_t name = text.find(R"("ACME_other","NIF_visibility" ])");
  ASSERT_NE(name, std::string::npos);
  text.erase(name + 12, 17);
  take(R"(,{"buffer":0,"byteOffset":64,"byteLength":36})");
  const std::string begin =
      R"(,"NIF_visibility":{"assets":[{"bufferView":1,"mimeType":"model/vnd.nifkit.nif"}],)"
      R"("extras":{"restore":{"byteLength":36,"chunkLength":40}})";
  const size_t spaces = text.find_first_not_of(' ', text.find(begin) + begin.size()) - text.find(begin);
  take(text.substr(text.find(begin), spaces + 1));
  const size_t length = text.find("\"byteLength\":100 ");
  ASSERT_NE(length, std::string::npos);
  text.replace(length + 13, 3, "36");
  EXPECT_EQ(text, kOddText + padding);

  const std::string_view binary = binary_of(after);
  EXPECT_EQ(binary, kOddBinary + std::string(24, '\0') + asset_);
  const size_t end = 28 + json_of(after).size() + binary.size();
  EXPECT_EQ(after.substr(end), tail + "and what stands behind the end");
  EXPECT_EQ(word_at(after, 8), end + tail.size());

  EXPECT_EQ(without("odd.glb", after), before);
  expect_same_scene(mesh::read(folder_.write("a.glb", before)), mesh::read(folder_.write("a.glb", after)));
}

TEST_F(GltfAttach, LeavesEveryOtherByteOfAGltf) {
  Gltf gltf = gltf_of(cube());
  gltf.json["extras"] = {{"NIF_visibility", "a word"}};
  for (const std::string mark : {"", "\xEF\xBB\xBF"}) {
    const std::string before = mark + gltf.embedded() + "\r\n";
    const std::string after = with("a.gltf", before, referenced_);
    EXPECT_EQ(without("a.gltf", after), before);
    EXPECT_EQ(with("a.gltf", after, referenced_), after);
    const json root = json::parse(after);
    expect_valid(root, 0);
    EXPECT_EQ(root["extensions"][kName], json::parse(R"({"assets":[{"uri":"scene.nif",
                                                        "mimeType":"model/vnd.nifkit.nif"}]})"));
    json rest = root;
    for (const char* name : {"extensions", "extensionsUsed"}) rest.erase(name);
    rest["nodes"][0].erase("extensions");
    EXPECT_EQ(rest, json::parse(before));
    EXPECT_FALSE(file("a.gltf", before).has_attachment());
    EXPECT_TRUE(file("a.gltf", after).has_attachment());
  }
}

/// Containers that are missing, empty, or hold something, in every combination.
TEST_F(GltfAttach, MakesAndRemovesContainers) {
  const auto member = [](const char* name, const char* value) {
    return value == nullptr ? std::string() : ",\"" + std::string(name) + "\":" + value;
  };
  size_t cases = 0;
  for (const char* used : std::vector<const char*>{nullptr, "[]", "[ ]", "[\"A\"]", "[\t\"A\" ]"})
    for (const char* extensions : std::vector<const char*>{nullptr, "{}", "{ }", "{\"A\":{}}"})
      for (const char* views : std::vector<const char*>{nullptr, "[]", "[{\"buffer\":0,\"byteLength\":4}]"})
        for (const char* buffers : std::vector<const char*>{nullptr, "[ ]", "[{\"byteLength\":4}]"})
          for (const char* node : {"{}", "{ \"extensions\":{}}", "{\"extensions\":{\"A\":[]},\"x\":1}"})
            for (const bool binary : {false, true}) {
              const bool filled = buffers != nullptr && buffers[1] == '{';
              if (filled && !binary) continue;
              const std::string text = "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[" + std::string(node) +
                                       "]" + member("extensionsUsed", used) + member("buffers", buffers) +
                                       member("bufferViews", views) + member("extensions", extensions) + "}";
              const std::string before =
                  glb_of(text, binary ? std::optional<std::string>("data") : std::nullopt);
              const std::string after = with("a.glb", before, embedded_);
              SCOPED_TRACE(text);
              ASSERT_EQ(without("a.glb", after), before);
              ASSERT_EQ(with("a.glb", after, embedded_), after);
              const json root = json::parse(json_of(after));
              EXPECT_EQ(root["extensionsUsed"].back(), kName);
              EXPECT_EQ(root["nodes"][0]["extensions"][kName]["instance"], 0);
              const json& view =
                  root["bufferViews"][root["extensions"][kName]["assets"][0]["bufferView"].get<size_t>()];
              EXPECT_EQ(
                  binary_of(after).substr(view["byteOffset"].get<size_t>(), view["byteLength"].get<size_t>()),
                  asset_);
              EXPECT_EQ(root["buffers"][0]["byteLength"],
                        view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>());
              ++cases;
            }
  EXPECT_EQ(cases, 5u * 4 * 3 * 3 * (2 + 2 + 1));
}

TEST_F(GltfAttach, EmbedsWhatCanBeUsedInPlace) {
  for (size_t vertices = 3; vertices < 12; ++vertices) {
    Gltf gltf;
    gltf.mesh(gltf.positions(std::vector<mesh::Float3>(vertices, {0, float(vertices), 1})), -1);
    gltf.scene({gltf.node({{"mesh", 0}, {"name", std::string(vertices, 'n')}})});
    gltf.json["accessors"][0]["count"] = 3;
    const std::string after = with("a.glb", gltf.glb(), embedded_);
    const json root = json::parse(json_of(after));
    expect_valid(root, binary_of(after).size());
    EXPECT_EQ(after.size() % 4, 0u);
    EXPECT_EQ(word_at(after, 8), after.size());
    const size_t at = after.find(asset_);
    EXPECT_EQ(at % 64, 0u) << "in the file";
    EXPECT_EQ((at - size_t(binary_of(after).data() - after.data())) % 64, 0u) << "in the chunk";
    EXPECT_EQ(without("a.glb", after), gltf.glb());
  }
}

TEST_F(GltfAttach, ReplacesWhatIsAttached) {
  Gltf gltf = gltf_of(cube());
  const std::string before = gltf.glb(), once = with("a.glb", before, embedded_);
  const std::string other = "another asset, and a longer one than that which is there";
  const Attachment longer{as_bytes(other), "", {{0, 3}}};
  EXPECT_EQ(with("a.glb", once, longer), with("a.glb", before, longer));
  EXPECT_EQ(with("a.glb", once, referenced_), with("a.glb", before, referenced_));
  EXPECT_EQ(with("a.glb", with("a.glb", once, referenced_), embedded_), once);
  EXPECT_EQ(without("a.glb", before), before) << "there is nothing to take out";
}

// Simulates a program that does not know the extension, and does only what glTF requires.
TEST_F(GltfAttach, IsIgnoredByAnotherReader) {
  const auto load = [](const std::string& glb) {
    tinygltf::TinyGLTF loader;
    tinygltf::Model model;
    std::string error, warning;
    EXPECT_TRUE(loader.LoadBinaryFromMemory(&model, &error, &warning,
                                            reinterpret_cast<const unsigned char*>(glb.data()),
                                            static_cast<unsigned>(glb.size())))
        << error;
    EXPECT_EQ(error + warning, "");
    return model;
  };
  const std::string before = gltf_of(torus(12, 8)).glb(), after = with("a.glb", before, embedded_);
  const tinygltf::Model a = load(before), b = load(after);
  EXPECT_TRUE(a.meshes == b.meshes && a.accessors == b.accessors && a.scenes == b.scenes);
  ASSERT_EQ(b.bufferViews.size(), a.bufferViews.size() + 1);
  for (size_t i = 0; i < a.bufferViews.size(); ++i) EXPECT_TRUE(a.bufferViews[i] == b.bufferViews[i]);
  ASSERT_EQ(b.buffers.size(), 1u);
  EXPECT_TRUE(std::equal(a.buffers[0].data.begin(), a.buffers[0].data.end(), b.buffers[0].data.begin()));
  EXPECT_EQ(b.extensionsUsed, std::vector<std::string>{kName});
  EXPECT_TRUE(b.nodes[0].extensions.contains(kName));
}

TEST_F(GltfAttach, NamesFilesThatStandBeside) {
  Gltf gltf = gltf_of(cube());
  gltf.json["images"] = {
      {{"uri", "a picture.png"}}, {{"bufferView", 0}}, {{"uri", "data:image/png;base64,"}}};
  EXPECT_EQ(file("a.gltf", gltf.gltf("a%20b.bin")).relative_uris(),
            (std::vector<std::string>{"a%20b.bin", "a picture.png"}));
  EXPECT_TRUE(file("a.glb", gltf_of(cube()).glb()).relative_uris().empty());
}

TEST_F(GltfAttach, Refuses) {
  refused("a.gltf", "", Status::file_empty, "empty");
  refused("a.glb", "o no\n", Status::not_a_mesh, "neither glTF nor GLB");
  refused("a.glb", gzip(gltf_of(cube()).glb()), Status::not_a_mesh, "neither");
  refused("a.gltf", gltf_of(cube()).embedded(), Status::usage, "no binary chunk");
  refused("a.glb", "glTF" + word(2) + word(100), Status::file_truncated, "100 bytes");
  const auto text = [](const std::string& more, const std::string& nodes = "[{}]") {
    return glb_of("{\"asset\":{\"version\":\"2.0\"},\"nodes\":" + nodes + more + "}", "data");
  };
  refused("a.glb", text(",\"extensions\":5"), Status::malformed_mesh, "extensions of the wrong type");
  refused("a.glb", text(",\"extensionsUsed\":{}"), Status::malformed_mesh,
          "extensionsUsed of the wrong type");
  refused("a.glb", text(",\"bufferViews\":\"\""), Status::malformed_mesh, "bufferViews of the wrong type");
  refused("a.glb", text(",\"buffers\":{\"byteLength\":4}"), Status::malformed_mesh, "");
  refused("a.glb", text("", "[{\"extensions\":[]}]"), Status::malformed_mesh, "node 0");
  refused("a.glb", text("", "[]"), Status::malformed_mesh, "no node 0");
  refused("a.glb", text(",\"buffers\":[{\"byteLength\":4,\"uri\":\"a.bin\"}]"), Status::usage, "--reference");
  refused("a.glb", glb_of("{\"nodes\":[{}],\"buffers\":[{\"byteLength\":4}]}", std::nullopt),
          Status::malformed_mesh, "without bytes");
  // Attachments that we did not write.
  const auto foreign = [&](const std::string& own) {
    return text(",\"extensionsUsed\":[\"NIF_visibility\"],\"extensions\":{\"NIF_visibility\":" + own + "}");
  };
  refused("a.glb", foreign("5"), Status::malformed_mesh, "does not list one asset");
  refused("a.glb", foreign("{\"assets\":[{},{}]}"), Status::malformed_mesh, "does not list one asset");
  refused("a.glb", foreign("{\"assets\":[{\"bufferView\":0}]}"), Status::malformed_mesh, "how long");
  refused("a.glb", foreign("{\"assets\":[{\"bufferView\":0}],\"extras\":{\"restore\":{}}}"),
          Status::malformed_mesh, "not the last one");
  refused("a.glb", text(",\"extensionsUsed\":[\"NIF_visibility\"]"), Status::malformed_mesh,
          "does not say what is attached");
  // Files that were edited afterwards.
  const std::string after = with("a.glb", gltf_of(cube()).glb(), embedded_);
  std::string longer(json_of(after));
  longer.insert(longer.find("],", longer.find("\"bufferViews\"")), ",{\"buffer\":0,\"byteLength\":1}");
  refused("a.glb", glb_of(longer, std::string(binary_of(after))), Status::malformed_mesh, "not the last one");
  refused("a.glb", glb_of(std::string(json_of(after)), std::string(binary_of(after)) + "more"),
          Status::malformed_mesh, "not the last ones");
  // That does not prevent reading the meshes.
  EXPECT_EQ(mesh::read(folder_.write("a.glb", glb_of(longer, std::string(binary_of(after))))).meshes.size(),
            1u);
}

TEST_F(GltfAttach, SurvivesDamage) {
  Gltf gltf = gltf_of(icosphere(0));
  gltf.json["extensionsUsed"] = {"ACME_thing"};
  const std::string whole = with("a.glb", gltf.glb(), embedded_);
  std::mt19937 random(5);
  size_t read = 0, taken_out = 0;
  for (int round = 0; round < 4000; ++round) {
    std::string damaged = whole;
    const size_t text = json_of(whole).size();
    for (int n = 0; n < 1 + round % 3; ++n)
      damaged[12 + random() % (text + 8)] = "{}[]\":,0123456789.ex \\\t\0"[random() % 24];
    try {
      mesh::read("a.glb", damaged);
    } catch (const Error&) {
      continue;  // there is no requirement for what is no glTF
    }
    ++read;
    const GltfFile file = this->file("a.glb", damaged);
    try {
      (void)file.without().joined();
      ++taken_out;
      const std::string again = file.with(embedded_).joined();
      EXPECT_TRUE(json::accept(json_of(again))) << json_of(damaged);
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(read, 100u);
  EXPECT_GT(taken_out, 50u);
}

}  // namespace
}  // namespace nif::test
