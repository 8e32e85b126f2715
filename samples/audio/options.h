/* The command line. */
#ifndef OPTIONS_H
#define OPTIONS_H

typedef struct Options {
  const char* asset; /* the .nif file */
  const char* sound; /* the .wav file to write */
  const char* log;   /* the .csv file to write, or null */
  double seconds;    /* duration of the source's path */
  int up, front;     /* the asset's axes: 0, 1 or 2 for x, y or z; never the same */
  int occlusion;     /* 0: the source sounds as if the object were not there */
} Options;

/* Returns 0 if the options are valid, 1 if help was printed, 2 after printing an error. The strings are those
 * of argv. */
int read_options(int argc, char** argv, Options* options);

#endif
