// How readers apply a Choice: each name of a file is looked up once, and what was found for the names that a
// triangle has (of its nodes, mesh and material) decides together whether it is read.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "formats/mesh/choice.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// What the names of something say.
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

  /// Whether there is anything to choose.
  bool active() const { return !input_.limits.choice.empty(); }
  Named look_up(std::string_view name);
  bool takes(const Named& named) const {
    return (named.only || input_.limits.choice.only.empty()) && !named.except;
  }
  /// To be called after all names were looked up: throws Error(usage) where a pattern has fitted none.
  /// `things` is what has names: "node, mesh or material".
  void require_used(std::string_view things) const;

 private:
  const Input& input_;
  std::vector<bool> only_used_, except_used_;
};

/// For formats without names. Throws Error(usage) where there is something to choose.
void refuse_choice(const Input& input);

}  // namespace nif::mesh::detail
