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

/// An option of a Command, which owns it; copies are the same option. What sets something returns the option,
/// so that one can set more.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required() const;
  /// --help shows what the variable holds now, or this text, as the default.
  Option capture_default_str() const;
  Option default_str(const std::string& text) const;
  /// --help lists it under this heading.
  Option group(const std::string& heading) const;
  /// Takes one word each time that it is given, rather than all that follow.
  Option one_word_each() const;
  /// The two contradict each other.
  Option excludes(Option other) const;

  /// Refuse all other values. `T` is what --help calls them: int32_t, uint32_t, uint64_t or double.
  Option one_of(const std::vector<std::string>& words) const;
  template <class T>
  Option range(T least, T most) const;
  Option positive() const;
  Option non_negative() const;

 private:
  CLI::Option* option_;
};

/// `nif`, one of its subcommands or a verb of `nif mesh`; copies are the same command.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  Command add_subcommand(const std::string& name, const std::string& text) const;
  /// "-j,--threads", or "MESH" for a word in its place. `value` is set when the words are parsed, and must
  /// live until then. Which types there are stands at the end of options.cpp.
  template <class T>
  Option add_option(const std::string& name, T& value, const std::string& text = "") const;
  Option add_flag(const std::string& name, bool& value, const std::string& text) const;
  /// --help ends with this text.
  void footer(const std::string& text) const;
  /// Does the work, after all words were parsed; throws nif::Error.
  void callback(const std::function<void()>& work) const;
  /// One of its subcommands has to be named.
  void require_subcommand() const;
  /// --help does not list it.
  void hide() const;

  bool has(const std::string& option) const;
  /// Was the option among the words?
  bool given(const std::string& option) const;
  /// "--threads" or "MESH" of all options that were.
  std::vector<std::string> given() const;
  /// Names of all options without their dashes, the longer ones where they have two, but for --help.
  std::vector<std::string> names() const;
  bool is_flag(const std::string& option) const;
  bool is_repeatable(const std::string& option) const;

 protected:
  CLI::App* app_;
};

/// A command of no program: options to be asked for, or parsed from words that are not those of this process.
class OwnCommand : public Command {
 public:
  OwnCommand();
  /// May be called again; variables whose options are not among the words keep their values. Throws
  /// Error(usage).
  void parse(const std::vector<std::string>& words) const;

 private:
  std::shared_ptr<CLI::App> own_;
};

/// Throws Error(usage) at a "--name=" with nothing behind it, whose value CLI11 would take from the next
/// word.
void refuse_missing_values(std::span<const std::string> words);

}  // namespace nif::tools
