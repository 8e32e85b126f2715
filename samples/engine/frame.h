/* One frame's shadow queries, split into jobs: for points on the floor, towards the sun and the lamp. */
#ifndef ENGINE_FRAME_H
#define ENGINE_FRAME_H

#include "jobs.h"
#include "world.h"

typedef struct Frame {
  int points;
  float* position[3]; /* [points] each: structures of arrays, as a renderer's G-buffer has them */
  float* to_lamp[3];  /* [points] each */
  uint8_t* sun_lit;   /* [points] 1 lit, 0 in shadow */
  uint8_t* lamp_lit;  /* [points] */
  uint64_t lit;       /* of the 2 * points answers, after ask_frame */
} Frame;

/* Each returns 1, or 0 with a sentence on standard error. */
int make_frame(const World* world, int points, Frame* frame);
int ask_frame(const World* world, Jobs* jobs, Frame* frame);
void free_frame(Frame* frame);

#endif
