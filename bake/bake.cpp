// The driver of a bake. It knows objects, sizes, rays and limits, and of encodings what bake/encoder.hpp
// says.
#include "bake/bake.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "bake/encoder.hpp"
#include "bake/oracle/prepare.hpp"
#include "bake/report.hpp"
#include "bake/steps.hpp"
#include "formats/base/quantities.hpp"

namespace nif::bake {
namespace {

using Encoders = std::vector<std::unique_ptr<Encoder>>;

template <class Baking>
void add_encoder(const BakeOptions& options, Encoders& encoders) {
  const bool wanted = options.encoding == kAutomatic
                          ? Baking::kAutomatic
                          : options.encoding == format::EncodingOfContent<typename Baking::Data>::kName ||
                                (options.encoding == Baking::kStandsInFor && !options.resolution);
  if (wanted) encoders.push_back(Baking::make(options));
}
template <class... Baking>
struct EncodersOf {
  static Encoders make(const BakeOptions& options) {
    Encoders encoders;
    (add_encoder<Baking>(options, encoders), ...);
    return encoders;
  }
};

/// Those that an object may take: one that is named, with what stands in for it, or all of which the better
/// one is chosen.
Encoders encoders_for(const BakeOptions& options) {
  Encoders encoders = OfEncoders<EncodersOf>::make(options);
  if (encoders.empty())
    throw Error(Status::usage, fmt::format("no encoding is called '{}'", options.encoding));
  return encoders;
}

/// An object on its way.
struct Candidate {
  std::vector<std::optional<Form>> forms;  ///< [encoder]; none where it cannot have the encoding
  size_t taken = 0;                        ///< index of its form, as far as it is known

  Form& form() { return *forms[taken]; }
  bool has_choice() const {
    return std::count_if(forms.begin(), forms.end(), [](const auto& form) { return form.has_value(); }) > 1;
  }
};

class Driver {
 public:
  Driver(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
         const std::atomic<bool>& cancel)
      : scene_(scene),
        options_(options),
        encoders_(encoders_for(options)),
        callback_(callback),
        cancel_(cancel) {}

  BakeResult run() {
    prepare_objects();
    for (size_t e = 0; e < encoders_.size(); ++e) lay_out(e, 1);
    choose_by_bytes();
    if (options_.max_bytes) shrink_to(*options_.max_bytes);
    const size_t together = encoders_.front()->trains_together() ? candidates_.size() : 1;
    for (size_t i = 0; i < candidates_.size(); i += together) bake_objects(i, together);
    for (const ObjectReport& report : result_.objects) {
      result_.triangles += report.triangles;
      for (RaySet set : kRaySets) result_.sets[size_t(set)] += report.sets[size_t(set)];
    }
    check_error(options_, result_.sets);
    for (Candidate& candidate : candidates_)
      encoders_[candidate.taken]->add(std::move(candidate.form()), result_.asset);
    result_.asset.metadata = make_metadata(scene_, options_, encoders_, result_);
    return std::move(result_);
  }

 private:
  void prepare_objects() {
    if (callback_) callback_({BakeProgress::Stage::preparing, scene_.meshes.front().name, 0, 1, 0, 0, 0});
    prepared_ = prepare(scene_, options_.strict);
    result_.notes = std::move(prepared_.notes);
    result_.asset.instances = instances_of(scene_, prepared_);
    result_.placed = prepared_.instances;
    size_.add(format::section_bytes(result_.asset));
    const size_t count = prepared_.objects.size();
    clock_.emplace(prepared_.objects, callback_);
    result_.objects.resize(count);
    candidates_.resize(count);
    reserve_ = kMetadataBytes + kMetadataBytesPerObject * count + hierarchy_bytes(scene_, result_);
    if (options_.lean) reserve_ += kMetadataBytesOfLean * count;
    for (size_t i = 0; i < count; ++i) add_forms(i);
  }

  /// A form for each encoding that the object can have.
  void add_forms(size_t index) {
    const Prepared& prepared = prepared_.objects[index];
    const format::Object object = describe(prepared, result_.objects[index]);
    std::string obstacle;
    for (const auto& encoder : encoders_) {
      std::optional<Form>& form = candidates_[index].forms.emplace_back();
      const std::string why = encoder->obstacle(prepared.surface.positions);
      if (why.empty())
        form.emplace().alone.objects = {object};
      else
        obstacle = why;
    }
    Candidate& candidate = candidates_[index];
    while (candidate.taken < candidate.forms.size() && !candidate.forms[candidate.taken]) ++candidate.taken;
    if (candidate.taken == candidate.forms.size())
      throw Error(Status::too_large, fmt::format("'{}': {}", object.name, obstacle));
    result_.objects[index].reason =
        obstacle.empty() && options_.encoding != kAutomatic ? "as requested" : obstacle;
  }

