// Any bytes looked at by `nif validate`: it never fails, and finds that a rule of the format is broken
// exactly where the reader refuses, with the reader's exit code.
#include <algorithm>

#include "formats/validate/validate.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using nif::test::must;
  const auto bytes = std::as_bytes(std::span(data, size));
  const std::vector<std::byte> file(bytes.begin(), bytes.end());
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
