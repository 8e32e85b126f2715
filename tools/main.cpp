// The `nif` executable: selects the subcommand, and turns every failure into one sentence and an exit code.
// Called as `nif-bake`, it runs `nif bake`.
#include <cxxabi.h>
#include <fmt/format.h>
#include <tbb/cache_aligned_allocator.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <span>
#include <string_view>
#include <typeinfo>

#include "formats/base/printable.hpp"
#include "formats/base/status.hpp"
#include "formats/base/temporaries.hpp"
#include "tools/common/interruption.hpp"
#include "tools/subcommands.hpp"
#ifdef NIF_WITH_MESH
#include "mesh/cgal/cgal.hpp"
#endif

namespace nif::tools {
namespace {

bool has_cgal() {
#ifdef NIF_WITH_MESH
  return cgal::available();
#else
  return false;
#endif
}

constexpr const char* kExitCodes =
    "Exit codes: 0 success, 1 internal error, 2 wrong options, 10-27 an input file cannot be used,\n"
    "30-35 an asset cannot be used, 40-41 the output cannot be written, 50-54 a bake failed, 130 "
    "interrupted.\n"
    "docs/command-line.md lists them all.\n";

/// Refuses words that name no subcommand. CLI11 would only say that a subcommand is missing.
void check_subcommands(const CLI::App& app, std::span<const std::string> arguments) {
  const std::vector<const CLI::App*> subcommands = app.get_subcommands([](const CLI::App*) { return true; });
  if (subcommands.empty() || arguments.empty() || arguments[0].starts_with('-')) return;
  std::string names;
  for (const CLI::App* command : subcommands) {
    if (command->check_name(arguments[0])) return check_subcommands(*command, arguments.subspan(1));
    names += (names.empty() ? "" : ", ") + command->get_name();
  }
  throw Error(Status::usage, fmt::format("'{}' has no subcommand '{}'; choose from {}", app.get_name(),
                                         arguments[0], names));
}

int run(int argc, char** argv) {
  CLI::App app(
      "Neural visibility for games and rendering. Bakes triangle meshes into small .nif assets that "
      "answer\nwhether a segment is blocked.",
      "nif");
  app.set_version_flag(
      "--version",
      std::string("nif " NIF_VERSION_STRING "\n") +
          (has_cgal() ? "Licence: GPL-3.0-or-later, because this executable is built with CGAL; nifkit's own "
                        "code is under Apache-2.0."
                      : "Licence: Apache-2.0. This executable links no GPL library."));
  app.require_subcommand(1);
  app.footer(std::string("Examples:\n"
                         "  nif bake dragon.ply -o dragon.nif\n"
                         "  nif bake --manifest library.toml\n"
                         "  nif farm library.toml --slurm\n"
                         "  nif eval dragon.nif --mesh dragon.ply\n"
                         "  nif bench dragon.nif --mesh dragon.ply\n"
                         "  nif export-shader dragon.nif -o shaders\n"
                         "  nif info dragon.nif\n"
                         "  nif validate dragon.nif\n"
                         "  nif attach crate.glb crate.nif -o both.glb\n"
                         "  nif devices\n"
                         "  nif query dragon.nif --ray \"0 0 5  0 0 -1\"\n"
                         "  nif mesh generate statue -o statue.ply\n"
                         "  nif render scene.toml -o pictures\n"
                         "  nif sweep dragon.ply -o sizes\n"
                         "  nif study dragon.ply -o study\n\n") +
             kExitCodes);
  const Command command(&app);
  add_attach(command);
  add_bake(command);
  add_bench(command);
  add_devices(command);
  add_eval(command);
  add_export_shader(command);
  add_farm(command);
  add_info(command);
#ifdef NIF_WITH_MESH
  add_mesh(command);
#endif
  add_query(command);
  add_render(command);
#ifdef NIF_WITH_MESH
  add_study(command);
#endif
  add_sweep(command);
  add_validate(command);

  // CLI11 expects the command line in reverse.
  std::vector<std::string> arguments(argv + 1, argv + argc);
  if (std::filesystem::path(argc > 0 ? argv[0] : "nif").filename() == "nif-bake") {
    arguments.insert(arguments.begin(), "bake");
  }
  check_subcommands(app, arguments);
  refuse_missing_values(arguments);
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(arguments);
  } catch (const CLI::Success& request) {
    return app.exit(request);  // --help, --version
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "nif: {}; see --help\n", error.what());
    return int(Status::usage);
  }
  return int(Status::ok);
}

/// Does not allocate: there may be no memory left.
int fail(Status status, const char* sentence, const char* defect = "") {
  for (const char* part : {"nif: ", defect}) std::fputs(part, stderr);
  put_printable(sentence, [](char c) { std::fputc(c, stderr); });
  std::fputc('\n', stderr);
  return int(status);
}

/// TBB loads its allocator, by dlopen(), where it first allocates. glibc 2.36 crashes if memory runs out there, so
/// this happens at the start.
const bool tbb_is_loaded = [] {
  tbb::cache_aligned_allocator<char> allocator;
  allocator.deallocate(allocator.allocate(1), 1);
  return true;
}();

/// TBB has no type for this.
bool means_no_threads(const std::exception& error) {
  return std::string_view(error.what()).starts_with("pthread_create has failed");
}

std::terminate_handler usual_end;

/// Libraries may need memory where they must not throw, like nlohmann::json in its destructors.
[[noreturn]] void on_terminate() {
  const std::type_info* type = abi::__cxa_current_exception_type();
  if (type && (*type == typeid(std::bad_alloc) || *type == typeid(std::bad_array_new_length))) {
    remove_temporaries();
    _exit(fail(Status::out_of_memory, "out of memory"));
  }
  usual_end();
  std::abort();
}

}  // namespace
}  // namespace nif::tools

int main(int argc, char** argv) {
  using nif::Status;
  nif::tools::leave_nothing_behind();
  nif::tools::usual_end = std::set_terminate(nif::tools::on_terminate);
  try {
    const int code = nif::tools::run(argc, argv);
    if (std::fflush(stdout) != 0 || std::ferror(stdout)) {
      fmt::print(stderr, "nif: standard output: the results could not be written\n");
      return int(Status::output_not_writable);
    }
    return code;
  } catch (const nif::Error& error) {
    return nif::tools::fail(error.status(), error.what());
  } catch (const std::bad_alloc&) {
    return nif::tools::fail(Status::out_of_memory, "out of memory");
  } catch (const std::exception& error) {
    if (nif::tools::means_no_threads(error))
      return nif::tools::fail(
          Status::out_of_memory,
          "no more threads can be started: memory, or the limit of processes, has run out");
    return nif::tools::fail(Status::internal, error.what(), "internal error: ");
  }
}
