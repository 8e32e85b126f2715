// Any bytes as a file of rays for `nif query`: refused with a sentence that names it, or read to as many rays
// as it has room for. A pipe gives the same rays as a file.
#include <fcntl.h>
#include <unistd.h>

#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/fuzz/fuzz.hpp"
#include "tools/query/ray_files.hpp"

namespace {

using nif::test::must;

/// The rays, or nothing if they are refused.
std::optional<std::vector<NifRay>> read(const std::string& path) {
  std::vector<NifRay> all, rays;
  try {
    const auto source = nif::tools::open_rays(path);
    while (source->next(rays)) {
      must(!rays.empty());
      all.insert(all.end(), rays.begin(), rays.end());
      must(source->fraction() >= 0 && source->fraction() <= 1);
    }
    if (const auto count = source->count()) must(*count == all.size());
    return all;
  } catch (const nif::Error& error) {
    nif::test::must_refuse_well(error, path);
    return std::nullopt;
  }
}

/// The bytes that were written to it.
class Pipe {
 public:
  explicit Pipe(std::string_view bytes) {
    must(::pipe2(ends_, O_NONBLOCK) == 0);
    must(::write(ends_[1], bytes.data(), bytes.size()) == ssize_t(bytes.size()) || bytes.empty());
    must(::fcntl(ends_[0], F_SETFL, 0) == 0);
  }
  ~Pipe() {
    ::close(ends_[0]);
    if (ends_[1] >= 0) ::close(ends_[1]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void end() { ::close(std::exchange(ends_[1], -1)); }
  std::string path() const { return "/proc/self/fd/" + std::to_string(ends_[0]); }

 private:
  int ends_[2];
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string bytes = nif::test::spelled_out({reinterpret_cast<const char*>(data), size});
  const nif::test::MemoryFile file(bytes);
  const auto rays = read(file.path());
  constexpr size_t kLeastBytes = 12;  // of a ray: "0 0 0 0 0 0\n"
  must(!rays || kLeastBytes * rays->size() <= bytes.size() + 1);
  constexpr size_t kPipe = 65536;  // capacity in bytes
  if (bytes.size() > kPipe) return 0;
  Pipe pipe(bytes);
  pipe.end();
  const auto same = read(pipe.path());
  must(same.has_value() == rays.has_value());
  must(!rays || rays->size() == same->size());
  must(!rays || rays->empty() || std::memcmp(rays->data(), same->data(), rays->size() * sizeof(NifRay)) == 0);
  return 0;
}