  void lay_out(size_t encoder, double scale) {
    for (size_t i = 0; i < candidates_.size(); ++i) {
      stop_if(cancel_);
      std::optional<Form>& form = candidates_[i].forms[encoder];
      if (!form) continue;
      const bool counted = candidates_[i].taken == encoder;
      if (counted) size_.remove(form->sections);
      encoders_[encoder]->lay_out(prepared_.objects[i], scale, true, i == 0, *form);
      if (counted) size_.add(form->sections);
    }
  }

  /// The form of the fewest bytes; an exact one that takes no more than any other needs no further
  /// comparison.
  void choose_by_bytes() {
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Candidate& candidate = candidates_[i];
      if (!candidate.has_choice()) continue;
      const size_t exact = exact_form(candidate), learned = learned_form(candidate);
      if (learned == candidate.forms.size()) continue;
      const uint64_t bytes = candidate.forms[exact]->cost.bytes,
                     others = candidate.forms[learned]->cost.bytes;
      take(candidate, bytes <= others ? exact : learned);
      result_.objects[i].reason =
          bytes <= others
              ? fmt::format("exact, and with {} no larger than {} with {}", format_bytes(double(bytes)),
                            encoders_[learned]->noun(), format_bytes(double(others)))
              : "";
    }
  }

  size_t exact_form(const Candidate& candidate) const { return smallest_form(candidate, true); }
  size_t learned_form(const Candidate& candidate) const { return smallest_form(candidate, false); }

  /// Of the exact forms or of the others; forms.size() where there is none.
  size_t smallest_form(const Candidate& candidate, bool exact) const {
    size_t smallest = candidate.forms.size();
    for (size_t e = 0; e < candidate.forms.size(); ++e) {
      if (!candidate.forms[e] || encoders_[e]->exact() != exact) continue;
      if (smallest == candidate.forms.size() ||
          candidate.forms[e]->cost.bytes < candidate.forms[smallest]->cost.bytes)
        smallest = e;
    }
    return smallest;
  }

  void take(Candidate& candidate, size_t form) {
    size_.remove(candidate.form().sections);
    candidate.taken = form;
    size_.add(candidate.form().sections);
  }

  /// What the file will take at most.
  uint64_t estimated_bytes() const { return size_.bytes() + reserve_; }

  void shrink_to(uint64_t most) {
    // Bytes fall with the square of the scale, or a little faster.
    const auto step = [&] {
      return std::clamp(std::pow(double(most) / double(estimated_bytes()), 1 / 2.5), 0.6, 0.95);
    };
    for (double scale = step(); estimated_bytes() > most; scale *= step()) {
      bool smaller = false;
      for (size_t e = 0; e < encoders_.size(); ++e) {
        if (!encoders_[e]->has_scale(scale)) continue;
        lay_out(e, scale);
        smaller = true;
      }
      if (!smaller)
        throw TargetNotMet(TargetNotMet::Limit::bytes,
                           fmt::format("with {} the asset takes {} bytes, more than the limit of {}",
                                       encoders_.front()->smallest(), estimated_bytes(), most));
      choose_by_bytes();
    }
  }

  /// Objects first .. first + count - 1: several only where they are trained together.
  void bake_objects(size_t first, size_t count) {
    stop_if(cancel_);
    const bool trains = !encoders_[candidates_[first].taken]->exact(),
               compares = !trains && count == 1 && candidates_[first].has_choice() &&
                          learned_form(candidates_[first]) == encoders_.size();
    if (trains || compares || options_.evaluation_rays > 0) {
      std::deque<GroundTruth> truths;
      for (size_t i = first; i < first + count; ++i) truths.emplace_back(prepared_.objects[i]);
      if (trains && count == 1 && candidates_[first].has_choice())
        choose(first, truths.front().source());
      else if (trains)
        train_or_throw(first, truths);
      else if (compares)
        choose_exact(first, truths.front().source());
      for (size_t i = first; i < first + count; ++i)
        result_.objects[i].sets = measured(i, truths[i - first].source());
      if (trains && options_.max_error && count == 1) search(first, truths.front().source());
    }
    for (size_t i = first; i < first + count; ++i) finish(i);
  }

