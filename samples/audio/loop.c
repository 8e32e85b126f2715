/* Hiss from a hash of the position, and a hum of 40 harmonics. The loop has no seam, because filters run
 * over it twice and each frequency fits into it a whole number of times. */
#include "loop.h"

#include <math.h>
#include <stdint.h>

static const double kTurn = 6.283185307179586;

/* -1 .. 1, only from the position: noise that repeats with the loop. */
static double noise_at(uint32_t position) {
  position = (position ^ position >> 16) * 0x7feb352du;
  position = (position ^ position >> 15) * 0x846ca68bu;
  position ^= position >> 16;
  return position / 2147483648.0 - 1;
}

/* Adds noise whose high frequencies are weaker, by about 3 dB per octave: a sum of low-passes, two octaves
 * apart. The filters run over the loop twice, so that the second time starts in the state of its end. */
static void add_hiss(float* samples, int count, int rate) {
  enum { FILTERS = 6 };
  double state[FILTERS] = {0}, factor[FILTERS];
  int i, k, pass;
  for (k = 0; k < FILTERS; ++k) factor[k] = 1 - exp(-kTurn * 20 * pow(4, k) / rate);
  for (pass = 0; pass < 2; ++pass) {
    for (i = 0; i < count; ++i) {
      double sum = 0, white = noise_at((uint32_t)i);
      for (k = 0; k < FILTERS; ++k) {
        state[k] += factor[k] * (white - state[k]);
        sum += state[k] * pow(2, -k);
      }
      if (pass == 1) samples[i] += (float)sum;
    }
  }
}

/* Adds a hum of 40 harmonics that beats twice per second. Every frequency fits into a second a whole number
 * of times. */
static void add_hum(float* samples, int count, int rate) {
  int i, k;
  for (k = 1; k <= 40; ++k) {
    double phase = kTurn * noise_at((uint32_t)(1000 + k)), size = 0.05 / k;
    for (i = 0; i < count; ++i) {
      double time = (double)i / rate;
      samples[i] += (float)(size * (1 + 0.5 * sin(kTurn * 2 * time)) * sin(kTurn * 110 * k * time + phase));
    }
  }
}

void make_loop(float* samples, int count, int rate) {
  float most = 0;
  int i;
  for (i = 0; i < count; ++i) samples[i] = 0;
  add_hiss(samples, count, rate);
  add_hum(samples, count, rate);
  for (i = 0; i < count; ++i) most = fmaxf(most, fabsf(samples[i]));
  for (i = 0; i < count; ++i) samples[i] /= most;
}
