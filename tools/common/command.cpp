#include "tools/common/command.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

namespace nif::tools {
namespace {

std::atomic<bool> interrupted{false}, at_once{false};
static_assert(std::atomic<bool>::is_always_lock_free);

[[noreturn]] void end_at_once() {
  constexpr char kSentence[] = "\nnif: interrupted; nothing was written\n";
  const char* sentence =
      isatty(STDERR_FILENO) == 1 ? kSentence : kSentence + 1;  // a bar may stand in the line
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, sentence, std::strlen(sentence));
  _exit(int(Status::interrupted));
}

void on_signal(int) {
  if (at_once) end_at_once();
  if (interrupted.exchange(true)) _exit(int(Status::interrupted));
}

/// The number that `text` starts with; what follows is left in `rest`.
double leading_number(const std::string& text, std::string& rest, const std::string& option) {
  size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || !std::isfinite(value) || value < 0) {
    throw Error(Status::usage, fmt::format("{} '{}' is not a number", option, text));
  }
  rest = text.substr(used);
  return value;
}

}  // namespace

const std::atomic<bool>& interruption() {
  static const bool installed = [] {
    struct sigaction action {};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    return true;
  }();
  (void)installed;
  return interrupted;
}

EndAtOnce::EndAtOnce() {
  at_once = true;
  if (interruption()) end_at_once();  // it came just before
}
EndAtOnce::~EndAtOnce() { at_once = false; }

void limit_threads(uint32_t threads) {
  static std::unique_ptr<tbb::global_control> control;
  if (threads != 0)
    control = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
}

double parse_rate(const std::string& text, const std::string& option) {
  std::string rest;
  double value = leading_number(text, rest, option);
  if (rest == "%") value /= 100;
  if ((rest != "" && rest != "%") || value > 1) {
    throw Error(Status::usage, fmt::format("{} '{}' is not a rate: write 0.002 or 0.2%", option, text));
  }
  return value;
}

uint64_t parse_bytes(const std::string& text, const std::string& option) {
  static const std::pair<std::string_view, double> kUnits[] = {
      {"", 1},     {"B", 1},       {"k", 1e3},        {"kB", 1e3}, {"M", 1e6},
      {"MB", 1e6}, {"KiB", 1024.}, {"MiB", 1048576.}, {"GB", 1e9}, {"GiB", 1073741824.}};
  std::string rest;
  const double value = leading_number(text, rest, option);
  for (const auto& [unit, factor] : kUnits) {
    if (rest == unit && value * factor < 1e18) return uint64_t(value * factor);
  }
  throw Error(Status::usage,
              fmt::format("{} '{}' is not a size: write 200000, 200kB or 256KiB", option, text));
}

std::string count_of(uint64_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

void write_json(const nlohmann::ordered_json& json, std::FILE* out) {
  fmt::print(out, "{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return uint64_t(usage.ru_maxrss) * 1024;
}

}  // namespace nif::tools
