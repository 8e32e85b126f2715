/* Streaming: a file's bytes come in piece by piece, and the asset is made of them when they are all there. */
#ifndef ENGINE_STREAM_H
#define ENGINE_STREAM_H

#include <nif/nif.h>

/* 1, or 0 with a sentence on standard error. */
int stream_asset(NifDevice device, const char* path, NifAsset* asset);

#endif
