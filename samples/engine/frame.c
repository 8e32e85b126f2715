/* A job is 2,048 points and two queries. The sun's direction has stride 0: one for all rays. Each job
 * keeps its own error, because the message can only be read on the thread that failed. */
#include "frame.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { kRaysPerJob = 2048, kMaxMessage = 512 };

int make_frame(const World* world, int points, Frame* frame) {
  float* floats = malloc(6 * (size_t)points * sizeof(float));
  uint8_t* bytes = malloc(2 * (size_t)points);
  int i, axis;
  memset(frame, 0, sizeof(*frame));
  if (floats == NULL || bytes == NULL) {
    fputs("engine: out of memory\n", stderr);
    free(floats);
    free(bytes);
    return 0;
  }
  frame->points = points;
  for (axis = 0; axis < 3; ++axis) {
    frame->position[axis] = floats + axis * (size_t)points;
    frame->to_lamp[axis] = floats + (3 + axis) * (size_t)points;
  }
  frame->sun_lit = bytes;
  frame->lamp_lit = bytes + points;
  for (i = 0; i < points; ++i) {
    /* A low-discrepancy sequence (R2) spreads the points over the floor. */
    double u = 0.7548776662466927 * i, v = 0.5698402909980532 * i;
    frame->position[0][i] = world->floor_low[0] + world->floor_size[0] * (float)(u - floor(u));
    frame->position[1][i] = world->floor_height;
    frame->position[2][i] = world->floor_low[1] + world->floor_size[1] * (float)(v - floor(v));
    for (axis = 0; axis < 3; ++axis) frame->to_lamp[axis][i] = world->lamp[axis] - frame->position[axis][i];
  }
  return 1;
}

void free_frame(Frame* frame) {
  free(frame->position[0]);
  free(frame->sun_lit);
  memset(frame, 0, sizeof(*frame));
}

typedef struct Result {
  uint64_t lit;
  char message[kMaxMessage]; /* "" if the job succeeded; only its thread can read the error */
} Result;

typedef struct Batch {
  const World* world;
  Frame* frame;
  Result* results; /* [jobs] */
} Batch;

static int ask(const World* world, const NifRays* rays, uint8_t* visible, Result* result) {
  const NifAnswers answers = {.struct_size = sizeof(answers), .visible = visible};
  uint64_t i;
  if (nifQuery(world->scene, rays, &answers) != NIF_OK) {
    snprintf(result->message, sizeof(result->message), "%s", nifGetErrorMessage());
    return 0;
  }
  for (i = 0; i < rays->count; ++i) result->lit += visible[i];
  return 1;
}

/* One job: a range of the points that no other job writes. All jobs query the same scene. */
static void ask_range(void* argument, int index) {
  static const float whole = 1;
  const Batch* batch = argument;
  const World* world = batch->world;
  Frame* frame = batch->frame;
  int first = index * kRaysPerJob, axis;
  int count = frame->points - first < kRaysPerJob ? frame->points - first : kRaysPerJob;
  NifRays sun = {.struct_size = sizeof(sun)}, lamp;

  sun.count = (uint64_t)count;
  for (axis = 0; axis < 3; ++axis) {
    sun.origin[axis] = frame->position[axis] + first;
    sun.direction[axis] = &world->sun[axis]; /* stride 0: the same for all */
  }
  sun.origin_stride = sizeof(float);
  /* tmin and tmax stay null: the ray starts at the point, and the sun is infinitely far away. */

  lamp = sun;
  for (axis = 0; axis < 3; ++axis) lamp.direction[axis] = frame->to_lamp[axis] + first;
  lamp.direction_stride = sizeof(float);
  lamp.tmax = &whole; /* the direction's length reaches the lamp */

  if (ask(world, &sun, frame->sun_lit + first, &batch->results[index]))
    ask(world, &lamp, frame->lamp_lit + first, &batch->results[index]);
}

int ask_frame(const World* world, Jobs* jobs, Frame* frame) {
  int count = (frame->points + kRaysPerJob - 1) / kRaysPerJob, i, fine = 1;
  Batch batch = {world, frame, calloc((size_t)count, sizeof(Result))};
  if (batch.results == NULL) {
    fputs("engine: out of memory\n", stderr);
    return 0;
  }
  jobs_run(jobs, ask_range, &batch, count);
  frame->lit = 0;
  for (i = 0; i < count && fine; ++i) {
    frame->lit += batch.results[i].lit;
    if (batch.results[i].message[0] != '\0') {
      fprintf(stderr, "engine: query: %s\n", batch.results[i].message);
      fine = 0;
    }
  }
  free(batch.results);
  return fine;
}
