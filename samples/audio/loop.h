/* What the source sounds like: a machine's hum and hiss, which repeats without a seam. */
#ifndef LOOP_H
#define LOOP_H

/* Fills samples[count], count seconds * rate long, with values within -1 .. 1. Always the same ones. */
void make_loop(float* samples, int count, int rate);

#endif
