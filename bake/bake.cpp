// The driver of a bake. It handles objects, sizes, rays and limits; all it knows about encodings is
// bake/encoder.hpp.
#include "bake/bake.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <mutex>
#include <thread>

#include "bake/colors.hpp"
#include "bake/encoder.hpp"
#include "bake/oracle/prepare.hpp"
#include "bake/report.hpp"
#include "bake/steps.hpp"
#include "formats/base/quantities.hpp"

namespace nif::bake {
namespace {

using Encoders = std::vector<std::unique_ptr<Encoder>>;

bool may_choose(AnswerKind kind, const BakeOptions& options) {
  switch (kind) {
    case AnswerKind::exact:
      break;
    case AnswerKind::learned:
      return !options.open_rays && options.max_error != 0.0;
    case AnswerKind::open:
      return options.open_rays;
  }
  return true;
}

template <class Baking>
void add_encoder(const BakeOptions& options, Encoders& encoders) {
  const bool keeps_colors = Baking::kGrids || !options.colors;
  const bool wanted =
      options.encoding == kAutomatic
          ? Baking::kAutomatic && keeps_colors && may_choose(Baking::kKind, options)
          : options.encoding == kernels::encoding_of_field<typename Baking::Field>().name ||
                (options.encoding == Baking::kStandsInFor && keeps_colors && !options.resolution);
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

/// The encodings that an object may take: a named one and those that stand in for it, or all that "auto" may
/// choose.
Encoders encoders_for(const BakeOptions& options) {
  Encoders encoders = OfEncoders<EncodersOf>::make(options);
  if (encoders.empty())
    throw Error(Status::usage, fmt::format("no encoding is called '{}'", options.encoding));
  return encoders;
}

/// An object in the making.
struct Candidate {
  std::vector<bool> possible;              ///< [encoder]: whether the object can have the encoding
  std::vector<std::optional<Form>> forms;  ///< [encoder]: those that are laid out
  size_t taken = 0;                        ///< index of its form, as far as it has been chosen

  Form& form() { return *forms[taken]; }
};

class Driver {
 public:
  Driver(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
         const std::atomic<bool>& cancel, TrainingLog& log)
      : scene_(scene),
        options_(options),
        encoders_(encoders_for(options)),
        callback_(callback),
        cancel_(cancel),
        log_(log) {}

  BakeResult run() {
    prepare_objects();
    if (options_.encoding == kAutomatic)
      choose();
    else
      lay_out_named();
    if (options_.max_bytes) shrink_to(*options_.max_bytes);
    const size_t together = encoders_.front()->trains_together() ? candidates_.size() : 1;
    for (size_t i = 0; i < candidates_.size(); i += together) bake_objects(i, together);
    for (const ObjectReport& report : result_.objects) {
      result_.triangles += report.triangles;
      for (RaySet set : kRaySets) result_.sets[size_t(set)] += report.sets[size_t(set)];
    }
    result_.hits = figures_of(hits_);
    check_error(options_, learned_sets());
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Candidate& candidate = candidates_[i];
      fill_colors(scene_, prepared_.objects[i], candidate.form());
      encoders_[candidate.taken]->add(std::move(candidate.form()), result_.asset);
    }
    result_.asset.metadata = make_metadata(scene_, options_, encoders_, result_);
    return std::move(result_);
  }

 private:
  void prepare_objects() {
    if (callback_) callback_({BakeProgress::Stage::preparing, scene_.meshes.front().name, 0, 1, 0, 0, 0});
    prepared_ = prepare(scene_, options_.strict);
    result_.notes = std::move(prepared_.notes);
    result_.asset.instances = instances_of(scene_, prepared_);
    result_.asset.places_nothing = result_.asset.instances.empty();
    result_.placed = prepared_.instances;
    count_in(format::section_bytes(result_.asset));
    const size_t count = prepared_.objects.size();
    clock_.emplace(prepared_.objects, callback_);
    result_.objects.resize(count);
    candidates_.resize(count);
    reserve_ = kMetadataBytes + kMetadataBytesPerObject * count + scene_bytes(scene_, options_, result_);
    if (options_.lean) reserve_ += kMetadataBytesOfLean * count;
    for (size_t i = 0; i < count; ++i) add_candidate(i);
  }

  /// Finds the encodings that the object can have.
  void add_candidate(size_t index) {
    const Prepared& prepared = prepared_.objects[index];
    describe(prepared, result_.objects[index]);
    Candidate& candidate = candidates_[index];
    candidate.forms.resize(encoders_.size());
    std::string obstacle;
    for (const auto& encoder : encoders_) {
      const std::string why = encoder->obstacle(prepared.surface.positions);
      candidate.possible.push_back(why.empty());
      if (!why.empty()) obstacle = why;
    }
    const auto first = std::find(candidate.possible.begin(), candidate.possible.end(), true);
    if (first == candidate.possible.end())
      throw Error(Status::too_large, fmt::format("'{}': {}", result_.objects[index].name, obstacle));
    candidate.taken = size_t(first - candidate.possible.begin());
    result_.objects[index].reason =
        obstacle.empty() && options_.encoding != kAutomatic ? "as requested" : obstacle;
  }

  void lay_out(size_t index, size_t encoder, double scale, bool bounded = true) {
    stop_if(cancel_);
    Candidate& candidate = candidates_[index];
    std::optional<Form>& form = candidate.forms[encoder];
    const bool counted = candidate.taken == encoder;
    if (counted && form) count_out(form->sections);
    form.emplace().alone.objects = {describe(prepared_.objects[index], result_.objects[index])};
    encoders_[encoder]->lay_out(prepared_.objects[index], scale, bounded, index == 0, *form);
    if (options_.colors) reserve_colors(prepared_.objects[index], *form);
    if (counted) count_in(form->sections);
  }

  // Synchronised, because objects are laid out in parallel.
  void count_in(const format::SectionBytes& sections) {
    const std::lock_guard lock(counting_);
    size_.add(sections);
  }
  void count_out(const format::SectionBytes& sections) {
    const std::lock_guard lock(counting_);
    size_.remove(sections);
  }

  /// Calls lay_out(index) for each object; only the calling thread reports progress.
  template <class LayOut>
  void lay_out_each(const LayOut& lay_out) {
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<size_t> done = 0;
    tbb::parallel_for(size_t{0}, candidates_.size(), [&](size_t i) {
      if (callback_ && std::this_thread::get_id() == caller)
        callback_(
            {BakeProgress::Stage::preparing, result_.objects[i].name, done, candidates_.size(), 0, 0, 0});
      // Isolated, so that parallel work inside waits only for itself, not for another object.
      tbb::this_task_arena::isolate([&] { lay_out(i); });
      ++done;
    });
  }

  void lay_out_named() {
    lay_out_each([&](size_t i) {
      for (size_t e = 0; e < encoders_.size(); ++e)
        if (candidates_[i].possible[e]) lay_out(i, e, 1);
    });
  }

  /// "auto": chooses exact or not, by the user's options (docs/model.md). Trains and times nothing.
  void choose() {
    lay_out_each([&](size_t i) {
      if (options_.max_bytes || options_.max_error == 0.0) {
        lay_out_exact(i, kNoBudget);
        if (has_exact(i))
          result_.objects[i].reason = options_.max_bytes ? "exact: the size limit leaves room for it"
                                                         : "exact: no answer may be wrong";
      } else {
        choose_unbidden(i);
      }
      if (!has_exact(i)) lay_out_other(i);
    });
    if (options_.max_bytes) make_room(*options_.max_bytes);
  }

  /// If no option decides: exact if the object has few triangles and takes no more memory than Embree would.
  void choose_unbidden(size_t index) {
    ObjectReport& own = result_.objects[index];
    if (own.triangles >= kMostExactTriangles) {
      own.reason = fmt::format("{}: it has {} triangles or more", other_word(), kMostExactTriangles);
      return;
    }
    constexpr uint64_t kLeast =
        4096;  // a few triangles have a tree of some hundred bytes, Embree's takes more
    const uint64_t embree = std::max(kLeast, kEmbreeBytesPerTriangle * own.triangles);
    lay_out_exact(index, embree);
    if (has_exact(index))
      own.reason = fmt::format(
          "exact: it has fewer than {} triangles, and takes no more memory than a compact BVH of Embree, {}",
          kMostExactTriangles, format_bytes(double(embree)));
    else if (own.reason.empty())
      own.reason = fmt::format("{}: exact, it would take more memory than a compact BVH of Embree, {}",
                               other_word(), format_bytes(double(embree)));
  }

  /// Lays out all exact forms that take at most `most` memory, coarser than their preset if needed, and takes
  /// the smallest. Planes are only for objects that are large enough for them.
  void lay_out_exact(size_t index, uint64_t most) {
    Candidate& candidate = candidates_[index];
    const bool is_small = result_.objects[index].triangles < kLeastForPlanes;
    for (size_t e = 0; e < encoders_.size(); ++e) {
      const Encoder& encoder = *encoders_[e];
      const bool has_planes = encoder.has_scale(1);
      if (!candidate.possible[e] || encoder.kind() != AnswerKind::exact ||
          (has_planes && is_small && !options_.colors))
        continue;
      lay_out(index, e, 1);
      std::optional<Form>& form = candidate.forms[e];
      for (;;) {
        // Memory falls with the square of the scale, or a little faster.
        const double step = std::pow(double(most) / double(form->cost.resident), 1 / 2.0);
        const double next = form->scale * std::clamp(step, 0.5, 0.9);
        if (form->cost.resident <= most || !encoder.has_scale(next)) break;
        lay_out(index, e, next, false);
      }
      if (form->cost.resident <= most) continue;
      if (candidate.taken == e) count_out(form->sections);
      form.reset();
    }
    if (has_exact(index)) take(candidate, smallest_exact(candidate));
  }

  void lay_out_other(size_t index) {
    take(candidates_[index], other_encoder());
    lay_out(index, other_encoder(), 1);
  }

  /// Replaces exact forms by others, for the objects that save most by it, until all objects together take at
  /// most this much, or no exact form is left.
  void make_room(uint64_t most) {
    const size_t other = other_encoder();
    if (other == encoders_.size() || estimated_bytes() <= most) return;
    std::vector<std::pair<int64_t, size_t>> savings;
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Candidate& candidate = candidates_[i];
      if (candidate.taken == other || !candidate.possible[other]) continue;
      lay_out(i, other, 1);
      const int64_t saved =
          int64_t(candidate.form().cost.bytes) - int64_t(candidate.forms[other]->cost.bytes);
      if (saved > 0) savings.emplace_back(-saved, i);
    }
    std::sort(savings.begin(), savings.end());
    for (const auto& [saved, i] : savings) {
      if (estimated_bytes() <= most) return;
      result_.objects[i].reason = fmt::format("{}: the size limit leaves no room for {}", other_word(),
                                              noun_and_bytes(candidates_[i]));
      take(candidates_[i], other);
    }
  }

