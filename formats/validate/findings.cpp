// The table of all findings, built once from the reader's rules and the advice in the header. If a number is
// found too often to keep each place, it is still counted.
#include "formats/validate/findings.hpp"

#include <algorithm>
#include <utility>

namespace nif::validate {

const std::vector<Entry>& all_entries() {
  static const std::vector<Entry> entries = [] {
    std::vector<Entry> all;
    for (const format::RuleText& rule : format::kRules)
      all.push_back({uint16_t(rule.rule), rule.name, Severity::error, rule.status, rule.what});
#define NIF_ADVICE_ENTRY(number, name, severity, what) \
  all.push_back({number, #name, Severity::severity,    \
                 Severity::severity == Severity::error ? Status::damaged_nif : Status::ok, what});
    NIF_ADVICE(NIF_ADVICE_ENTRY)
#undef NIF_ADVICE_ENTRY
    return all;
  }();
  return entries;
}

const Entry& entry_of(uint16_t number) {
  const std::vector<Entry>& entries = all_entries();
  return *std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.number == number; });
}

const char* name_of(Severity severity) {
  constexpr const char* kNames[] = {"error", "warning", "note"};
  return kNames[size_t(severity)];
}

void Findings::add(uint16_t number, std::string place, std::string what) {
  if (++counts_[number] > kKept) return;
  const Entry& entry = entry_of(number);
  kept_.push_back({&entry, std::move(place), what.empty() ? entry.what : std::move(what)});
}

uint64_t Findings::count(Severity severity) const {
  uint64_t sum = 0;
  for (const auto& [number, count] : counts_)
    if (entry_of(number).severity == severity) sum += count;
  return sum;
}

uint64_t Findings::count_of(uint16_t number) const {
  const auto found = counts_.find(number);
  return found == counts_.end() ? 0 : found->second;
}

Status Findings::status() const {
  for (const Finding& finding : kept_)
    if (finding.entry->severity == Severity::error) return finding.entry->status;
  return Status::ok;
}

}  // namespace nif::validate