  /// The object in a learned form where that is worth its errors, else in an exact one.
  void choose(size_t index, const RaySource& source) {
    ObjectReport& own = result_.objects[index];
    Candidate& candidate = candidates_[index];
    const size_t exact_index = exact_form(candidate);
    Form &learned = candidate.form(), &exact = *candidate.forms[exact_index];
    report(BakeProgress::Stage::choosing, index, 0.01);
    const uint64_t seed = options_.seed + kChoosingSeed;
    learned.cost.work = encoders_[candidate.taken]->work(learned, source, seed);
    exact.cost.work = encoders_[exact_index]->work(exact, source, seed);
    const double gain = gain_of(learned.cost, exact.cost);
    const std::string would_be = fmt::format("{} would be {}", encoders_[candidate.taken]->noun(),
                                             describe_gain(learned.cost, exact.cost));
    if (gain < kLeastGain && take_exact(index, would_be + ", too little to be wrong for")) return;

    if (const std::string failure = train(index, {{index, source, learned, own}}); !failure.empty()) {
      if (take_exact(index, failure)) return;
      throw Error(Status::training_failed, failure);
    }
    report(BakeProgress::Stage::choosing, index, 0.90);
    const WorstError worst = worst_error(reference_answerer(learned.field()), source, seed);
    learned.cost.error = worst.error;
    const std::string cost = fmt::format("{:.2f} % of {} wrong", 100 * worst.error, name_of(worst.set));
    // Who states a largest error has said what errors are worth.
    const bool worth = options_.max_error || gain >= 100 * worst.error * kGainPerPercent;
    if (!worth && take_exact(index, fmt::format("{}, too little for {}", would_be, cost))) return;
    if (own.reason.empty())
      own.reason = fmt::format("{} as {} of {}, for {}", describe_gain(learned.cost, exact.cost),
                               encoders_[exact_index]->noun(), format_bytes(double(exact.cost.bytes)), cost);
  }

  /// Of several exact forms the one of the least counted work.
  void choose_exact(size_t index, const RaySource& source) {
    Candidate& candidate = candidates_[index];
    report(BakeProgress::Stage::choosing, index, 0.5);
    size_t least = candidate.taken;
    for (size_t e = 0; e < candidate.forms.size(); ++e) {
      if (!candidate.forms[e]) continue;
      EncodingCost& cost = candidate.forms[e]->cost;
      cost.work = encoders_[e]->work(*candidate.forms[e], source, options_.seed + kChoosingSeed);
      if (cost.work < candidate.forms[least]->cost.work) least = e;
    }
    if (least == candidate.taken) return;
    const double wanted = candidate.form().cost.work, chosen = candidate.forms[least]->cost.work;
    result_.objects[index].reason =
        fmt::format("{} takes less work than {}: {:.0f} and {:.0f} ns a ray, counted",
                    encoders_[least]->noun(), encoders_[candidate.taken]->noun(), chosen, wanted);
    take(candidate, least);
  }

  /// Takes the object's exact form where the limit of bytes leaves room for it; false where it does not.
  bool take_exact(size_t index, const std::string& reason) {
    Candidate& candidate = candidates_[index];
    const size_t learned = candidate.taken, exact = exact_form(candidate);
    take(candidate, exact);
    const bool fits = !options_.max_bytes || estimated_bytes() <= *options_.max_bytes;
    if (!fits) take(candidate, learned);
    result_.objects[index].reason =
        fits ? "exact; " + reason
             : fmt::format("the size limit leaves no room for {} of {}", encoders_[exact]->noun(),
                           format_bytes(double(candidate.forms[exact]->cost.bytes)));
    return fits;
  }

  void train_or_throw(size_t first, const std::deque<GroundTruth>& truths) {
    std::vector<Lesson> lessons;
    for (size_t i = 0; i < truths.size(); ++i)
      lessons.push_back(
          {first + i, truths[i].source(), candidates_[first + i].form(), result_.objects[first + i]});
    if (const std::string failure = train(first, lessons); !failure.empty())
      throw Error(Status::training_failed, failure);
  }

  /// Shown as the training of the object at `index`. Returns why it failed.
  std::string train(size_t index, const std::vector<Lesson>& lessons) {
    report(BakeProgress::Stage::training, index, 0.03);
    return encoders_[candidates_[index].taken]->train({lessons, prepared_.object_of,
                                                       [&](double share, double loss, double error) {
                                                         report(BakeProgress::Stage::training, index,
                                                                0.03 + 0.87 * share, loss, error);
                                                       },
                                                       cancel_});
  }

