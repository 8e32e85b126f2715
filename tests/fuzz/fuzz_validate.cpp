// Any bytes looked at by `nif validate`: it never fails, and finds that a rule of the format is broken
// exactly where the reader refuses, with the reader's exit code.
#include <algorithm>

#include "formats/validate/validate.hpp"
#include "tests/format/damaged.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

/// The file with the repetitions of its metadata expanded.
nif::test::Bytes file_from(const uint8_t* data, size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  const nif::test::Bytes file(bytes.begin(), bytes.end());
  std::vector<nif::test::Part> parts = nif::test::parts_of(file);
  const auto metadata = std::ranges::find(parts, uint32_t(nif::format::kMetadata), &nif::test::Part::type);
  if (metadata == parts.end()) return file;
  const std::string_view said(reinterpret_cast<const char*>(metadata->content.data()),
                              metadata->content.size());
  const std::string meant = nif::test::spelled_out(said);
  if (meant == said) return file;
  const auto text = std::as_bytes(std::span(meant));
  metadata->content.assign(text.begin(), text.end());
  return nif::test::file_of(file, parts);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using nif::test::must;
  const nif::test::Bytes file = file_from(data, size);
  const nif::validate::Findings findings = nif::validate::validate(file, "input");
  nif::Status refused = nif::Status::ok;
  try {
    nif::format::read_asset(file, "input");
  } catch (const nif::Error& error) {
    nif::test::must_refuse_well(error, "input");
    refused = error.status();
  }
  constexpr uint16_t kFirstOfAdvice = 800;
  const bool broken = std::ranges::any_of(findings.kept(), [](const nif::validate::Finding& finding) {
    return finding.entry->number < kFirstOfAdvice;
  });
  must(broken == (refused != nif::Status::ok));
  if (broken) must(findings.status() == refused);
  for (const nif::validate::Finding& finding : findings.kept())
    must(finding.entry == &nif::validate::entry_of(finding.entry->number));
  return 0;
}
