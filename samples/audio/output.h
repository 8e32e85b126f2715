/* Writes files whole or not at all. */
#ifndef OUTPUT_H
#define OUTPUT_H

#include <stdint.h>
#include <stdio.h>

/* A file that is written under a temporary name, and renamed if all goes well. */
typedef struct Output {
  FILE* file;
  const char* path;
  char* temporary;
} Output;

/* Opens a file for `path`, which must live until the end. Returns 0 after printing an error. */
int output_begin(Output* output, const char* path);

/* Closes the file and renames it if `fine` is 1; otherwise removes it. Returns 0 if `fine` is 0, or after
 * printing an error. Does nothing if the file was not opened. */
int output_end(Output* output, int fine);

/* Writes a WAV file of samples[frames][channels], 16 bits each. Errors show at output_end. */
void write_wav(FILE* file, const int16_t* samples, uint32_t frames, uint32_t channels, uint32_t rate);

#endif