  /// "a BVH of 1.2 MB"
  std::string noun_and_bytes(Candidate& candidate) const {
    return fmt::format("{} of {}", encoders_[candidate.taken]->noun(),
                       format_bytes(double(candidate.form().cost.bytes)));
  }

  AnswerKind kind_of(size_t index) const { return encoders_[candidates_[index].taken]->kind(); }
  bool is_learned(size_t index) const { return kind_of(index) == AnswerKind::learned; }
  bool is_exact(size_t index) const { return kind_of(index) == AnswerKind::exact; }

  std::string_view other_word() const { return options_.open_rays ? "proof" : "learned"; }

  /// The encoding that is not exact, among those that "auto" may choose; encoders_.size() if there is none.
  size_t other_encoder() const {
    return size_t(std::find_if(encoders_.begin(), encoders_.end(),
                               [](const auto& e) { return e->kind() != AnswerKind::exact; }) -
                  encoders_.begin());
  }

  bool has_exact(size_t index) const { return smallest_exact(candidates_[index]) < encoders_.size(); }

  /// Among the exact forms that are laid out; encoders_.size() if there are none.
  size_t smallest_exact(const Candidate& candidate) const {
    size_t smallest = encoders_.size();
    for (size_t e = 0; e < encoders_.size(); ++e)
      if (candidate.forms[e] && encoders_[e]->kind() == AnswerKind::exact &&
          (smallest == encoders_.size() ||
           candidate.forms[e]->cost.bytes < candidate.forms[smallest]->cost.bytes))
        smallest = e;
    return smallest;
  }

