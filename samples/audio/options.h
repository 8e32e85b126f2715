/* The command line. */
#ifndef OPTIONS_H
#define OPTIONS_H

typedef struct Options {
  const char* asset; /* the .nif file */
  const char* sound; /* the .wav file to write */
  const char* log;   /* the .csv file to write, or null */
  double seconds;    /* how long the source takes for its way */
  int up, front;     /* the asset's axes: 0, 1 or 2 for x, y or z; never the same */
  int occlusion;     /* 0: the source is heard as if nothing were in its way */
} Options;

/* Returns 0 if the options are fine, 1 if help was printed, 2 after an error, which was printed. The strings
 * are those of argv. */
int read_options(int argc, char** argv, Options* options);

#endif
