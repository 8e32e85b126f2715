// An object in the making: the forms in which it may be written, and which of them is chosen. Whatever
// changes a form also counts its bytes, so that the size of the file is known at any time.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "bake/encoder.hpp"

namespace nif::bake {

/// What bake() was asked for.
struct BakeRequest {
  const mesh::Scene& scene;
  const BakeOptions& options;
  const BakeCallback& callback;
  const std::atomic<bool>& cancel;
  TrainingLog& log;
  const Encoders encoders = encoders_for(
      options, std::ranges::any_of(scene.meshes, [](const mesh::Mesh& mesh) { return !mesh.holes.empty(); }));
};

/// Encodings are numbered as in BakeRequest::encoders. The first one that suits the object is chosen until
/// another one is; a form may be laid out before or after it is chosen.
class Candidate {
 public:
  /// Everything must outlive it. Fills the report as far as is known, and keeps in `size` what the chosen
  /// form adds to the file. Throws Error(too_large) if no encoding suits the object.
  Candidate(size_t index, const Prepared& prepared, const BakeRequest& request, ObjectReport& report,
            format::FileSize& size);

  const size_t index;  ///< among the objects of the asset
  const Prepared& prepared;
  ObjectReport& report;

  bool suits(size_t encoding) const { return suits_[encoding]; }
  /// Lays out its form in an encoding, in place of an earlier one; `scale` and `bounded` as for the encoder.
  void lay_out(size_t encoding, double scale, bool bounded = true);
  /// Lays out all exact forms that take at most `most` memory, coarser than their preset if needed, and
  /// chooses the smallest. Planes are only for objects that are large enough for them, or of any size or
  /// none if there is a preference. Returns false, and chooses nothing, if none fits.
  bool lay_out_exact(uint64_t most);

  void choose(size_t encoding);
  size_t chosen() const { return chosen_; }
  Encoder& encoder() const { return *request_.encoders[chosen_]; }
  AnswerKind kind() const { return encoder().kind(); }

  /// The chosen form. Training fills it, which does not change its size.
  Form& form() { return *forms_[chosen_]; }
  const Form& form() const { return *forms_[chosen_]; }
  /// To train the chosen form.
  Lesson lesson(const RaySource& source) { return {index, source, form(), report}; }
  /// Replaces the chosen form.
  void replace(Form&& form);
  /// The form in any encoding; it must be laid out.
  const Form& form_in(size_t encoding) const { return *forms_[encoding]; }
  /// Counts the work per ray of that form, which its report keeps.
  double count_work(size_t encoding, const RaySource& source);

  /// The encodings of the exact forms that are laid out, and the one whose form takes the fewest bytes.
  std::vector<size_t> exact_forms() const;
  std::optional<size_t> smallest_exact() const;

  /// Completes the report, and frees the forms that are not chosen.
  void finish();

 private:
  void count();

  const BakeRequest& request_;
  format::FileSize& size_;
  format::Object described_;  ///< what is the same in any encoding
  std::vector<bool> suits_;
  std::vector<std::optional<Form>> forms_;
  size_t chosen_ = 0;
};

}  // namespace nif::bake
