// Makes the objects of one encoding: the interface between the steps of a bake (bake/steps.hpp), which know
// no encoding, and bake/encodings.
#pragma once

#include <atomic>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "bake/bake.hpp"
#include "bake/checkpoint.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "formats/nif/writer.hpp"

namespace nif::bake {

/// Bytes of the payloads of an object's parts, and of what they share.
inline uint64_t payload_bytes(const format::SectionBytes& sections) {
  uint64_t sum = 0;
  for (const auto& [type, bytes] : sections) sum += type == format::kData ? bytes : 0;
  return sum;
}

/// An object in one encoding, as far as it has been made.
struct Form {
  format::Asset alone;            ///< the object, with its networks, alone in an asset
  format::SectionBytes sections;  ///< what it adds to a file
  EncodingCost cost;
  double scale = 1;  ///< of its grids, as laid out
  AnyReport report;

  format::Object& object() { return alone.objects.front(); }
  const format::Object& object() const { return alone.objects.front(); }
  /// The kernels' view of it; valid while the form does not change.
  kernels::AnyField field() const { return format::field_of(alone, object()); }
};

/// An object to train.
struct Lesson {
  size_t object;  ///< its index
  const RaySource& source;
  Form& form;
  ObjectReport& report;
};

struct TrainingTask {
  std::span<const Lesson> lessons;
  std::span<const uint32_t> object_of;  ///< as PreparedScene::object_of
  /// Receives the fraction of the task that is done, and the loss and error of recent rays.
  std::function<void(double share, double loss, double error)> progress;
  const std::atomic<bool>& cancel;
  TrainingLog& log;  ///< each training starts and ends there, and stores its state from time to time
};

class Encoder {
 public:
  virtual ~Encoder() = default;

  /// The name in the format.
  virtual std::string_view name() const = 0;
  /// "a BVH"
  virtual std::string_view noun() const = 0;
  /// What it does at its smallest, for the sentence "with ... the asset takes too many bytes".
  virtual std::string_view smallest() const = 0;
  virtual AnswerKind kind() const { return AnswerKind::learned; }
  /// True if all objects are trained at once, because they share a network.
  virtual bool trains_together() const { return false; }

  /// Which objects it can have, by whether their triangles have holes.
  enum class Holes {
    none,  ///< those without
    any,   ///< both; with "auto" only those without
    only,  ///< those with holes
  };
  virtual Holes holes() const { return Holes::none; }
  /// Whether instances of its objects can bend.
  virtual bool bends() const { return false; }
  /// Why an object with these positions cannot have the encoding; empty if it can.
  virtual std::string obstacle(std::span<const mesh::Float3>) const { return {}; }
  /// True if objects can be laid out at this scale, which is not 1; a lower scale makes smaller ones.
  virtual bool has_scale(double) const { return false; }
  /// Makes the content of form.object(), of which everything else is set, at a scale of its
  /// grids; trained parts stay blank but have their final size. Sets the form's sections, its cost in bytes,
  /// its scale and its report. `bounded`: uses a lower scale if it would exceed the encoding's budget for
  /// such an object. `first`: the first object of the asset, which includes what all of them share.
  virtual void lay_out(const Prepared& prepared, double scale, bool bounded, bool first,
                       Form& form) const = 0;
  /// Counted work per ray. Only called if the encoding may be chosen automatically.
  virtual double work(const Form&, const RaySource&, uint64_t) const { return 0; }
  /// Removes from a form what saves no work, and says so; empty if everything saves work. Only called for
  /// forms that leave rays open.
  virtual std::string leave_out(const Prepared&, const RaySource&, uint64_t, Form&) const { return {}; }
  /// Trains the forms of the lessons together. Returns why that failed, as a sentence that names the object;
  /// empty on success. Throws Error(interrupted) once `cancel` is set.
  virtual std::string train(const TrainingTask&) { return {}; }
  /// Adds a finished form to the asset.
  virtual void add(Form&& form, format::Asset& asset) const = 0;
  /// Adds its options to those in the metadata.
  virtual void add_options(nlohmann::ordered_json&) const {}
};

/// The encodings that an object may have: the one that the options name and those that stand in for it, or
/// all that "auto" may choose; last, if some objects have holes and these cannot have it, the one for these. Throws
/// Error(usage) if there is none; InvalidOption.
using Encoders = std::vector<std::unique_ptr<Encoder>>;
Encoders encoders_for(const BakeOptions& options, bool any_holes);

}  // namespace nif::bake
