/* Parses the command line with a table of the options that take a number. Each mistake ends with one
 * sentence. */
#include "options.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char kHelp[] =
    "engine ASSET.nif [options]: frames of a game whose shadows nifkit computes.\n"
    "\n"
    "  --frames N      frames to run (default 100)\n"
    "  --instances N   moving copies of the asset (default 36)\n"
    "  --threads N     threads that query (default 2)\n"
    "  --scatter       copies at random places and of random sizes, instead of a grid\n"
    "  --rays N        sun-shadow rays per frame, and the same number of lamp rays (default 20000)\n"
    "  --help          this text\n";

/* 1 if `text` is a whole number in 1 .. most. */
static int read_number(const char* text, int most, int* number) {
  char* end = NULL;
  long value;
  errno = 0;
  value = strtol(text, &end, 10);
  if (errno != 0 || end == text || *end != '\0' || value < 1 || value > most) return 0;
  *number = (int)value;
  return 1;
}

int read_options(int argc, char** argv, Options* options) {
  struct {
    const char* name;
    int* number;
    int most;
  } known[] = {{"--frames", NULL, 1000000},
               {"--instances", NULL, 10000},
               {"--threads", NULL, 256},
               {"--rays", NULL, 10000000}};
  int i, k;
  options->path = NULL;
  options->frames = 100;
  options->instances = 36;
  options->threads = 2;
  options->rays = 20000;
  options->scatter = 0;
  known[0].number = &options->frames;
  known[1].number = &options->instances;
  known[2].number = &options->threads;
  known[3].number = &options->rays;

  for (i = 1; i < argc; ++i) {
    if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
      fputs(kHelp, stdout);
      return 1;
    }
    if (strcmp(argv[i], "--scatter") == 0) {
      options->scatter = 1;
      continue;
    }
    if (argv[i][0] != '-') {
      if (options->path != NULL) {
        fprintf(stderr, "engine: one asset at a time, not both '%s' and '%s'\n", options->path, argv[i]);
        return 2;
      }
      options->path = argv[i];
      continue;
    }
    for (k = 0; k < 4 && strcmp(argv[i], known[k].name) != 0; ++k) {
    }
    if (k == 4) {
      fprintf(stderr, "engine: unknown option '%s'; see --help\n", argv[i]);
      return 2;
    }
    if (i + 1 == argc || !read_number(argv[i + 1], known[k].most, known[k].number)) {
      fprintf(stderr, "engine: %s takes a whole number, 1 to %d\n", known[k].name, known[k].most);
      return 2;
    }
    ++i;
  }
  if (options->path == NULL) {
    fputs("engine: give an asset; see --help\n", stderr);
    return 2;
  }
  return 0;
}
