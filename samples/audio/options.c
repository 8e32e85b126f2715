/* Parses the command line. Letters of axes become numbers, limits are checked here, and each mistake ends
 * with one sentence. */
#include "options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char kHelp[] =
    "audio ASSET.nif -o SOUND.wav [options]: a sound that passes behind an object, for headphones.\n"
    "\n"
    "  -o FILE            the WAV file to write: 48 kHz, stereo, 16 bits\n"
    "  --log FILE         also write a CSV file: time, direction, share of visible rays, and filter, every "
    "10 ms\n"
    "  --seconds NUMBER   duration of the source's path, 1 to 600 (default 8)\n"
    "  --up AXIS          the asset's axis that points up: x, y or z (default y)\n"
    "  --front AXIS       the asset's axis that points at the listener (default z)\n"
    "  --no-occlusion     as if the object were not there, for comparison\n"
    "  --help             this text\n";

static int read_axis(const char* text, int* axis) {
  if (strlen(text) != 1 || text[0] < 'x' || text[0] > 'z') return 0;
  *axis = text[0] - 'x';
  return 1;
}

static int read_seconds(const char* text, double* seconds) {
  char* end = NULL;
  *seconds = strtod(text, &end);
  return end != text && *end == '\0' && *seconds >= 1 && *seconds <= 600;
}

static int wrong(const char* option, const char* takes) {
  fprintf(stderr, "audio: %s takes %s\n", option, takes);
  return 2;
}

int read_options(int argc, char** argv, Options* options) {
  int i;
  memset(options, 0, sizeof(*options));
  options->seconds = 8;
  options->up = 1;
  options->front = 2;
  options->occlusion = 1;

  for (i = 1; i < argc; ++i) {
    const char *name = argv[i], *value = i + 1 < argc ? argv[i + 1] : "";
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
      fputs(kHelp, stdout);
      return 1;
    }
    if (strcmp(name, "--no-occlusion") == 0) {
      options->occlusion = 0;
      continue;
    }
    if (name[0] != '-') {
      if (options->asset != NULL) {
        fprintf(stderr, "audio: one asset at a time, not both '%s' and '%s'\n", options->asset, name);
        return 2;
      }
      options->asset = name;
      continue;
    }
    if (strcmp(name, "-o") == 0) {
      if (*value == '\0') return wrong(name, "the name of a file");
      options->sound = value;
    } else if (strcmp(name, "--log") == 0) {
      if (*value == '\0') return wrong(name, "the name of a file");
      options->log = value;
    } else if (strcmp(name, "--seconds") == 0) {
      if (!read_seconds(value, &options->seconds)) return wrong(name, "a number, 1 to 600");
    } else if (strcmp(name, "--up") == 0) {
      if (!read_axis(value, &options->up)) return wrong(name, "x, y or z");
    } else if (strcmp(name, "--front") == 0) {
      if (!read_axis(value, &options->front)) return wrong(name, "x, y or z");
    } else {
      fprintf(stderr, "audio: unknown option '%s'; see --help\n", name);
      return 2;
    }
    ++i;
  }
  if (options->asset == NULL || options->sound == NULL) {
    fputs("audio: give an asset, and -o with the sound to write; see --help\n", stderr);
    return 2;
  }
  if (options->up == options->front) {
    fputs("audio: --up and --front are the same axis\n", stderr);
    return 2;
  }
  return 0;
}