  /// The form may be laid out later.
  void take(Candidate& candidate, size_t form) {
    if (candidate.forms[candidate.taken]) count_out(candidate.form().sections);
    candidate.taken = form;
    if (candidate.forms[form]) count_in(candidate.form().sections);
  }

  /// Maximum size of the file.
  uint64_t estimated_bytes() const { return size_.bytes() + reserve_; }

  void shrink_to(uint64_t most) {
    // Bytes fall with the square of the scale, or a little faster.
    const auto step = [&] {
      return std::clamp(std::pow(double(most) / double(estimated_bytes()), 1 / 2.5), 0.6, 0.95);
    };
    for (double scale = step(); estimated_bytes() > most; scale *= step()) {
      bool smaller = false;
      for (size_t i = 0; i < candidates_.size(); ++i) {
        const size_t taken = candidates_[i].taken;
        if (!encoders_[taken]->has_scale(scale)) continue;
        lay_out(i, taken, scale);
        smaller = true;
      }
      if (!smaller) break;
    }
    for (Candidate& candidate : candidates_) {
      const size_t smallest = smallest_exact(candidate);
      if (estimated_bytes() > most && encoders_[candidate.taken]->kind() == AnswerKind::exact)
        take(candidate, smallest);
    }
    if (estimated_bytes() > most)
      throw TargetNotMet(
          TargetNotMet::Limit::bytes,
          fmt::format("with {} the asset takes {} bytes, more than the limit of {}",
                      encoders_[candidates_.front().taken]->smallest(), estimated_bytes(), most));
  }

