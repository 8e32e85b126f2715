// `nif validate`: reports what is wrong with assets, with numbers that programs can rely on.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "formats/base/printable.hpp"
#include "formats/base/quantities.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/validate/validate.hpp"
#include "tools/common/json_output.hpp"
#include "tools/common/options.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

using validate::Finding, validate::Findings, validate::Severity;

constexpr const char* kSchema = "nifkit.validate/1";

struct Arguments {
  std::vector<std::string> files;
  bool list = false, strict = false, json = false, quiet = false;
};

struct Checked {
  std::string file;
  std::string unreadable;  ///< why it could not be read; empty if it was
  Findings findings;
  Status status = Status::ok;
};

Checked check(const std::string& file, bool strict) {
  Checked checked{file, {}, {}, Status::ok};
  try {
    const format::FileMemory memory = format::FileMemory::load(file, format::FileMemory::Mode::read);
    checked.findings = validate::validate(memory.bytes(), file);
  } catch (const format::Refusal& refusal) {  // from the header, before the rest is read
    checked.findings.add(uint16_t(refusal.rule()), refusal.place(), refusal.what_is_wrong());
  } catch (const Error& error) {
    checked.unreadable = error.what();
    checked.status = error.status();
    return checked;
  }
  checked.status = checked.findings.status();
  if (checked.status == Status::ok && strict && checked.findings.count(Severity::warning) > 0)
    checked.status = Status::doubtful_nif;
  return checked;
}

constexpr Severity kSeverities[] = {Severity::error, Severity::warning, Severity::note};

/// How many findings of a number there were beyond those that were kept.
uint64_t more_of(const Findings& findings, uint16_t number) {
  const uint64_t count = findings.count_of(number);
  return count > Findings::kKept ? count - Findings::kKept : 0;
}

nlohmann::ordered_json checked_json(const Checked& checked) {
  nlohmann::ordered_json json{{"file", checked.file}, {"valid", checked.status == Status::ok}};
  if (!checked.unreadable.empty()) {
    json["error"] = checked.unreadable;
    return json;
  }
  for (const Severity severity : kSeverities)
    json[std::string(validate::name_of(severity)) + "s"] = checked.findings.count(severity);
  nlohmann::ordered_json& list = json["findings"] = nlohmann::ordered_json::array();
  nlohmann::ordered_json more = nlohmann::ordered_json::object();
  for (const Finding& finding : checked.findings.kept()) {
    list.push_back({{"number", finding.entry->number},
                    {"name", finding.entry->name},
                    {"severity", validate::name_of(finding.entry->severity)},
                    {"place", finding.place},
                    {"what", finding.what}});
    if (const uint64_t count = more_of(checked.findings, finding.entry->number))
      more[std::to_string(finding.entry->number)] = count;
  }
  if (!more.empty()) json["more"] = std::move(more);
  return json;
}

void print(const Checked& checked, bool quiet) {
  if (!checked.unreadable.empty()) {
    fmt::print("{}\n", checked.unreadable);
    return;
  }
  const Findings& findings = checked.findings;
  std::string counts;
  for (const Severity severity : kSeverities) {
    const uint64_t count = findings.count(severity);
    if (count > 0) counts += (counts.empty() ? "" : ", ") + count_of(count, validate::name_of(severity));
  }
  if (!quiet || !counts.empty())
    fmt::print("{}: {}\n", checked.file, counts.empty() ? "nothing is wrong" : counts);
  std::set<uint16_t> told;
  for (const Finding& finding : findings.kept()) {
    fmt::print("  {} {}: {}{}{}\n", validate::name_of(finding.entry->severity), finding.entry->number,
               printable(finding.place), finding.place.empty() ? "" : ": ", printable(finding.what));
  }
  for (const Finding& finding : findings.kept()) {
    const uint64_t more = more_of(findings, finding.entry->number);
    if (more > 0 && told.insert(finding.entry->number).second)
      fmt::print("  and {} more of {}\n", more, finding.entry->number);
  }
}

void list_rules(bool json) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const validate::Entry& entry : validate::all_entries()) {
    if (json)
      list.push_back({{"number", entry.number},
                      {"name", entry.name},
                      {"severity", validate::name_of(entry.severity)},
                      {"code", int(entry.status)},
                      {"what", entry.what}});
    else
      fmt::print("{}  {:<7}  {:<24}  {}\n", entry.number, validate::name_of(entry.severity), entry.name,
                 entry.what);
  }
  if (json) write_json({{"schema", kSchema}, {"rules", std::move(list)}});
}

/// The reason why a file failed, as a sentence.
std::string reason(const Checked& checked) {
  if (!checked.unreadable.empty()) return checked.unreadable;
  for (const Finding& finding : checked.findings.kept()) {
    if (finding.entry->severity == Severity::note) continue;
    const std::string what = finding.place.empty() ? finding.what : finding.place + ": " + finding.what;
    return fmt::format("{}: {} {}: {}", checked.file, validate::name_of(finding.entry->severity),
                       finding.entry->number, printable(what));
  }
  return checked.file;
}

void run(const Arguments& arguments) {
  if (arguments.list) return list_rules(arguments.json);
  if (arguments.files.empty()) throw Error(Status::usage, "no asset is given; see --help");
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  Status status = Status::ok;
  size_t failed = 0;
  std::string first;
  for (const std::string& file : arguments.files) {
    const Checked checked = check(file, arguments.strict);
    if (checked.status != Status::ok && ++failed == 1) {
      status = checked.status;
      first = reason(checked);
    }
    if (arguments.json)
      files.push_back(checked_json(checked));
    else
      print(checked, arguments.quiet);
  }
  if (arguments.json) write_json({{"schema", kSchema}, {"files", std::move(files)}});
  if (failed > 0)
    throw Error(status, arguments.files.size() == 1 ? first
                                                    : fmt::format("{} of {} assets fail; the first is {}",
                                                                  failed, arguments.files.size(), first));
}

}  // namespace

void add_validate(Command app) {
  const Command command = app.add_subcommand("validate", "Report what is wrong with assets");
  auto a = std::make_shared<Arguments>();
  command.add_option("ASSET", a->files, "The .nif files to check");
  command.add_flag("--strict", a->strict, "Warnings fail, too (code 35)");
  command.add_flag("--list", a->list, "List all possible findings by number, and exit");
  add_json_option(command, a->json, kSchema);
  add_quiet_option(command, a->quiet);
  command.footer(
      "Errors break a rule of the format: a reader refuses the file. Warnings are read, but answers may be\n"
      "wrong. Notes are harmless. docs/validation.md explains each number.\n\n"
      "Examples:\n"
      "  nif validate dragon.nif\n"
      "  nif validate --strict --quiet assets/*.nif\n"
      "  nif validate dragon.nif --json");
  command.callback([a] { run(*a); });
}

}  // namespace nif::tools
