/* The sound of the source: a machine's hum and hiss, which loops without a seam. */
#ifndef LOOP_H
#define LOOP_H

/* Fills samples[count], with count = seconds * rate, with values in -1 .. 1. They are always the same. */
void make_loop(float* samples, int count, int rate);

#endif
