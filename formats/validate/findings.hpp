// Defines what `nif validate` finds in an asset, each with a number that never changes. Numbers below 800 are
// the rules that every reader enforces (formats/nif/rules.hpp). Those from 800 on are here: about the
// metadata, which readers ignore, and about the model, if a file is readable although something about it is
// wrong.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "formats/nif/rules.hpp"

namespace nif::validate {

enum class Severity : uint8_t {
  error,    ///< breaks a rule of the format
  warning,  ///< readers accept it, but answers may be wrong, or not what its baker meant
  note,     ///< worth knowing, and harmless
};

/// ADVICE(number, name, severity, what is wrong: a clause without punctuation at the end). 8xx the metadata,
/// 9xx the model.
#define NIF_ADVICE(ADVICE)                                                                                   \
  ADVICE(801, metadata_not_json, error,                                                                      \
         "is no JSON object, is nested deeper than 128, or has two members of one name")                     \
  ADVICE(802, metadata_missing, note, "there is no metadata: nothing says how it was baked")                 \
  ADVICE(803, metadata_key_missing, warning, "a member is missing")                                          \
  ADVICE(804, metadata_value, warning, "a member is not of the type or in the range that it should be")      \
  ADVICE(805, metadata_other_object, warning, "does not describe the objects of the file")                   \
  ADVICE(806, metadata_hierarchy, warning, "the hierarchy does not describe the instances of the file")      \
  ADVICE(807, metadata_merge, warning, "the merged objects are not instances of the file")                   \
  ADVICE(808, metadata_certain_wrong, warning, "states that certain answers were wrong")                     \
  ADVICE(901, transform_singular, warning,                                                                   \
         "its transform has no inverse in single precision, so it cannot be placed")                         \
  ADVICE(902, transform_skewed, note, "its transform is so skewed that none of its answers is certain")      \
  ADVICE(903, grid_too_small, warning, "the bounds come closer to the border of the grid than 1/32 voxel")   \
  ADVICE(904, corner_without_features, warning, "a corner of a surface voxel has no features")               \
  ADVICE(905, features_unused, note, "a corner that no surface voxel touches has features")                  \
  ADVICE(906, tree_out_of_bounds, warning, "its triangles reach out of the bounds")                          \
  ADVICE(907, other_writer, note, "nifkit would write the same content as other bytes")                      \
  ADVICE(908, object_not_placed, note, "no instance places it")                                              \
  ADVICE(909, same_name, note, "has the name of one before it")                                              \
  ADVICE(910, network_unused, warning, "no object uses it")                                                  \
  ADVICE(911, network_constant, warning, "gives every ray the same answer")                                  \
  ADVICE(912, bias_large, warning, "the bias is more than a tenth of the diagonal of the bounds")            \
  ADVICE(913, triangle_count, warning, "holds more triangles with an area than its record says of the mesh") \
  ADVICE(914, section_skipped, note, "optional, and newer than this build: not looked at")                   \
  ADVICE(915, kind_says_less, note, "a cell says less than its planes and its neighbours prove")             \
  ADVICE(916, object_unsupported, warning, "this build cannot answer it, and did not look at it")            \
  ADVICE(917, proves_nothing, warning, "none of its answers is certain: nothing proves its planes")          \
  ADVICE(918, records_longer, note, "its records are longer than this build knows")                          \
  ADVICE(919, alpha_map_unused, warning, "no patch is in it")

enum class Advice : uint16_t {
#define NIF_ADVICE_NUMBER(number, name, severity, what) name = number,
  NIF_ADVICE(NIF_ADVICE_NUMBER)
#undef NIF_ADVICE_NUMBER
};

/// The meaning of a number.
struct Entry {
  uint16_t number;
  const char* name;
  Severity severity;
  Status status;  ///< exit code; ok for warnings and notes
  const char* what;
};
/// All entries, by number.
const std::vector<Entry>& all_entries();
/// The entry of this number, which must exist.
const Entry& entry_of(uint16_t number);
const char* name_of(Severity severity);

struct Finding {
  const Entry* entry;
  std::string place;  ///< "section OBJS, record 3"; empty for the whole file
  std::string what;   ///< as precise as possible: a clause without punctuation at the end
};

/// Findings in the order in which they were made. The first 20 of each number are kept and the rest only
/// counted, so that memory stays bounded.
class Findings {
 public:
  static constexpr uint64_t kKept = 20;

  /// Without `what`, uses the text of the number.
  void add(uint16_t number, std::string place, std::string what = {});
  void add(Advice advice, std::string place, std::string what = {}) {
    add(uint16_t(advice), std::move(place), std::move(what));
  }
  const std::vector<Finding>& kept() const { return kept_; }
  /// Counts all findings, kept or not.
  uint64_t count(Severity severity) const;
  /// How many of this number were found.
  uint64_t count_of(uint16_t number) const;
  /// The status of the first error; ok if there is none.
  Status status() const;

 private:
  std::vector<Finding> kept_;
  std::map<uint16_t, uint64_t> counts_;
};

}  // namespace nif::validate
