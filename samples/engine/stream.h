/* Streaming: the bytes of a file arrive in chunks. The asset is created when all have arrived. */
#ifndef ENGINE_STREAM_H
#define ENGINE_STREAM_H

#include <nif/nif.h>

/* 1, or 0 with a sentence on standard error. */
int stream_asset(NifDevice device, const char* path, NifAsset* asset);

#endif
