// Writes the text of nifkit's functions for GLSL to a file, for the build. Programs that compile shaders while they run take the
// text from nifGetShaderSource themselves, and need no file.
#include <nif/nif.hpp>

#include <fstream>

int main(int count, char** words) {
  if (count != 2) return 2;
  std::ofstream file(words[1]);
  file << nifkit::shader_source(NIF_SHADER_GLSL);
  file.close();
  return file ? 0 : 1;
}
