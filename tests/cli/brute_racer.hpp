// The smallest program that takes part in a race of `nif bench`: it tests every triangle, in double precision.
// It uses docs/benchmark.md and nothing of nifkit, so it shows that the page says enough.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace nif::test {

class BruteRacer {
 public:
  /// Reads an export, and answers all of its rays.
  explicit BruteRacer(const std::filesystem::path& folder);

  struct Answers {
    std::vector<unsigned char> visible;
    std::vector<float> t;
    std::vector<unsigned> triangle, instance;
  };
  /// By ray set; may be changed before they are written.
  std::vector<std::pair<std::string, Answers>> answers;
  /// What write() writes, to be changed before.
  nlohmann::json results;

  /// Writes the arrays, and `results` as results.json, whose path it returns.
  std::string write(const std::filesystem::path& folder) const;
};

}  // namespace nif::test
