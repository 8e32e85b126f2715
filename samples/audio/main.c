/* How a game's sound can use nifkit: every 10 ms, 64 rays from the listener to the source measure how much of
 * it is hidden, and a low-pass dulls it accordingly. The source passes behind the object from left to right
 * at a constant distance, so that only the object makes it louder or softer. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "loop.h"
#include "occlusion.h"
#include "options.h"
#include "output.h"
#include "sound.h"

enum { STEP = RATE / 100 }; /* frames between two answers: 10 ms */

/* The stage, in metres. The object is 2 m long and 2 m in front of the listener, who looks at it. */
static const float kListener[3] = {0, 0, 0}, kMiddle[3] = {0, 0, -2}, kSize = 2;
static const float kDistance = 4;       /* of the source */
static const float kRadius = 0.2f;      /* of the source: a large loudspeaker */
static const double kFurthest = 1.3090; /* 75 degrees to the left at the start, to the right at the end */

/* A fully hidden source loses 12 dB, and its high frequencies another 18 dB. A half-hidden source loses
 * half of these decibels. */
static const double kHidden = 0.25, kHiddenHigh = 0.125;

typedef struct Summary {
  double least; /* share of visible rays */
  int hidden;   /* steps in which it is below a half */
} Summary;

/* Renders frames [steps][STEP][CHANNELS] and writes a line of the log, which may be null, for each step. */
static int render(const Options* options, Occlusion* occlusion, Sound* sound, int steps, float* frames,
                  FILE* log, Summary* summary) {
  int i;
  summary->least = 1;
  if (log != NULL) fputs("seconds,degrees,visible,gain,gain_high\n", log);
  for (i = 0; i < steps; ++i) {
    double angle = kFurthest * (2 * (i + 0.5) / steps - 1), share, gain = 1, high = 1;
    float source[3];
    source[0] = (float)(kDistance * sin(angle));
    source[1] = 0;
    source[2] = (float)(-kDistance * cos(angle));
    share = occlusion_share(occlusion, kListener, source, kRadius);
    if (share < 0) return 0;
    if (options->occlusion) {
      gain = pow(kHidden, 1 - share);
      high = pow(kHiddenHigh, 1 - share);
    }
    sound_move(sound, source);
    sound_filter(sound, (float)gain, (float)high);
    if (!sound_render(sound, frames + (size_t)i * STEP * CHANNELS, STEP)) return 0;
    if (log != NULL) {
      fprintf(log, "%.2f,%.3f,%.6f,%.6f,%.6f\n", 0.01 * i, angle * 180 / 3.14159265358979, share, gain, high);
    }
    summary->least = fmin(summary->least, share);
    summary->hidden += share < 0.5;
  }
  return 1;
}

/* Converts to 16 bits. Returns how many samples were too loud and clipped. */
static size_t quantise(const float* from, int16_t* to, size_t count) {
  size_t i, clipped = 0;
  for (i = 0; i < count; ++i) {
    float value = 32767 * from[i];
    clipped += !(fabsf(value) <= 32767);
    to[i] = (int16_t)lrintf(fmaxf(-32767, fminf(32767, value)));
  }
  return clipped;
}

int main(int argc, char** argv) {
  Options options;
  Occlusion occlusion = {0};
  Output wav = {0}, log = {0};
  Summary summary = {0};
  Sound* sound = NULL;
  float *loop = NULL, *frames = NULL;
  int16_t* samples = NULL;
  size_t count, clipped;
  int fine = 0, steps, usage = read_options(argc, argv, &options);
  if (usage != 0) return usage == 1 ? 0 : 2;
  steps = (int)(100 * options.seconds);
  count = (size_t)steps * STEP * CHANNELS;
  loop = malloc(2 * RATE * sizeof(float));
  frames = malloc(count * sizeof(float));
  samples = malloc(count * sizeof(int16_t));
  if (loop == NULL || frames == NULL || samples == NULL) {
    fputs("audio: out of memory\n", stderr);
  } else if (occlusion_open(&occlusion, options.asset, options.up, options.front, kMiddle, kSize) &&
             output_begin(&wav, options.sound) && (options.log == NULL || output_begin(&log, options.log))) {
    make_loop(loop, 2 * RATE, RATE);
    sound = sound_open(loop, 2 * RATE);
    fine = sound != NULL && render(&options, &occlusion, sound, steps, frames, log.file, &summary);
  }
  if (fine) {
    clipped = quantise(frames, samples, count);
    if (clipped > 0)
      fprintf(stderr, "audio: %lu samples were too loud and were clipped\n", (unsigned long)clipped);
    write_wav(wav.file, samples, (uint32_t)(count / CHANNELS), CHANNELS, RATE);
  }
  fine = output_end(&wav, fine);
  fine = output_end(&log, fine);
  if (fine) {
    printf("%s: %d answers of %d rays; more than half of the source is hidden for %.2f s, at most %.0f %%\n",
           options.asset, steps, RAYS, 0.01 * summary.hidden, 100 * (1 - summary.least));
  }
  sound_close(sound);
  occlusion_close(&occlusion);
  free(loop);
  free(frames);
  free(samples);
  return fine ? 0 : 1;
}
