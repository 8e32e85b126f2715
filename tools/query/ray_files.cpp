// The first six bytes tell .npy from text, and detect compressed files and archives, for a hint. Parsing is
// in ray_npy.cpp and ray_text.cpp; this file only has the rays of --ray.
#include "tools/query/ray_files.hpp"

#include <fmt/format.h>

#include <string_view>

#include "formats/base/status.hpp"
#include "tools/query/input_stream.hpp"
#include "tools/query/ray_line.hpp"

namespace nif::tools {
namespace {

class WordRays : public RaySource {
 public:
  explicit WordRays(const std::vector<std::string>& words) {
    for (size_t i = 0; i < words.size(); ++i) {
      try {
        RayTable table;
        if (table.begin(words[i])) throw LineProblem{"a ray is needed, and not a header"};
        rays_.push_back(table.parse(words[i]));
      } catch (const LineProblem& problem) {
        throw Error(Status::usage, words.size() == 1 ? "--ray: " + problem.what
                                                     : fmt::format("--ray {}: {}", i + 1, problem.what));
      }
    }
    count_ = rays_.size();
  }

  bool next(std::vector<NifRay>& rays) override {
    rays = std::move(rays_);
    rays_.clear();
    return !rays.empty();
  }
  std::optional<uint64_t> count() const override { return count_; }

 private:
  std::vector<NifRay> rays_;
  uint64_t count_;
};

}  // namespace

std::unique_ptr<RaySource> open_rays(const std::string& path) {
  using namespace std::string_view_literals;
  auto input = std::make_unique<InputStream>(path);
  const std::span<const std::byte> bytes = input->peek(6);
  const std::string_view start(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (start == "\x93NUMPY") return npy_rays(std::move(input));
  const auto refuse = [&](const char* why) {
    throw Error(Status::malformed_rays, input->name() + ": " + why);
  };
  if (start.starts_with("\x1f\x8b")) refuse("is compressed; unpack it: zcat FILE | nif query ... --rays -");
  if (start.starts_with("\x28\xb5\x2f\xfd"))
    refuse("is compressed; unpack it: zstdcat FILE | nif query ... --rays -");
  if (start.starts_with("PK\x03\x04"))
    refuse("is an archive (.npz?); numpy.save writes the one array that is needed, as .npy");
  if (start.starts_with("\xff\xfe") || start.starts_with("\xfe\xff") || start.find('\0') != start.npos)
    refuse("is neither text in ASCII or UTF-8 nor .npy");
  return text_rays(std::move(input));
}

std::unique_ptr<RaySource> rays_of_words(const std::vector<std::string>& words) {
  return std::make_unique<WordRays>(words);
}

}  // namespace nif::tools
