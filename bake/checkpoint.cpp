// The log that a bake keeps of its trainings, and its file format. A file is not trusted: its checksum and
// the key of the bake must be right before any state in it is used.
#include "bake/checkpoint.hpp"

#include "formats/nif/crc32c.hpp"

namespace nif::bake {
namespace {

[[noreturn]] void refuse_checkpoint(const std::string& why) { throw Error(Status::checkpoint_refused, why); }

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
