/* mkstemp creates the file beside its target, and rename puts it in place once it is complete. The header of
 * a WAV file is written byte by byte, so the byte order of the CPU does not matter. */
#define _POSIX_C_SOURCE 200809L
#include "output.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int failed(const char* path) {
  fprintf(stderr, "audio: cannot write %s: %s\n", path, strerror(errno));
  return 0;
}

int output_begin(Output* output, const char* path) {
  static const char ending[] = ".XXXXXX";
  struct stat there;
  mode_t mask = umask(0);
  int descriptor;
  umask(mask);
  memset(output, 0, sizeof(*output));
  /* rename would replace a device such as /dev/null with a file. */
  if (stat(path, &there) == 0 && !S_ISREG(there.st_mode)) {
    errno = S_ISDIR(there.st_mode) ? EISDIR : ENOTSUP;
    return failed(path);
  }
  output->path = path;
  output->temporary = malloc(strlen(path) + sizeof(ending));
  if (output->temporary == NULL) return failed(path);
  strcat(strcpy(output->temporary, path), ending);
  descriptor = mkstemp(output->temporary);
  if (descriptor < 0) {
    failed(path);
    free(output->temporary);
    output->temporary = NULL;
    return 0;
  }
  fchmod(descriptor, 0666 & ~mask); /* mkstemp only lets the owner read */
  output->file = fdopen(descriptor, "wb");
  if (output->file == NULL) {
    failed(path);
    close(descriptor);
    return output_end(output, 0);
  }
  return 1;
}

int output_end(Output* output, int fine) {
  if (output->temporary == NULL) return fine;
  if (output->file != NULL) {
    int written = !ferror(output->file);
    if (fclose(output->file) != 0) written = 0;
    if (fine && !written) fine = failed(output->path);
  }
  if (fine && rename(output->temporary, output->path) != 0) fine = failed(output->path);
  if (!fine) unlink(output->temporary);
  free(output->temporary);
  memset(output, 0, sizeof(*output));
  return fine;
}

/* WAV is little-endian on every machine. */
static void put(FILE* file, uint32_t value, int bytes) {
  for (; bytes > 0; --bytes, value >>= 8) fputc((int)(value & 0xff), file);
}

void write_wav(FILE* file, const int16_t* samples, uint32_t frames, uint32_t channels, uint32_t rate) {
  uint32_t frame = 2 * channels, i;
  fputs("RIFF", file);
  put(file, 36 + frames * frame, 4);
  fputs("WAVEfmt ", file);
  put(file, 16, 4);
  put(file, 1, 2); /* integers (PCM) */
  put(file, channels, 2);
  put(file, rate, 4);
  put(file, rate * frame, 4);
  put(file, frame, 2);
  put(file, 16, 2);
  fputs("data", file);
  put(file, frames * frame, 4);
  for (i = 0; i < frames * channels; ++i) put(file, (uint16_t)samples[i], 2);
}
