/* Reads 64 KiB at a time, as an engine's streaming would, then loads the asset from memory. nifkit
 * copies the bytes, so the buffer is freed at once. */
#include "stream.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

enum { kChunk = 64 * 1024 };

/* All bytes of a file, which the caller frees; or null, with a sentence on standard error. */
static unsigned char* read_in_chunks(const char* path, size_t* size) {
  unsigned char* bytes = NULL;
  size_t room = 0, got = 1;
  int failed = 0;
  FILE* file = fopen(path, "rb");
  *size = 0;
  if (file == NULL) {
    fprintf(stderr, "engine: %s: %s\n", path, strerror(errno));
    return NULL;
  }
  while (!failed && got > 0) {
    if (room - *size < kChunk) {
      unsigned char* more = realloc(bytes, room = 2 * room + kChunk);
      if (more == NULL) {
        fprintf(stderr, "engine: %s: out of memory\n", path);
        failed = 1;
        break;
      }
      bytes = more;
    }
    /* A game would return to its frame here, and read the next chunk in a later frame. */
    got = fread(bytes + *size, 1, kChunk, file);
    *size += got;
  }
  if (!failed && ferror(file)) {
    fprintf(stderr, "engine: %s: %s\n", path, strerror(errno));
    failed = 1;
  }
  fclose(file);
  if (!failed) return bytes;
  free(bytes);
  return NULL;
}

int stream_asset(NifDevice device, const char* path, NifAsset* asset) {
  size_t size;
  NifError error;
  unsigned char* bytes = read_in_chunks(path, &size);
  if (bytes == NULL) return 0;
  /* The asset keeps a copy. With NIF_LOAD_IN_PLACE it would use the engine's memory, aligned to
   * NIF_ASSET_ALIGNMENT. */
  error = nifLoadAssetMemory(device, bytes, size, NIF_LOAD_COPY, asset);
  free(bytes);
  if (error == NIF_OK) return 1;
  fprintf(stderr, "engine: %s: %s\n", path, nifGetErrorMessage());
  return 0;
}