  /// Objects first .. first + count - 1: more than one only if they are trained together.
  void bake_objects(size_t first, size_t count) {
    stop_if(cancel_);
    const bool trains = is_learned(first), proves = kind_of(first) == AnswerKind::open,
               compares = is_exact(first) && exact_forms(first) > 1;
    if (trains || proves || compares || options_.evaluation_rays > 0) {
      std::deque<GroundTruth> truths;
      for (size_t i = first; i < first + count; ++i) truths.emplace_back(prepared_.objects[i]);
      if (trains)
        train_objects(first, truths);
      else if (compares)
        choose_exact(first, truths.front().source());
      else if (proves)
        leave_out(first, truths.front().source());
      for (size_t i = first; i < first + count; ++i)
        result_.objects[i].sets = measured(i, truths[i - first].source());
      if (trains && options_.max_error && count == 1) search(first, truths.front().source());
      for (size_t i = first; i < first + count; ++i) find_hits(i, truths[i - first].source());
    }
    for (size_t i = first; i < first + count; ++i) finish(i);
  }

  ptrdiff_t exact_forms(size_t index) const {
    const auto& forms = candidates_[index].forms;
    return std::count_if(forms.begin(), forms.end(), [&](const std::optional<Form>& form) {
      return form && encoders_[size_t(&form - forms.data())]->kind() == AnswerKind::exact;
    });
  }

  /// Of the exact forms that fit, takes the one with the least counted work.
  void choose_exact(size_t index, const RaySource& source) {
    Candidate& candidate = candidates_[index];
    report(BakeProgress::Stage::choosing, index, 0.5);
    std::vector<std::pair<double, size_t>> works;
    for (size_t e = 0; e < candidate.forms.size(); ++e) {
      if (!candidate.forms[e] || encoders_[e]->kind() != AnswerKind::exact) continue;
      EncodingCost& cost = candidate.forms[e]->cost;
      cost.work = encoders_[e]->work(*candidate.forms[e], source, options_.seed + kChoosingSeed);
      works.emplace_back(cost.work, e);
    }
    std::sort(works.begin(), works.end());
    const size_t before = candidate.taken;
    for (const auto& [work, e] : works) {
      take(candidate, e);
      if (e == before || fits()) break;
    }
    const auto& [least, best] = works[0];
    const auto& [more, other] = works[1];
    if (candidate.taken != best) return;
    const bool automatic = options_.encoding == kAutomatic;
    if (!automatic && best == before) return;
    const std::string why = fmt::format("less work as {} than as {}: {:.0f} and {:.0f} ns a ray, counted",
                                        encoders_[best]->noun(), encoders_[other]->noun(), least, more);
    std::string& reason = result_.objects[index].reason;
    reason = automatic ? reason + "; " + why : why;
  }

  void leave_out(size_t index, const RaySource& source) {
    Candidate& candidate = candidates_[index];
    report(BakeProgress::Stage::choosing, index, 0.5);
    count_out(candidate.form().sections);
    const std::string why = encoders_[candidate.taken]->leave_out(
        prepared_.objects[index], source, options_.seed + kChoosingSeed, candidate.form());
    if (options_.colors && !why.empty()) reserve_colors(prepared_.objects[index], candidate.form());
    count_in(candidate.form().sections);
    if (!why.empty()) result_.objects[index].reason += "; " + why;
  }

  bool fits() const { return !options_.max_bytes || estimated_bytes() <= *options_.max_bytes; }

  /// Takes an exact form instead of a learned one, if the object can have one and it fits; returns false if
  /// not.
  bool take_exact(size_t index, const RaySource& source, const std::string& why) {
    Candidate& candidate = candidates_[index];
    const size_t learned = candidate.taken;
    if (!has_exact(index)) lay_out_exact(index, kNoBudget);
    if (!has_exact(index)) return false;
    take(candidate, smallest_exact(candidate));
    if (!fits()) {
      take(candidate, learned);
      return false;
    }
    result_.objects[index].reason = "exact: " + why;
    if (exact_forms(index) > 1) choose_exact(index, source);
    return true;
  }

