// Reads files of rays (CSV, JSON lines or .npy, detected by content), a few rays at a time.
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
  /// Replaces `rays` with the next ones. Returns false at the end. Throws nif::Error; malformed_rays names
  /// the line or the row.
  virtual bool next(std::vector<NifRay>& rays) = 0;
  /// The total number of rays, if it is known before the end.
  virtual std::optional<uint64_t> count() const { return std::nullopt; }
  /// The fraction read, from 0 to 1; 0 if it is unknown.
  virtual double fraction() const { return 0; }
};

/// "-" means standard input. Throws nif::Error that names the file.
std::unique_ptr<RaySource> open_rays(const std::string& path);

/// The rays of --ray options, each a row of 6 or 8 numbers.
std::unique_ptr<RaySource> rays_of_words(const std::vector<std::string>& words);

class InputStream;
/// Rays of an array that numpy.save wrote: N x 6 or N x 8, of float32 or float64.
std::unique_ptr<RaySource> npy_rays(std::unique_ptr<InputStream> input);
/// Rays of lines of text.
std::unique_ptr<RaySource> text_rays(std::unique_ptr<InputStream> input);

}  // namespace nif::tools
