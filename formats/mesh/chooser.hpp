// Applies a Choice in readers: each name of a file is looked up once, and the results for a triangle's names
// (of its nodes, mesh and material) together decide whether it is read.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "formats/mesh/input.hpp"
#include "formats/mesh/mesh_choice.hpp"

namespace nif::mesh::detail {

/// The result of looking up a name.
struct Named {
  bool only = false, except = false;

  Named operator|(const Named& other) const { return {only || other.only, except || other.except}; }
};

class Chooser {
 public:
  explicit Chooser(const Input& input)
      : input_(input),
        only_used_(input.limits.choice.only.size()),
        except_used_(input.limits.choice.except.size()) {}

  /// Whether there are any patterns.
  bool active() const { return !input_.limits.choice.empty(); }
  Named look_up(std::string_view name);
  bool takes(const Named& named) const {
    return (named.only || input_.limits.choice.only.empty()) && !named.except;
  }
  /// To be called after all names were looked up: throws Error(usage) if a pattern matched none. `things`
  /// says what has names: "node, mesh or material".
  void require_used(std::string_view things) const;

 private:
  const Input& input_;
  std::vector<bool> only_used_, except_used_;
};

/// For formats without names. Throws Error(usage) if there are any patterns.
void refuse_choice(const Input& input);

}  // namespace nif::mesh::detail
