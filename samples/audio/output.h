/* The files that are written, each whole or not at all. */
#ifndef OUTPUT_H
#define OUTPUT_H

#include <stdint.h>
#include <stdio.h>

/* A file that is written beside its name, and gets it when all is well. */
typedef struct Output {
  FILE* file;
  const char* path;
  char* temporary;
} Output;

/* Opens a file for `path`, which must live until the end. 0 after an error, which was printed. */
int output_begin(Output* output, const char* path);

/* Closes the file and gives it its name if `fine` is 1; removes it if not. 0 if `fine` is 0, or after an
 * error, which was printed. Of one that was not begun it does nothing. */
int output_end(Output* output, int fine);

/* Writes a WAV file of samples[frames][channels], 16 bits each. Errors show at output_end. */
void write_wav(FILE* file, const int16_t* samples, uint32_t frames, uint32_t channels, uint32_t rate);

#endif
