// Embeds the code files that the build lists in images.inc, one NIF_IMAGE(name, "target", "file") each.
#include "images.hpp"

#define NIF_IMAGE(name, target, file)                                             \
  asm(".pushsection .rodata\n.balign 4096\nnif_image_" #name ":\n.incbin \"" file \
      "\"\n"                                                                      \
      "nif_image_" #name "_end:\n.byte 0\n.popsection\n");                        \
  extern "C" const unsigned char nif_image_##name[], nif_image_##name##_end[];
#include "images.inc"
#undef NIF_IMAGE

namespace nif::gpu {

std::span<const Image> all_images() {
  static const Image images[] = {
#define NIF_IMAGE(name, target, file) \
  {target, nif_image_##name, static_cast<size_t>(nif_image_##name##_end - nif_image_##name)},
#include "images.inc"
#undef NIF_IMAGE
  };
  return images;
}

std::string_view image_names() {
  return ""
#define NIF_IMAGE(name, target, file) " " target
#include "images.inc"
#undef NIF_IMAGE
      ;
}

}  // namespace nif::gpu
