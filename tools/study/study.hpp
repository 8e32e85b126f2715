// The results of `nif study`, and the file that stores them.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/study/meter.hpp"

namespace nif::tools {

/// What a study is about. Points of two studies can be compared only if all of this is equal.
struct StudyKey {
  std::string mesh;  ///< name of the file
  std::string hash;  ///< of its content
  uint64_t triangles = 0;
  std::string version;    ///< of nifkit
  std::string processor;  ///< that the speeds are for
  bool quick = false;
  uint64_t seed = 1, rays = 0;
};

/// One rival, measured or left out.
struct RivalPoint {
  std::string family, size;  ///< of its RivalPlan
  std::string left_out;      ///< the reason; then the rest is empty
  uint64_t file_bytes = 0;   ///< 0: it has no file of its own
  uint64_t resident_bytes = 0;
  double seconds = 0;  ///< time to make it
  RivalSets sets;
  double view_wrong = 0;        ///< share of wrong answers in its picture
  std::string picture, errors;  ///< names of PNG files in the study's folder

  bool measured() const { return left_out.empty(); }
  /// Mean over the sets.
  double error() const;
  /// Speed on a set, relative to Embree on the whole mesh.
  std::optional<double> ratio(const std::string& set) const;
};

struct Study {
  StudyKey key;
  /// Of the file: all that count as one mesh.
  uint64_t meshes = 1, instances = 1;
  std::vector<RivalPoint> points;  ///< in the order of the plans

  const RivalPoint* find(const std::string& family, const std::string& size) const;
};

inline constexpr const char* kStudySchema = "nifkit.study/1";

/// docs/study.md explains the fields.
nlohmann::ordered_json to_json(const Study& study);
/// Throws Error(checkpoint_refused) with a sentence that names the file if the text does not come from
/// to_json(), or has another key, which it names.
Study read_study(const std::string& path, const std::string& text, const StudyKey& key);

/// A family at exactly this number of resident bytes: interpolated linearly in logarithms between the two
/// nearest sizes. Nothing if even the smallest takes more.
struct AtBytes {
  double error;
  std::optional<double> outer, inner, sun;  ///< ratios to Embree on the whole mesh
  /// No size of the family takes that many bytes, so this is its largest.
  bool largest = false;
};
std::optional<AtBytes> at_bytes(const Study& study, const std::string& family, double bytes);

/// Numbers of bytes at which rivals are compared.
inline constexpr std::array kBudgets{100e3, 300e3, 1e6};

/// What the reader of a study of several instances must know, or an empty text.
std::string flattened_note(const Study& study);
/// Names of all families, in order.
std::vector<std::string> families_of(const Study& study);
/// Whether the family is a simplified mesh in any form, with which ours is compared.
bool is_simplified(const std::string& family);

}  // namespace nif::tools