  void train_objects(size_t first, const std::deque<GroundTruth>& truths) {
    std::vector<Lesson> lessons;
    for (size_t i = 0; i < truths.size(); ++i)
      lessons.push_back(
          {first + i, truths[i].source(), candidates_[first + i].form(), result_.objects[first + i]});
    const std::string failure = train(first, lessons);
    if (!failure.empty() && (truths.size() > 1 || !take_exact(first, truths.front().source(), failure)))
      throw Error(Status::training_failed, failure);
  }

  /// Progress is shown as that of the object at `index`. Returns why training failed.
  std::string train(size_t index, const std::vector<Lesson>& lessons) {
    report(BakeProgress::Stage::training, index, 0.03);
    return encoders_[candidates_[index].taken]->train({lessons, prepared_.object_of,
                                                       [&](double share, double loss, double error) {
                                                         report(BakeProgress::Stage::training, index,
                                                                0.03 + 0.87 * share, loss, error);
                                                       },
                                                       cancel_, log_});
  }

  /// Finds the smallest form of a trained object whose error stays within options.max_error: trains and
  /// measures it at other scales, kMostBakes in total. If none qualifies, takes an exact form if there is
  /// one.
  void search(size_t index, const RaySource& source) {
    if (!is_learned(index)) return;
    constexpr int kMostBakes = 6;
    constexpr double kStep = 1.4, kFineEnough = 1.08;
    ObjectReport& own = result_.objects[index];
    Candidate& candidate = candidates_[index];
    const Encoder& encoder = *encoders_[candidate.taken];
    double met = 0, missed = 0;  // scales: the smallest that meets it, the largest that does not
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
      if (options_.colors) reserve_colors(prepared_.objects[index], form);
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
    if (take_exact(index, source,
                   fmt::format("{} would answer {:.2f} % of {} wrongly, more than is allowed", encoder.noun(),
                               100 * worst.error, name_of(worst.set))))
      own.sets = measured(index, source);
  }

  void replace(Candidate& candidate, Form form) {
    count_out(candidate.form().sections);
    candidate.form() = std::move(form);
    count_in(candidate.form().sections);
  }

  /// Accuracy of the objects that can be wrong, together.
  SetAccuracies learned_sets() const {
    SetAccuracies sets{};
    for (size_t i = 0; i < candidates_.size(); ++i)
      for (const RaySet set : kRaySets)
        if (is_learned(i)) sets[size_t(set)] += result_.objects[i].sets[size_t(set)];
    return sets;
  }

  SetAccuracies measured(size_t index, const RaySource& source) {
    return measure_sets(source, reference_answerer(candidates_[index].form().field()), options_,
                        candidates_.size(), [&](RaySet set) {
                          stop_if(cancel_);
                          report(BakeProgress::Stage::measuring, index, 0.90 + 0.02 * double(set));
                        });
  }

  /// For the form that was taken.
  void find_hits(size_t index, const RaySource& source) {
    const SetHits hits =
        measure_hits(source, candidates_[index].form().field(), prepared_.objects[index].box.diagonal(),
                     options_, candidates_.size(), [&](RaySet) {
                       stop_if(cancel_);
                       report(BakeProgress::Stage::measuring, index, 0.99);
                     });
    result_.objects[index].hits = figures_of(hits);
    for (const RaySet set : kHitSets) hits_[size_t(set)] += hits[size_t(set)];
  }

  /// Reports the results, and frees the forms that are not taken.
  void finish(size_t index) {
    Candidate& candidate = candidates_[index];
    ObjectReport& own = result_.objects[index];
    own.encoding = encoders_[candidate.taken]->name();
    own.own = candidate.form().report;
    for (size_t e = 0; e < encoders_.size(); ++e)
      if (candidate.forms[e]) own.compared.emplace_back(encoders_[e]->name(), candidate.forms[e]->cost);
    if (own.compared.size() == 1) own.compared.clear();
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
  TrainingLog& log_;
  PreparedScene prepared_;
  std::vector<Candidate> candidates_;
  std::mutex counting_;
  format::FileSize size_;
  uint64_t reserve_ = 0;  ///< for the metadata
  std::optional<BakeClock> clock_;
  SetHits hits_;  ///< of all objects so far
  BakeResult result_;
};

}  // namespace

const EncodingCost* ObjectReport::cost_of(std::string_view which) const {
  for (const auto& [known, cost] : compared)
    if (known == which) return &cost;
  return nullptr;
}

BakeResult bake(const mesh::Scene& scene, const BakeOptions& options, const BakeCallback& callback,
                const std::atomic<bool>& cancel, TrainingLog* log) {
  BakeOptions meant = options;
  meant.colors = options.colors && has_colors(scene);
  TrainingLog none;
  return Driver(scene, meant, callback, cancel, log ? *log : none).run();
}

}  // namespace nif::bake
