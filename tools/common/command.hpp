// What the subcommands of `nif` share: how they are declared, how they fail, how Ctrl-C stops them.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "formats/base/format_bytes.hpp"
#include "formats/base/status.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// Adds a subcommand's options to `app`; its callback does the work and throws nif::Error on failure. Each of
/// these lies in the file of its name.
void add_attach(Command app);
void add_bake(Command app);
void add_bench(Command app);
void add_devices(Command app);
void add_eval(Command app);
void add_farm(Command app);
void add_info(Command app);
void add_mesh(Command app);
void add_render(Command app);

/// Set once Ctrl-C or a termination signal has come; a second one ends the process at once. The first call
/// installs the handler: before it, signals kill as usual.
const std::atomic<bool>& interruption();

/// While one lives, Ctrl-C and a termination signal end the process at once, with Status::interrupted and one
/// sentence: for work within libraries that cannot be asked to stop. Only while no file is being written.
class EndAtOnce {
 public:
  EndAtOnce();
  ~EndAtOnce();
  EndAtOnce(const EndAtOnce&) = delete;
  EndAtOnce& operator=(const EndAtOnce&) = delete;
};

/// Runs `work`; where that throws a nif::Error that does not name the file it is about, puts the file's name
/// first.
template <class Work>
auto naming(const std::string& file, Work&& work) {
  try {
    return work();
  } catch (const Error& error) {
    const std::string sentence = error.what();
    if (sentence.find(file) != std::string::npos) throw;
    throw Error(error.status(), file + ": " + sentence);
  }
}

/// Limits the threads of everything that follows in the process; 0: all of them.
void limit_threads(uint32_t threads);

/// A rate as text: "0.002" or "0.2%". Throws nif::Error(usage) naming `option`.
double parse_rate(const std::string& text, const std::string& option);

/// A count of bytes as text: "200000", "200k" (1000), "1M", "256KiB", "1MiB".
uint64_t parse_bytes(const std::string& text, const std::string& option);

/// "1 object", "2 objects".
std::string count_of(uint64_t count, const std::string& noun);

/// Prints it as --json does: indented, with a replacement character for what is no UTF-8.
void write_json(const nlohmann::ordered_json& json, std::FILE* out = stdout);

/// Most memory that the process has held so far, in bytes.
uint64_t peak_memory();

}  // namespace nif::tools
