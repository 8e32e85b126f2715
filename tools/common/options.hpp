// Options of the subcommands. CLI11 parses them. Its header takes five seconds to compile, so these classes
// hide it: only options.cpp and main.cpp include it.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace nif::tools {

/// An option of a Command, which owns it; copies refer to the same option. Setters return the option, so that
/// calls can be chained.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required() const;
  /// --help shows the variable's current value, or this text, as the default.
  Option capture_default_str() const;
  Option default_str(const std::string& text) const;
  /// --help lists it under this heading.
  Option group(const std::string& heading) const;
  /// Takes one word each time that it is given, rather than all that follow.
  Option one_word_each() const;
  /// The two options cannot be used together.
  Option excludes(Option other) const;

  /// Accepts only these values. `T` is the type that --help shows: int32_t, uint32_t, uint64_t or double.
  Option one_of(const std::vector<std::string>& words) const;
  template <class T>
  Option range(T least, T most) const;
  Option positive() const;
  Option non_negative() const;

 private:
  CLI::Option* option_;
};

/// `nif`, one of its subcommands or a verb of `nif mesh`; copies refer to the same command.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  Command add_subcommand(const std::string& name, const std::string& text) const;
  /// `name` is "-j,--threads", or "MESH" for a positional word. `value` is set when the words are parsed, and
  /// must live until then. The end of options.cpp lists the supported types.
  template <class T>
  Option add_option(const std::string& name, T& value, const std::string& text = "") const;
  Option add_flag(const std::string& name, bool& value, const std::string& text) const;
  /// --help ends with this text.
  void footer(const std::string& text) const;
  /// Does the work once all words are parsed; throws nif::Error.
  void callback(const std::function<void()>& work) const;
  /// Requires one of its subcommands.
  void require_subcommand() const;
  /// Hides it from --help.
  void hide() const;

  bool has(const std::string& option) const;
  /// Whether the option was given.
  bool given(const std::string& option) const;
  /// The names of all options that were given, such as "--threads" or "MESH".
  std::vector<std::string> given() const;
  /// The names of all options but --help, without dashes; the longer name of options that have two.
  std::vector<std::string> names() const;
  bool is_flag(const std::string& option) const;
  bool is_repeatable(const std::string& option) const;

 protected:
  CLI::App* app_;
};

/// A command outside of the program, to look up its options or to parse words other than those of this
/// process.
class OwnCommand : public Command {
 public:
  OwnCommand();
  /// May be called again. Variables whose options are not given keep their values. Throws Error(usage).
  void parse(const std::vector<std::string>& words) const;

 private:
  std::shared_ptr<CLI::App> own_;
};

/// Throws Error(usage) at a "--name=" without a value, because CLI11 would take the next word as the value.
void refuse_missing_values(std::span<const std::string> words);

}  // namespace nif::tools
