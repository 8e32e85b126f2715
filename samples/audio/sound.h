/* Renders one source for headphones with OpenAL Soft, into memory: the only file that uses OpenAL. */
#ifndef SOUND_H
#define SOUND_H

enum { RATE = 48000, CHANNELS = 2 }; /* samples per second, left and right */

typedef struct Sound Sound;

/* Opens a device that renders to memory, with HRTF, and starts the loop: samples[count] at RATE, each in
 * -1 .. 1. Returns null after printing an error. Only one at a time. */
Sound* sound_open(const float* loop, int count);

/* Moves the source, in metres: x right, y up, the listener at 0 0 0 looks along -z. Its volume does not
 * depend on distance. */
void sound_move(Sound* sound, const float* source);

/* Sets the low-pass of the source: factors for the whole sound, and for its high frequencies, 0 to 1. */
void sound_filter(Sound* sound, float gain, float gain_high);

/* Renders samples[frames][CHANNELS]. Returns 0 after printing an error. */
int sound_render(Sound* sound, float* samples, int frames);

/* Null is allowed. */
void sound_close(Sound* sound);

#endif
