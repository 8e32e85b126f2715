// The text for Metal without a section, which the build has taken out by a macro.
#include "kernels/shader/nif.metal"
