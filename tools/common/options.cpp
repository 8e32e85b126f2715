// Thin wrappers around CLI11. They fix two of its traps: negative values for unsigned options, and NaN.
// Templates are instantiated at the end for the types that options may have.
#include "tools/common/options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <type_traits>

#include "formats/base/status.hpp"

namespace nif::tools {

Option Option::required() const {
  option_->required();
  return *this;
}

Option Option::capture_default_str() const {
  option_->capture_default_str();
  return *this;
}

Option Option::default_str(const std::string& text) const {
  option_->default_str(text);
  return *this;
}

Option Option::group(const std::string& heading) const {
  option_->group(heading);
  return *this;
}

Option Option::one_word_each() const {
  option_->allow_extra_args(false);
  return *this;
}

Option Option::excludes(Option other) const {
  option_->excludes(other.option_);
  return *this;
}

Option Option::one_of(const std::vector<std::string>& words) const {
  option_->check(CLI::IsMember(words));
  return *this;
}

template <class T>
Option Option::range(T least, T most) const {
  option_->check(CLI::Range(least, most));
  return *this;
}

Option Option::positive() const {
  option_->check(CLI::PositiveNumber);
  return *this;
}

Option Option::non_negative() const {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

Command Command::add_subcommand(const std::string& name, const std::string& text) const {
  return Command(app_->add_subcommand(name, text));
}

namespace {

/// Rejects words that CLI11 2 accepts: for unsigned numbers, it adds a negative word to the end of the range.
std::string why_no_number(const std::string& word, bool whole) {
  errno = 0;
  char* end = nullptr;
  if (whole) {
    if (word.find('-') != word.npos) return word + " is negative";
    std::strtoull(word.c_str(), &end, 0);
    return errno == ERANGE ? word + " is too large" : "";
  }
  return std::isnan(std::strtod(word.c_str(), &end)) ? word + " is not a number" : "";
}

template <class T>
struct ValueOf {
  using Type = T;
};
template <class T>
struct ValueOf<std::optional<T>> {
  using Type = T;
};
template <class T>
struct ValueOf<std::vector<T>> {
  using Type = T;
};

}  // namespace

template <class T>
Option Command::add_option(const std::string& name, T& value, const std::string& text) const {
  CLI::Option* option = app_->add_option(name, value, text);
  using Value = typename ValueOf<T>::Type;
  if constexpr (std::is_arithmetic_v<Value>)
    if constexpr (std::is_unsigned_v<Value> || std::is_floating_point_v<Value>)
      option->check([](const std::string& word) { return why_no_number(word, std::is_unsigned_v<Value>); });
  return Option(option);
}

Option Command::add_flag(const std::string& name, bool& value, const std::string& text) const {
  return Option(app_->add_flag(name, value, text));
}

void Command::footer(const std::string& text) const { app_->footer(text); }
void Command::callback(const std::function<void()>& work) const { app_->callback(work); }
void Command::require_subcommand() const { app_->require_subcommand(1); }
void Command::hide() const { app_->group(""); }

bool Command::has(const std::string& option) const { return app_->get_option_no_throw(option) != nullptr; }
bool Command::given(const std::string& option) const { return app_->count(option) > 0; }

std::vector<std::string> Command::given() const {
  std::vector<std::string> names;
  for (const CLI::Option* option : app_->get_options())
    if (option->count() > 0) names.push_back(option->get_name());
  return names;
}

std::vector<std::string> Command::names() const {
  std::vector<std::string> names;
  for (const CLI::Option* option : app_->get_options())
    for (const std::string& name : option->get_lnames())
      if (name != "help") names.push_back(name);
  return names;
}

bool Command::is_flag(const std::string& option) const {
  return app_->get_option(option)->get_expected_max() == 0;
}

bool Command::is_repeatable(const std::string& option) const {
  return app_->get_option(option)->get_expected_max() > 1;
}

OwnCommand::OwnCommand() : Command(nullptr), own_(std::make_shared<CLI::App>()) { app_ = own_.get(); }

void refuse_missing_values(std::span<const std::string> words) {
  for (const std::string& word : words) {
    if (word == "--") return;
    if (word.starts_with("--") && word.find('=') == word.size() - 1)
      throw Error(Status::usage,
                  fmt::format("{} has no value after its '='", word.substr(0, word.size() - 1)));
  }
}

void OwnCommand::parse(const std::vector<std::string>& words) const {
  refuse_missing_values(words);
  std::vector<std::string> reversed(words.rbegin(), words.rend());  // CLI11 expects the words in reverse
  try {
    own_->parse(reversed);
  } catch (const CLI::ParseError& problem) {
    throw Error(Status::usage, problem.what());
  }
}

template Option Option::range(int32_t, int32_t) const;
template Option Option::range(uint32_t, uint32_t) const;
template Option Option::range(uint64_t, uint64_t) const;
template Option Option::range(double, double) const;

template Option Command::add_option(const std::string&, std::vector<double>&, const std::string&) const;
template Option Command::add_option(const std::string&, double&, const std::string&) const;
template Option Command::add_option(const std::string&, std::string&, const std::string&) const;
template Option Command::add_option(const std::string&, uint32_t&, const std::string&) const;
template Option Command::add_option(const std::string&, uint64_t&, const std::string&) const;
template Option Command::add_option(const std::string&, std::optional<float>&, const std::string&) const;
template Option Command::add_option(const std::string&, std::optional<std::string>&,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, std::optional<uint32_t>&, const std::string&) const;
template Option Command::add_option(const std::string&, std::optional<uint64_t>&, const std::string&) const;
template Option Command::add_option(const std::string&, std::vector<std::string>&, const std::string&) const;
template Option Command::add_option(const std::string&, std::vector<uint32_t>&, const std::string&) const;

}  // namespace nif::tools
