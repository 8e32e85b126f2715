// Tries a name against every pattern, even after one has matched. So each pattern that matches something is
// known, and one that matches nothing, usually a typing error, can be reported.
#include "formats/mesh/chooser.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "formats/base/glob.hpp"

namespace nif::mesh::detail {
namespace {

bool any_fits(std::string_view name, const std::vector<std::string>& patterns, std::vector<bool>& used) {
  bool any = false;
  for (size_t i = 0; i < patterns.size(); ++i)
    if (fits(name, patterns[i])) used[i] = any = true;  // marks every pattern that matches as used
  return any;
}

}  // namespace

Named Chooser::look_up(std::string_view name) {
  const Choice& choice = input_.limits.choice;
  Named named;
  named.only = any_fits(name, choice.only, only_used_);
  named.except = any_fits(name, choice.except, except_used_);
  return named;
}

void Chooser::require_used(std::string_view things) const {
  const Choice& choice = input_.limits.choice;
  for (const auto& [patterns, used] : {std::pair{&choice.only, &only_used_}, {&choice.except, &except_used_}})
    if (const auto idle = std::ranges::find(*used, false); idle != used->end())
      input_.fail(Status::usage, fmt::format("no {} has a name that matches '{}'", things,
                                             (*patterns)[size_t(idle - used->begin())]));
}

void refuse_choice(const Input& input) {
  const Choice& choice = input.limits.choice;
  if (choice.empty()) return;
  input.fail(Status::usage, fmt::format("has no names, so nothing in it matches '{}'",
                                        choice.only.empty() ? choice.except.front() : choice.only.front()));
}

}  // namespace nif::mesh::detail
