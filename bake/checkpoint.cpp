#include "bake/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bake/options.hpp"
#include "bake/spherical/describe.hpp"
#include "formats/nif/crc32c.hpp"

namespace nif::bake {
namespace {

constexpr std::array<char, 8> kCheckpointMagic{'N', 'I', 'F', 'B', 'A', 'K', 'E', '\n'};
/// To be raised where what a trainer keeps changes.
constexpr uint32_t kCheckpointVersion = 1;

[[noreturn]] void refuse_checkpoint(const std::string& why) { throw Error(Status::checkpoint_refused, why); }

template <class T>
std::string shown(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : "-";
}

uint32_t checksum_of(const mesh::Scene& scene) {
  uint32_t sum = 0;
  const auto add = [&](const auto& values) { sum = format::crc32c(std::as_bytes(std::span(values)), sum); };
  for (const mesh::Mesh& mesh : scene.meshes) {
    const std::array counts{mesh.positions.size(), mesh.triangles.size()};
    add(counts), add(mesh.positions), add(mesh.triangles);
  }
  for (const mesh::Instance& instance : scene.instances)
    add(std::array{instance.mesh}), add(instance.transform);
  return sum;
}

}  // namespace

void StateWriter::append(const void* from, size_t size) {
  if (size == 0) return;
  const size_t end = bytes_.size();
  bytes_.resize(end + size);
  std::memcpy(bytes_.data() + end, from, size);
}

void StateReader::refuse() { refuse_checkpoint("is damaged"); }

TrainingLog::TrainingLog(std::vector<KeptTraining> earlier, double seconds, Save save)
    : kept_(std::move(earlier)),
      pause_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))),
      next_(Clock::now() + pause_),
      save_(std::move(save)) {}

const KeptTraining* TrainingLog::begin(const std::string& object) {
  object_ = object;
  if (ended_ >= kept_.size()) return nullptr;
  if (kept_[ended_].object != object) refuse_checkpoint("has other objects than this bake");
  return &kept_[ended_];
}

void TrainingLog::keep(StateWriter&& state) {
  if (!save_) return;
  kept_.resize(ended_);
  kept_.push_back({object_, false, state.take()});
  save_(kept_);
  next_ = Clock::now() + pause_;
}

void TrainingLog::finish(StateWriter&& result) {
  if (save_) {
    kept_.resize(ended_);
    kept_.push_back({object_, true, result.take()});
  }
  ++ended_;
  if (due()) {
    save_(kept_);
    next_ = Clock::now() + pause_;
  }
}

BakeKey key_of(const mesh::Scene& scene, const BakeOptions& options, std::string_view inputs) {
  const SphericalBakeOptions& spherical = options.spherical;
  std::string text = fmt::format(
      "encoding {} preset {} seed {} strict {} uncoded {} source-triangles {} colors {} max-bytes {} "
      "max-error "
      "{} open-rays {} effort {} rays {} spoil {} scale {} resolution {}",
      options.encoding, name_of(options.preset), options.seed, options.strict, options.uncoded,
      options.source_triangles, options.colors, shown(options.max_bytes), shown(options.max_error),
      options.open_rays, shown(options.effort), options.evaluation_rays, options.spoil_at_step, options.scale,
      shown(options.resolution));
  if (options.lean) text += fmt::format(" lean {} {}", name_of(options.lean->mistake), options.lean->rate);
  if (options.mix)
    for (const double share : *options.mix) text += fmt::format(" mix {}", share);
  text += " spherical " + to_json(spherical).dump();
  if (spherical.given)
    text += fmt::format(" given {} {} {}", spherical.given->name, spherical.given->rounds,
                        bool(spherical.given->draw_primary));
  return {fmt::format("{} {}", NIF_VERSION_STRING, kCheckpointVersion),
          fmt::format("{:016x} {:08x}", scene.source_hash, checksum_of(scene)),
          fmt::format("{} {}", text, inputs)};
}

std::vector<std::byte> encode_checkpoint(const BakeKey& key, std::span<const KeptTraining> trainings) {
  StateWriter writer;
  writer.put(kCheckpointMagic);
  for (const std::string* text : {&key.program, &key.mesh, &key.options}) writer.put_all(*text);
  writer.put(uint64_t{trainings.size()});
  for (const KeptTraining& training : trainings) {
    writer.put_all(training.object);
    writer.put(uint8_t(training.finished));
    writer.put_all(training.state);
  }
  writer.put(format::crc32c(writer.bytes()));
  return writer.take();
}

std::vector<KeptTraining> decode_checkpoint(std::span<const std::byte> file, const BakeKey& key) {
  constexpr size_t kSum = sizeof(uint32_t);
  if (file.size() < kCheckpointMagic.size() + kSum ||
      std::memcmp(file.data(), kCheckpointMagic.data(), kCheckpointMagic.size()) != 0)
    refuse_checkpoint("is not a checkpoint");
  const std::span<const std::byte> body = file.first(file.size() - kSum);
  if (StateReader(file.last(kSum)).get<uint32_t>() != format::crc32c(body)) refuse_checkpoint("is damaged");
  StateReader reader(body.subspan(kCheckpointMagic.size()));
  BakeKey found;
  for (std::string* text : {&found.program, &found.mesh, &found.options}) reader.get_all(*text);
  if (found.program != key.program) refuse_checkpoint("was made by another version of the program");
  if (found.mesh != key.mesh) refuse_checkpoint("is of a bake of another mesh");
  if (found.options != key.options) refuse_checkpoint("is of a bake with other options");
  std::vector<KeptTraining> trainings;
  for (auto count = reader.get<uint64_t>(); count > 0; --count) {
    KeptTraining& training = trainings.emplace_back();
    reader.get_all(training.object);
    training.finished = reader.get<uint8_t>() != 0;
    reader.get_all(training.state);
  }
  reader.end();
  return trainings;
}

}  // namespace nif::bake
