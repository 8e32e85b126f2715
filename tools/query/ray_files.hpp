// Files of rays: CSV, JSON lines and .npy, told apart by their content, and read a few rays at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nif/nif.h"

namespace nif::tools {

class RaySource {
 public:
  virtual ~RaySource() = default;
  /// Replaces `rays` by the next ones. Returns false at the end. Throws nif::Error, malformed_rays among
  /// them, with the line or the row.
  virtual bool next(std::vector<NifRay>& rays) = 0;
  /// How many there are in all, where that is known before the end.
  virtual std::optional<uint64_t> count() const { return std::nullopt; }
  /// How much of it was read, 0 to 1; 0 where nobody knows.
  virtual double fraction() const { return 0; }
};

/// "-": standard input. Throws nif::Error that names the file.
std::unique_ptr<RaySource> open_rays(const std::string& path);

/// The rays of --ray, each a row of 6 or 8 numbers.
std::unique_ptr<RaySource> rays_of_words(const std::vector<std::string>& words);

class InputStream;
/// Of an array as numpy.save writes it: N x 6 or N x 8, of float32 or float64.
std::unique_ptr<RaySource> npy_rays(std::unique_ptr<InputStream> input);
/// Of lines of text.
std::unique_ptr<RaySource> text_rays(std::unique_ptr<InputStream> input);

}  // namespace nif::tools
