// Loading: from files read or mapped, from memory copied or borrowed, through the caller's allocator.
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>

#include "kernels/reference/scene_query.hpp"
#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/aligned.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;

#if defined(_WIN32)
constexpr const char* kNullDevice = "NUL";
#else
constexpr const char* kNullDevice = "/dev/null";
#endif

static_assert(NIF_ENCODING_SEGMENT == kernels::encoding_of_field<kernels::SegmentField>().number);
static_assert(NIF_ENCODING_SPHERICAL == kernels::encoding_of_field<kernels::SphericalField>().number);
static_assert(NIF_ENCODING_BVH == kernels::encoding_of_field<kernels::TrianglesField>().number);

/// A path as the library takes it on every system.
std::string utf8(const fs::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

class Assets : public RuntimeTest {
 protected:
  fs::path write(const std::string& name, std::string_view content) {
    return temporary_.write(name, content);
  }
  std::string_view text() const { return {reinterpret_cast<const char*>(file_.data()), file_.size()}; }
  NifError load_file(const fs::path& file, NifLoadMode mode) {
    const std::string path = utf8(file);
    NifAsset asset = nullptr;
    const NifError error = nifLoadAssetFile(device_, path.c_str(), mode, &asset);
    EXPECT_EQ(asset != nullptr, error == NIF_OK);
    if (error != NIF_OK) {
      EXPECT_NE(std::strstr(nifGetErrorMessage(), path.c_str()), nullptr) << nifGetErrorMessage();
    }
    if (asset) assets_.push_back(asset);
    return error;
  }

  const TempDir temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(Assets, SameAnswersHoweverLoaded) {
  const format::AssetView& view = make(1);
  const fs::path path = write("a.nif", text());
  ASSERT_EQ(load_file(path, NIF_LOAD_COPY), NIF_OK);
  ASSERT_EQ(load_file(path, NIF_LOAD_IN_PLACE), NIF_OK);
  load();
  const AlignedBytes aligned(file_.size());
  std::memcpy(aligned.get(), file_.data(), file_.size());
  NifAsset borrowed = nullptr;
  ASSERT_EQ(nifLoadAssetMemory(device_, aligned.get(), file_.size(), NIF_LOAD_IN_PLACE, &borrowed), NIF_OK);
  assets_.push_back(borrowed);
  std::vector<std::byte> shifted(file_.size() + 3);
  std::memcpy(shifted.data() + 3, file_.data(), file_.size());
  NifAsset copied = nullptr;
  ASSERT_EQ(nifLoadAssetMemory(device_, shifted.data() + 3, file_.size(), NIF_LOAD_COPY, &copied), NIF_OK);
  assets_.push_back(copied);

  Random random(1);
  for (uint32_t object = 0; object < view.objects.size(); ++object) {
    const auto rays = random_rays(random, view.objects[object].as<kernels::SegmentField>(), 500);
    std::vector<Answers> answers;
    for (const NifAsset asset : assets_) answers.push_back(query_all(scene_of(asset, object), rays));
    for (const Answers& other : answers) EXPECT_EQ(other, answers[0]);
  }
  for (const NifScene scene : scenes_) nifReleaseScene(scene);
  scenes_.clear();
  nifReleaseAsset(borrowed);
  assets_.erase(std::find(assets_.begin(), assets_.end(), borrowed));
}

/// The kernels keep copies of the asset's bytes: after the load the bytes may change, and scenes still know
/// where objects are and how their networks are calibrated.
TEST_F(Assets, AnswerAfterTheirBytesAreFreed) {
  auto device = nifkit::sized<NifDeviceInfo>();
  ASSERT_EQ(nifGetDeviceInfo(device_, &device), NIF_OK);
  if (std::string_view(device.isa) == "scalar") GTEST_SKIP() << "the scalar kernels keep the bytes";
  const format::AssetView& view = make(4, {.objects = 3, .instances = 0, .features = 2});
  const AlignedBytes borrowed(file_.size());
  std::memcpy(borrowed.get(), file_.data(), file_.size());
  NifAsset asset = nullptr;
  ASSERT_EQ(nifLoadAssetMemory(device_, borrowed.get(), file_.size(), NIF_LOAD_IN_PLACE, &asset), NIF_OK);
  assets_.push_back(asset);
  std::memset(borrowed.get(), 0xff, file_.size());

  Random random(4);
  uint64_t unsure = 0;
  for (uint32_t object = 0; object < 3; ++object) {
    const kernels::SegmentField& field = view.objects[object].as<kernels::SegmentField>();
    const NifScene scene = scene_of(asset, object);
    auto info = nifkit::sized<NifSceneInfo>();
    ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
    const kernels::ObjectBox box = kernels::object_box(field);
    for (size_t a = 0; a < 3; ++a) {
      EXPECT_FLOAT_EQ(info.bounds_min[a], static_cast<float>(box.low[a]));
      EXPECT_FLOAT_EQ(info.bounds_max[a], static_cast<float>(box.high[a]));
    }
    const auto rays = random_rays(random, field, 8000);
    const Answers answers = query_all(scene, rays);
    for (size_t i = 0; i < rays.size(); ++i) {
      const kernels::Answer expected = kernels::query(field, to_segment(rays[i]));
      ASSERT_EQ(answers.logit[i], expected.logit);
      ASSERT_EQ(answers.certain[i], expected.certain);
      ASSERT_EQ(answers.probability[i],
                kernels::visible_probability(expected.logit, field.network.calibration));
      unsure += answers.probability[i] > 0.001f && answers.probability[i] < 0.999f;
    }
  }
  EXPECT_GT(unsure, 100u);
}

/// With one feature per corner the asset's bytes stay; with two the kernels copy what they need, and the
/// bytes are freed.
class AssetInformation : public Assets, public testing::WithParamInterface<uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Features, AssetInformation, testing::Values(1u, 2u));

TEST_P(AssetInformation, IsThatOfTheFile) {
  const RandomAssetOptions options{.features = GetParam()};
  const format::Asset source = random_asset(2, options);
  make(2, options);
  const NifAsset asset = load();
  std::fill(file_.begin(), file_.end(), std::byte{0});
  auto info = nifkit::sized<NifAssetInfo>();
  ASSERT_EQ(nifGetAssetInfo(asset, &info), NIF_OK);
  EXPECT_EQ(info.object_count, source.objects.size());
  EXPECT_EQ(info.instance_count, source.instances.size());
  EXPECT_EQ(info.network_count, source.mlps.size());
  EXPECT_EQ(info.format_version, 2u);
  EXPECT_EQ(info.file_bytes, file_.size());
  auto device = nifkit::sized<NifDeviceInfo>();
  ASSERT_EQ(nifGetDeviceInfo(device_, &device), NIF_OK);
  const bool keeps_bytes = GetParam() != 2 || std::string_view(device.isa) == "scalar";
  EXPECT_GE(info.resident_bytes, keeps_bytes ? file_.size() : source.metadata.size());
  // Kernels keep a word for each voxel, and the parts.
  size_t words = 0;
  for (const format::Object& object : source.objects) {
    const format::PlanesData& data = *object.planes;
    words += size_t(data.voxels[0]) * data.voxels[1] * data.voxels[2] + data.children.size();
  }
  EXPECT_LT(info.resident_bytes, file_.size() + 4 * words + 8192);
  EXPECT_EQ(std::string_view(info.metadata, info.metadata_bytes), source.metadata);
  for (uint32_t i = 0; i < info.object_count; ++i) {
    auto object = nifkit::sized<NifObjectInfo>();
    ASSERT_EQ(nifGetObjectInfo(asset, i, &object), NIF_OK);
    EXPECT_EQ(object.name, source.objects[i].name);
    EXPECT_EQ(object.encoding, NIF_ENCODING_SEGMENT);
    EXPECT_EQ(object.bias, source.objects[i].bias);
    EXPECT_EQ(object.triangles, source.objects[i].triangle_count);
    for (size_t a = 0; a < 3; ++a) {
      EXPECT_EQ(object.bounds_min[a], source.objects[i].aabb_min[a]);
      EXPECT_EQ(object.bounds_max[a], source.objects[i].aabb_max[a]);
    }
  }
  for (uint32_t i = 0; i < info.instance_count; ++i) {
    auto instance = nifkit::sized<NifAssetInstanceInfo>();
    ASSERT_EQ(nifGetAssetInstanceInfo(asset, i, &instance), NIF_OK);
    EXPECT_EQ(instance.name, source.instances[i].name);
    EXPECT_EQ(instance.object, source.instances[i].object);
    EXPECT_TRUE(std::equal(source.instances[i].transform.begin(), source.instances[i].transform.end(),
                           instance.transform));
  }
  auto object = nifkit::sized<NifObjectInfo>();
  EXPECT_EQ(nifGetObjectInfo(asset, info.object_count, &object), NIF_ERROR_INVALID_ARGUMENT);
}

/// For an asset with all parts: the bytes of the parts add up exactly, in the file and in memory.
TEST_P(AssetInformation, HasPartsThatAddUp) {
  for (const uint32_t coded : {0u, kCodedAll})
    for (const char* isa : {"isa=auto", "isa=auto,memory=least", "isa=scalar"}) {
      SCOPED_TRACE(std::string(isa) + (coded ? ", coded" : ""));
      RandomAssetOptions options{.bvhs = 1,
                                 .sphericals = 1,
                                 .exacts = 1,
                                 .proofs = 1,
                                 .cutouts = 1,
                                 .primaries = 1,
                                 .features = GetParam(),
                                 .colors = 1,
                                 .skins = 1,
                                 .sources = 1};
      options.numbers = true;
      options.coded = coded;
      const format::AssetView& view = make(5, options);
      const nifkit::Device device(isa);
      const nifkit::Asset asset = nifkit::Asset::load(device, file_);
      const std::vector<NifPartInfo> parts = asset.parts();
      const NifAssetInfo info = asset.info();
      uint64_t in_file = 0, resident = 0;
      std::map<std::string, NifPartInfo> by_name;
      for (const NifPartInfo& part : parts) {
        in_file += part.file_bytes;
        resident += part.resident_bytes;
        EXPECT_TRUE(by_name.emplace(part.name, part).second) << part.name;
      }
      EXPECT_EQ(in_file, file_.size());
      EXPECT_EQ(in_file, info.file_bytes);
      EXPECT_EQ(resident, info.resident_bytes);
      for (const format::PartBytes& part : format::bytes_by_part(view)) {
        EXPECT_EQ(by_name.at(part.name).file_bytes, part.bytes) << part.name;
        EXPECT_GT(part.bytes, 0u) << part.name;
        const bool may_be_coded =
            std::string_view("occupancy planes features").find(part.name) != std::string_view::npos;
        EXPECT_EQ(part.decoded > part.bytes,
                  part.name == std::string_view("alpha_maps") || (coded && may_be_coded))
            << part.name;
        // Encodings other than `segment` read the file, so all of it stays.
        EXPECT_GE(by_name.at(part.name).resident_bytes, part.bytes + part.decoded) << part.name;
      }
      EXPECT_EQ(by_name.at("metadata").file_bytes, info.metadata_bytes);
      EXPECT_EQ(by_name.at("traversal_words").resident_bytes > 0,
                std::string_view(device.info().isa) != "scalar");
      EXPECT_EQ(by_name.at("decoded_triangles").resident_bytes > 0, std::string_view(isa) == "isa=auto");
      auto none = nifkit::sized<NifPartInfo>();
      EXPECT_EQ(nifGetPartInfo(asset.get(), uint32_t(parts.size()), &none), NIF_ERROR_INVALID_ARGUMENT);
    }
}

/// Bytes of decoded triangles, of so many objects with so many triangles each.
uint64_t decoded_bytes(uint32_t objects, uint32_t triangles) {
  Random random(1);
  format::Asset made;
  const format::TrianglesData bvh = random_bvh(random, triangles);
  for (uint32_t i = 0; i < objects; ++i) {
    made.objects.push_back(object_of(bvh, "object " + std::to_string(i)));
    made.objects.back().triangles = bvh;
  }
  const auto file = format::encode(made);
  const nifkit::Device device("isa=auto");
  const nifkit::Asset asset = nifkit::Asset::load(device, file);
  for (const NifPartInfo& part : asset.parts())
    if (std::string_view(part.name) == "decoded_triangles") return part.resident_bytes;
  return 0;
}

TEST(DecodedTriangles, OfAnAssetFitIntoTheCacheTogetherOrThereAreNone) {
  if (std::string_view(nifkit::Device("isa=auto").info().isa) == "scalar")
    GTEST_SKIP() << "it decodes nothing";
  EXPECT_GT(decoded_bytes(1, 50'000), 0u);
  EXPECT_GT(decoded_bytes(4, 50'000), 3 * decoded_bytes(1, 50'000));
  EXPECT_EQ(decoded_bytes(5, 50'000), 0u);
}

TEST_F(Assets, CodedAndUncodedAnswerAlike) {
  RandomAssetOptions options;
  options.coded = kCodedAll;
  for (uint64_t seed = 1; seed < 5; ++seed) {
    format::Asset source = random_asset(seed, options);
    std::vector<Answers> answers;
    uint64_t sizes[2] = {};
    for (const uint32_t coded : {0u, kCodedAll}) {
      for (format::Object& object : source.objects) set_coded(coded, object);
      file_ = format::encode(source);
      sizes[coded != 0] = file_.size();
      // A new name each time, because Windows cannot overwrite a mapped file.
      const fs::path path = write(std::to_string(seed) + (coded ? "-coded.nif" : ".nif"), text());
      for (const NifLoadMode mode : {NIF_LOAD_COPY, NIF_LOAD_IN_PLACE}) {
        ASSERT_EQ(load_file(path, mode), NIF_OK);
        const NifScene scene = new_scene();
        ASSERT_EQ(nifAddAsset(scene, assets_.back(), nullptr, nullptr, nullptr), NIF_OK);
        ASSERT_EQ(nifCommitScene(scene), NIF_OK);
        Random random(seed);
        const kernels::SegmentField field = format::field_of(source.objects[0], source.mlps[0]);
        answers.push_back(query_all(scene, random_rays(random, field, 500)));
      }
    }
    EXPECT_LT(sizes[1], sizes[0]);
    for (const Answers& one : answers) EXPECT_EQ(one, answers.front());
  }
}

TEST_F(Assets, BadFilesEachHaveTheirCode) {
  make(3);
  for (const NifLoadMode mode : {NIF_LOAD_COPY, NIF_LOAD_IN_PLACE}) {
    EXPECT_EQ(load_file(folder_ / "missing.nif", mode), NIF_ERROR_FILE_NOT_FOUND);
    EXPECT_EQ(load_file(folder_ / "missing" / "a.nif", mode), NIF_ERROR_FILE_NOT_FOUND);
    EXPECT_EQ(load_file(folder_, mode), NIF_ERROR_FILE_UNREADABLE);
    EXPECT_EQ(load_file(kNullDevice, mode), NIF_ERROR_FILE_UNREADABLE);
    EXPECT_EQ(load_file(write("empty.nif", ""), mode), NIF_ERROR_FILE_EMPTY);
    EXPECT_EQ(load_file(write("text.nif", "v 0 0 0\n"), mode), NIF_ERROR_NOT_A_NIF);
    EXPECT_EQ(load_file(write("game.nif", "Gamebryo File Format, Version 20.0.0.5\n"), mode),
              NIF_ERROR_FOREIGN_NIF);
    EXPECT_NE(std::strstr(nifGetErrorMessage(), "Gamebryo"), nullptr);
    EXPECT_EQ(load_file(write("short.nif", text().substr(0, file_.size() - 1)), mode),
              NIF_ERROR_FILE_TRUNCATED);
    EXPECT_EQ(load_file(write("start.nif", text().substr(0, 30)), mode), NIF_ERROR_FILE_TRUNCATED);
    std::string changed(text());
    changed[changed.size() / 2] = char(changed[changed.size() / 2] ^ 1);
    EXPECT_EQ(load_file(write("changed.nif", changed), mode), NIF_ERROR_DAMAGED_NIF);
  }
}

/// Paths are UTF-8, whatever the system's own encoding.
TEST_F(Assets, NamesInAnyScript) {
  make(6);
  for (const char8_t* name : {u8"dragón.nif", u8"дракон.nif", u8"龍.nif", u8"\U0001F409.nif"})
    for (const NifLoadMode mode : {NIF_LOAD_COPY, NIF_LOAD_IN_PLACE}) {
      const fs::path file = folder_ / name;
      fs::remove(file);
      EXPECT_EQ(load_file(file, mode), NIF_ERROR_FILE_NOT_FOUND);
      std::ofstream(file, std::ios::binary).write(text().data(), std::streamsize(text().size()));
      EXPECT_EQ(load_file(file, mode), NIF_OK) << nifGetErrorMessage();
    }
}

TEST_F(Assets, BadMemory) {
  make(4);
  NifAsset asset = nullptr;
  const auto load_bytes = [&](const void* bytes, uint64_t size, NifLoadMode mode) {
    return nifLoadAssetMemory(device_, bytes, size, mode, &asset);
  };
  for (const NifLoadMode mode : {NIF_LOAD_COPY, NIF_LOAD_IN_PLACE}) {
    EXPECT_EQ(load_bytes(nullptr, 0, mode), NIF_ERROR_FILE_EMPTY);
    EXPECT_STREQ(nifGetErrorMessage(), "memory: the file is empty");
    EXPECT_EQ(load_bytes(nullptr, 10, mode), NIF_ERROR_INVALID_ARGUMENT);
  }
  EXPECT_EQ(load_bytes(file_.data(), file_.size() - 1, NIF_LOAD_COPY), NIF_ERROR_FILE_TRUNCATED);
  std::vector<std::byte> padded(file_.size() + 128);
  auto* at = reinterpret_cast<std::byte*>((reinterpret_cast<uintptr_t>(padded.data()) + 63) / 64 * 64 + 8);
  std::memcpy(at, file_.data(), file_.size());
  EXPECT_EQ(load_bytes(at, file_.size(), NIF_LOAD_IN_PLACE), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(asset, nullptr);
}

/// An allocator that counts its calls, and fails after a given number.
struct Counter {
  std::map<void*, std::pair<uint64_t, uint64_t>> blocks;
  int64_t left = -1;  ///< allocations until it fails; negative: never
  uint64_t calls = 0;

  NifDeviceCallbacks callbacks() {
    auto result = nifkit::sized<NifDeviceCallbacks>();
    result.user = this;
    result.allocate = [](void* user, uint64_t bytes, uint64_t alignment) -> void* {
      auto& self = *static_cast<Counter*>(user);
      ++self.calls;
      if (self.left == 0) return nullptr;
      --self.left;
      EXPECT_GT(bytes, 0u);
      void* memory = allocate_aligned(alignment, bytes);
      self.blocks[memory] = {bytes, alignment};
      return memory;
    };
    result.deallocate = [](void* user, void* memory, uint64_t bytes, uint64_t alignment) {
      auto& self = *static_cast<Counter*>(user);
      EXPECT_EQ(self.blocks[memory], std::make_pair(bytes, alignment));
      self.blocks.erase(memory);
      free_aligned(alignment, memory);
    };
    return result;
  }
};

TEST_F(Assets, EverythingGoesThroughTheAllocator) {
  const format::AssetView& view = make(5);
  const std::string path = utf8(write("a.nif", text()));
  for (int64_t allowed = 0;; ++allowed) {
    Counter counter;
    counter.left = allowed;
    const NifDeviceCallbacks callbacks = counter.callbacks();
    NifDevice device = nullptr;
    NifAsset asset = nullptr, mapped = nullptr;
    NifScene scene = nullptr;
    NifError error = nifNewDevice("", &callbacks, &device);
    if (error == NIF_OK) error = nifLoadAssetFile(device, path.c_str(), NIF_LOAD_COPY, &asset);
    if (error == NIF_OK) error = nifLoadAssetFile(device, path.c_str(), NIF_LOAD_IN_PLACE, &mapped);
    if (error == NIF_OK) error = nifNewScene(device, &scene);
    if (error == NIF_OK) error = nifAddAsset(scene, asset, nullptr, nullptr, nullptr);
    if (error == NIF_OK) error = nifAddInstance(scene, mapped, 1, nullptr, nullptr);
    if (error == NIF_OK) error = nifCommitScene(scene);
    if (error == NIF_OK) {
      const uint64_t before = counter.calls;
      Random random(5);
      query_all(scene, random_rays(random, view.objects[0].as<kernels::SegmentField>(), 100));
      EXPECT_EQ(counter.calls, before) << "a query allocated";
      auto info = nifkit::sized<NifSceneInfo>();
      EXPECT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
      EXPECT_EQ(info.instance_count, view.instances.size() + 1);
    } else {
      EXPECT_EQ(error, NIF_ERROR_OUT_OF_MEMORY) << nifGetErrorMessage();
    }
    // In an order in which every object must be kept alive by another.
    nifReleaseDevice(device);
    nifReleaseAsset(asset);
    nifReleaseAsset(mapped);
    nifReleaseScene(scene);
    EXPECT_TRUE(counter.blocks.empty());
    if (error == NIF_OK) {
      EXPECT_GT(allowed, 8);
      break;
    }
  }
}

/// A file in the caller's archive.
struct Archive {
  std::vector<std::byte> bytes;
  uint64_t next = 0, fail_at = ~uint64_t{0}, calls = 0;
  uint32_t failure = 0;  ///< what a failed read returns

  NifReader reader() {
    auto reader = nifkit::sized<NifReader>();
    reader.user = this;
    reader.name = "rock.pak";
    reader.size = bytes.size();
    reader.read = [](void* user, uint64_t offset, void* to, uint64_t size) -> uint32_t {
      auto& self = *static_cast<Archive*>(user);
      EXPECT_EQ(offset, self.next) << "offsets ascend without gaps";
      EXPECT_LE(offset + size, self.bytes.size());
      ++self.calls;
      if (offset + size > self.fail_at) return self.failure;
      self.next = offset + size;
      std::memcpy(to, self.bytes.data() + offset, size);
      return 1;
    };
    return reader;
  }
};

TEST_F(RuntimeTest, ReadersLoadWhatMemoryDoes) {
  make(3);
  Archive archive{file_};
  NifAsset asset = nullptr;
  NifReader reader = archive.reader();
  ASSERT_EQ(nifLoadAssetReader(device_, &reader, &asset), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(archive.next, file_.size());
  assets_.push_back(asset);
  const auto rays = std::vector<NifRay>(50, NifRay{{-3, 0.1f, 0.2f}, 0, {1, 0, 0}, 9});
  EXPECT_EQ(query_all(scene_of(asset, 0), rays), query_all(scene_of(load(), 0), rays));

  NifAsset none = nullptr;
  const auto refused = [&](Archive& from, const NifReader& by, NifError error, const char* because) {
    from.next = 0;
    EXPECT_EQ(nifLoadAssetReader(device_, &by, &none), error);
    EXPECT_NE(std::string(nifGetErrorMessage()).find(because), std::string::npos) << nifGetErrorMessage();
  };
  for (const uint64_t fail_at : {uint64_t{0}, uint64_t{63}, uint64_t{64}, uint64_t(file_.size() - 1)}) {
    archive.fail_at = fail_at;
    for (const uint32_t returned : {0u, 64u, uint32_t(-1)}) {  // like fread() or read()
      archive.failure = returned;
      refused(archive, reader, NIF_ERROR_FILE_UNREADABLE, "rock.pak: the caller's read function failed");
    }
  }
  archive.fail_at = ~uint64_t{0};
  // A wrong size is refused by the header, before memory is allocated.
  Archive longer{file_};
  longer.bytes.resize(file_.size() + 1);
  NifReader by = longer.reader();
  by.size = uint64_t{1} << 60;
  refused(longer, by, NIF_ERROR_DAMAGED_NIF, "rock.pak");
  Archive shorter{std::vector<std::byte>(file_.begin(), file_.begin() + 100)};
  refused(shorter, shorter.reader(), NIF_ERROR_FILE_TRUNCATED, "rock.pak");
  Archive empty{{}};
  refused(empty, empty.reader(), NIF_ERROR_FILE_EMPTY, "rock.pak");
  by = archive.reader();
  by.read = nullptr;
  refused(archive, by, NIF_ERROR_INVALID_ARGUMENT, "read is null");
  EXPECT_EQ(none, nullptr);
}

TEST_F(RuntimeTest, TheLogSaysWhatWasDone) {
  make(3);
  std::vector<std::string> lines;
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  callbacks.user = &lines;
  callbacks.log = [](void* user, uint32_t level, const char* message) {
    EXPECT_EQ(level, uint32_t(NIF_LOG_INFO));
    static_cast<std::vector<std::string>*>(user)->emplace_back(message);
  };
  NifDevice device = nullptr;
  NifAsset asset = nullptr;
  ASSERT_EQ(nifNewDevice("threads=2,isa=scalar", &callbacks, &device), NIF_OK);
  ASSERT_EQ(nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &asset), NIF_OK);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0], "device: CPU, 2 threads, isa=scalar");
  EXPECT_EQ(lines[1], "memory: loaded, 3 objects, " + std::to_string(file_.size()) + " bytes");
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
}

}  // namespace
}  // namespace nif::test
