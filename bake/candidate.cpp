// Lays out the forms of an object, and counts the bytes of the one that is chosen after each change.
#include "bake/candidate.hpp"

#include <fmt/format.h>

#include <cmath>

#include "bake/bake_clock.hpp"
#include "bake/colors.hpp"
#include "bake/seeds.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

/// Everything that is the same for an object in any encoding; also fills the report.
format::Object describe(const Prepared& prepared, ObjectReport& report) {
  format::Object object;
  object.name = format::clean_name(prepared.source->name);
  object.aabb_min = prepared.box.min;
  object.aabb_max = prepared.box.max;
  object.bias = prepared.bias;
  report.name = object.name;
  report.triangles = prepared.triangle_count();
  object.triangle_count = uint32_t(std::min<uint64_t>(report.triangles, 0xffffffffu));
  report.closed_components = prepared.closed.count();
  report.open_components = prepared.closed.open_components;
  if (prepared.bends) return object;  // nothing was changed
  report.cleaned = prepared.surface.report;
  report.turned = prepared.closed.turned;
  return object;
}

/// Whether an object that bends, or has holes, or neither, may have the encoding.
bool apt(const Encoder& encoder, const Prepared& prepared, const BakeOptions& options) {
  const bool has_holes = prepared.has_holes();
  if (prepared.bends) return encoder.bends();
  switch (encoder.holes()) {
    case Encoder::Holes::none:
      return !has_holes;
    case Encoder::Holes::any:
      return !has_holes || options.encoding != kAutomatic;
    case Encoder::Holes::only:
      break;
  }
  return has_holes;
}

}  // namespace

Candidate::Candidate(size_t index_, const Prepared& prepared_, const BakeRequest& request,
                     ObjectReport& report_, format::FileSize& size)
    : index(index_),
      prepared(prepared_),
      report(report_),
      request_(request),
      size_(size),
      described_(describe(prepared, report)),
      forms_(request.encoders.size()) {
  std::string obstacle;
  for (const auto& encoder : request.encoders) {
    const bool may = apt(*encoder, prepared, request.options);
    const std::string why = may ? encoder->obstacle(prepared.surface.positions) : std::string();
    suits_.push_back(may && why.empty());
    if (!why.empty()) obstacle = why;
  }
  const auto first = std::find(suits_.begin(), suits_.end(), true);
  if (first == suits_.end()) throw Error(Status::too_large, fmt::format("'{}': {}", report.name, obstacle));
  chosen_ = size_t(first - suits_.begin());
  report.reason = encoder().holes() == Encoder::Holes::only                    ? "it has holes"
                  : prepared.bends                                             ? "it bends"
                  : obstacle.empty() && request.options.encoding != kAutomatic ? "as requested"
                                                                               : obstacle;
}

void Candidate::lay_out(size_t encoding, double scale, bool bounded) {
  stop_if(request_.cancel);
  Form& form = forms_[encoding].emplace();
  form.alone.objects = {described_};
  request_.encoders[encoding]->lay_out(prepared, scale, bounded, index == 0, form);
  if (request_.options.colors) reserve_colors(prepared, form);
  count();
}

bool Candidate::lay_out_exact(uint64_t most) {
  const BakeOptions& options = request_.options;
  // Planes come on top of triangles, so where bytes count, colours alone are worth them.
  const bool with_planes = options.colors || options.prefer == Preference::speed ||
                           (!options.prefer && report.triangles >= kLeastForPlanes);
  for (size_t e = 0; e < forms_.size(); ++e) {
    const Encoder& encoder = *request_.encoders[e];
    const bool has_planes = encoder.has_scale(1);
    if (!suits_[e] || encoder.kind() != AnswerKind::exact || (has_planes && !with_planes)) continue;
    lay_out(e, 1);
    while (forms_[e] && forms_[e]->cost.resident > most) {
      // Memory falls with the square of the scale, or a little faster.
      const double step = std::pow(double(most) / double(forms_[e]->cost.resident), 1 / 2.0);
      const double next = forms_[e]->scale * std::clamp(step, 0.5, 0.9);
      if (encoder.has_scale(next))
        lay_out(e, next, false);
      else
        forms_[e].reset();
    }
  }
  const std::optional<size_t> smallest = smallest_exact();
  choose(smallest.value_or(chosen_));
  return smallest.has_value();
}

void Candidate::choose(size_t encoding) {
  chosen_ = encoding;
  count();
}

void Candidate::replace(Form&& form) {
  forms_[chosen_] = std::move(form);
  count();
}

double Candidate::count_work(size_t encoding, const RaySource& source) {
  Form& form = *forms_[encoding];
  form.cost.work = request_.encoders[encoding]->work(form, source, request_.options.seed + kChoosingSeed);
  return form.cost.work;
}

void Candidate::count() {
  size_.set(index, forms_[chosen_] ? forms_[chosen_]->sections : format::SectionBytes());
}

std::vector<size_t> Candidate::exact_forms() const {
  std::vector<size_t> exact;
  for (size_t e = 0; e < forms_.size(); ++e)
    if (forms_[e] && request_.encoders[e]->kind() == AnswerKind::exact) exact.push_back(e);
  return exact;
}

std::optional<size_t> Candidate::smallest_exact() const {
  std::optional<size_t> smallest;
  for (const size_t e : exact_forms())
    if (!smallest || forms_[e]->cost.bytes < forms_[*smallest]->cost.bytes) smallest = e;
  return smallest;
}

void Candidate::finish() {
  report.encoding = encoder().name();
  report.own = form().report;
  for (size_t e = 0; e < forms_.size(); ++e)
    if (forms_[e]) report.compared.emplace_back(request_.encoders[e]->name(), forms_[e]->cost);
  if (report.compared.size() == 1) report.compared.clear();
  for (size_t e = 0; e < forms_.size(); ++e)
    if (e != chosen_) forms_[e].reset();
}

}  // namespace nif::bake
