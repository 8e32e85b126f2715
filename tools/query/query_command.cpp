// `nif query`: answers the caller's own rays with an asset, for scripts, and to reproduce a report with one
// command line.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "formats/base/output_file.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "tools/common/options.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/shared_options.hpp"
#include "tools/common/threads.hpp"
#include "tools/query/answer_files.hpp"
#include "tools/query/answers.hpp"
#include "tools/query/ray_files.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {
namespace {

struct Arguments : RuntimeArguments {
  std::string asset, rays, output, format, device = "cpu";
  std::vector<std::string> ray;
  std::optional<uint32_t> object;
  uint32_t threads = 0;
  bool hits = false, quiet = false;
};

AnswerFormat format_of(const Arguments& arguments) {
  const auto ends_with = [&](const char* ending) { return arguments.output.ends_with(ending); };
  if (arguments.format == "npy" || (arguments.format.empty() && ends_with(".npy"))) return AnswerFormat::npy;
  if (arguments.format == "jsonl" || (arguments.format.empty() && ends_with(".jsonl")))
    return AnswerFormat::jsonl;
  return AnswerFormat::csv;
}

std::string configuration(const Arguments& arguments) {
  return fmt::format("{},threads={}{}", arguments.configuration(), arguments.threads,
                     arguments.device == "cpu" ? "" : ",backend=gpu");
}

void run(Arguments arguments) {
  if (arguments.ray.empty() && arguments.rays.empty())
    throw Error(Status::usage, "no rays are given: add --ray \"ox oy oz dx dy dz\", or --rays FILE");
  if (arguments.output == "-") arguments.output.clear();
  const bool to_terminal = arguments.output.empty() && isatty(STDOUT_FILENO) == 1;
  const AnswerFormat format = format_of(arguments);
  if (format == AnswerFormat::npy && to_terminal)
    throw Error(Status::usage, "--format npy is not for a terminal: add -o FILE.npy, or a pipe");
  if (!arguments.output.empty())
    for (const std::string& input : {arguments.asset, arguments.rays})
      refuse_overwriting(input, arguments.output);
  limit_threads(arguments.threads);

  Progress progress(arguments.quiet || to_terminal);
  const Asker asker(arguments.asset, configuration(arguments),
                    arguments.object ? &*arguments.object : nullptr, arguments.hits);
  const std::unique_ptr<RaySource> source =
      arguments.rays.empty() ? rays_of_words(arguments.ray) : open_rays(arguments.rays);
  AnswerStream out(arguments.output);
  std::vector<NifRay> rays;
  bool more = source->next(rays);  // before anything is written: most files that are not ray files fail here
  const auto writer = make_answer_writer(format, arguments.hits, source->count(), out);
  Answers answers;
  uint64_t count = 0, visible = 0, certain = 0;
  for (; more; more = source->next(rays)) {
    asker.ask(rays, answers);
    writer->write(answers);
    count += rays.size();
    visible = std::accumulate(answers.visible.begin(), answers.visible.end(), visible);
    certain = std::accumulate(answers.certain.begin(), answers.certain.end(), certain);
    progress.update(source->fraction(), "asking " + arguments.asset);
  }
  writer->end();
  out.commit();
  progress.finish();
  if (arguments.output.empty() || arguments.quiet) return;
  const double percent = 100 / double(std::max<uint64_t>(count, 1));
  fmt::print("{}: {}, {:.2f}% visible, {:.2f}% certain\n", arguments.output, count_of(count, "ray"),
             double(visible) * percent, double(certain) * percent);
}

}  // namespace

void add_query(Command app) {
  const Command command = app.add_subcommand("query", "Answer rays by an asset");
  auto a = std::make_shared<Arguments>();
  command.add_option("ASSET", a->asset, "The .nif file to query").required();
  const Option ray =
      command
          .add_option(
              "--ray", a->ray,
              "A ray: \"ox oy oz dx dy dz [tmin tmax]\". It is the points o + t d with tmin <= t <= tmax "
              "(by default 0 and infinity). May be repeated")
          .one_word_each();
  command
      .add_option("--rays", a->rays,
                  "A file of rays: CSV, JSON lines, or .npy (an array of N x 6 or N x 8 floats), detected by "
                  "content; - is standard input")
      .excludes(ray);
  command.add_option("-o,--output", a->output,
                     "The file to write the answers to; without it they go to standard output");
  command
      .add_option("--format", a->format,
                  "Format of the answers: csv (with a header), jsonl or npy (default: the ending of the "
                  "output's name, else csv)")
      .one_of({"csv", "jsonl", "npy"});
  command.add_flag("--hits", a->hits,
                   "Also report first hits (nifIntersect): t, nx, ny, nz, instance, object, "
                   "triangle");
  command.add_option("--object", a->object,
                     "Query only this object of the asset, in its own space. The first is 0");
  command.add_option("--device", a->device, "cpu, or gpu; first hits come from the CPU")
      .one_of({"cpu", "gpu"})
      .capture_default_str();
  add_threads_option(command, a->threads);
  add_runtime_options(command, *a);
  add_quiet_option(command, a->quiet);
  command.footer(
      "Answers: visible (1: nothing blocks the ray), certain (1: proven, 0: learned), probability (that it "
      "is\n"
      "visible). Numbers of a ray may be hexadecimal (0x1p-3), inf or nan. docs/command-line.md describes "
      "the "
      "files.\n\n"
      "Examples:\n"
      "  nif query dragon.nif --ray \"0 0 5  0 0 -1\" --hits\n"
      "  nif query dragon.nif --rays rays.csv -o answers.csv\n"
      "  nif query dragon.nif --rays rays.npy -o answers.npy\n"
      "  printf '0 0 5 0 0 -1\\n' | nif query dragon.nif --rays - --format jsonl");
  command.callback([a] { run(*a); });
}

}  // namespace nif::tools