  bool is_learned(size_t index) const { return !encoders_[candidates_[index].taken]->exact(); }

  /// Looks for the smallest form of a trained object whose error stays within options.max_error: trains and
  /// measures it at other scales, kMostBakes in all. Without any, takes an exact form where there is one.
  void search(size_t index, const RaySource& source) {
    if (!is_learned(index)) return;
    constexpr int kMostBakes = 6;
    constexpr double kStep = 1.4, kFineEnough = 1.08;
    ObjectReport& own = result_.objects[index];
    Candidate& candidate = candidates_[index];
    const Encoder& encoder = *encoders_[candidate.taken];
    double met = 0, missed = 0;  // scales: the smallest that will do, the largest that will not
    std::optional<Form> best;
    ObjectReport best_report;
    for (int bakes = 1;; ++bakes) {
      const double bound = error_bound(own.sets).bound, scale = candidate.form().scale;
      own.bakes.emplace_back(candidate.form().cost.bytes, bound);
      if (bound <= *options_.max_error) {
        met = scale;
        best = candidate.form();
        best_report = own;
      } else {
        missed = scale;
      }
      const double next = met == 0 ? missed * kStep : missed == 0 ? met / kStep : std::sqrt(met * missed);
      const bool narrow = met > 0 && missed > 0 && met / missed < kFineEnough;
      if (bakes == kMostBakes || narrow || !encoder.has_scale(next)) break;
      Form form;
      form.alone.objects = {describe(prepared_.objects[index], own)};
      encoder.lay_out(prepared_.objects[index], next, false, index == 0, form);
      replace(candidate, std::move(form));
      if (options_.max_bytes && estimated_bytes() > *options_.max_bytes) break;
      stop_if(cancel_);
      if (const std::string failure = train(index, {{index, source, candidate.form(), own}});
          !failure.empty()) {
        if (!best) throw Error(Status::training_failed, failure);
        break;
      }
      own.sets = measured(index, source);
    }
    if (best) {
      best_report.bakes = std::move(own.bakes);
      own = std::move(best_report);
      replace(candidate, std::move(*best));
      return;
    }
    const ErrorBound worst = error_bound(own.sets);
    if (candidate.has_choice() &&
        take_exact(index, fmt::format("{} would answer {:.2f} % of {} wrongly, more than is allowed",
                                      encoder.noun(), 100 * worst.error, name_of(worst.set))))
      own.sets = measured(index, source);
  }

  void replace(Candidate& candidate, Form form) {
    size_.remove(candidate.form().sections);
    candidate.form() = std::move(form);
    size_.add(candidate.form().sections);
  }

  SetAccuracies measured(size_t index, const RaySource& source) {
    return measure_sets(source, reference_answerer(candidates_[index].form().field()), options_,
                        candidates_.size(), [&](RaySet set) {
                          stop_if(cancel_);
                          report(BakeProgress::Stage::measuring, index, 0.90 + 0.02 * double(set));
                        });
  }

  /// What has been found goes to the report, and forms that are not taken go.
  void finish(size_t index) {
    Candidate& candidate = candidates_[index];
    ObjectReport& own = result_.objects[index];
    own.encoding = encoders_[candidate.taken]->name();
    own.own = candidate.form().report;
    for (size_t e = 0; e < encoders_.size() && candidate.has_choice(); ++e)
      if (candidate.forms[e]) own.compared.emplace_back(encoders_[e]->name(), candidate.forms[e]->cost);
    for (size_t e = 0; e < encoders_.size(); ++e)
      if (e != candidate.taken) candidate.forms[e].reset();
  }

  void report(BakeProgress::Stage stage, size_t index, double share, double loss = 0,
              double error = 0) const {
    clock_->report(stage, result_.objects[index].name, index, share, loss, error);
  }

  const mesh::Scene& scene_;
  const BakeOptions& options_;
  const Encoders encoders_;
  const BakeCallback& callback_;
  const std::atomic<bool>& cancel_;
  PreparedScene prepared_;
  std::vector<Candidate> candidates_;
  format::FileSize size_;
  uint64_t reserve_ = 0;  ///< for the metadata
  std::optional<BakeClock> clock_;
  BakeResult result_;
};

}  // namespace

const EncodingCost* ObjectReport::cost_of(std::string_view which) const {
  for (const auto& [known, cost] : compared)
    if (known == which) return &cost;
  return nullptr;
}

BakeResult bake(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                const std::atomic<bool>& cancel) {
  return Driver(scene, options, callback, cancel).run();
}

}  // namespace nif::bake
