/* The command line. */
#ifndef ENGINE_OPTIONS_H
#define ENGINE_OPTIONS_H

typedef struct Options {
  const char* path;
  int frames, instances, threads, rays;
  int scatter; /* 1: copies at random places and of random sizes, 0: on a grid */
} Options;

/* 0: continue. 1: --help was given and printed. 2: wrong options, reported on standard error. */
int read_options(int argc, char** argv, Options* options);

#endif
