// Writes the results of `nif study` as a page.
#pragma once

#include <functional>
#include <string>

#include "tools/study/study.hpp"

namespace nif::tools {

/// One self-contained file: which family has the fewest wrong answers at equal bytes, curves of error and
/// speed over bytes, pictures, and every figure. `picture` returns the bytes of a PNG by name: those of the
/// points, and kReferencePicture.
std::string study_page(const Study& study, const std::function<std::string(const std::string&)>& picture);

inline constexpr const char* kReferencePicture = "reference.png";

}  // namespace nif::tools
