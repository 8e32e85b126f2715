// The texts of kernels/shader, for programs that do not have the files.
#pragma once

namespace nif::kernels::shader {

extern const char* const kGlsl;
extern const char* const kHlsl;
extern const char* const kMetal;
extern const char* const kWgsl;

}  // namespace nif::kernels::shader
