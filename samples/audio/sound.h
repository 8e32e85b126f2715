/* Renders one source for headphones with OpenAL Soft, into memory: the only file that uses OpenAL. */
#ifndef SOUND_H
#define SOUND_H

enum { RATE = 48000, CHANNELS = 2 }; /* samples a second, left and right */

typedef struct Sound Sound;

/* Opens a device that plays to memory, with HRTF, and starts the loop: samples[count] of RATE, each -1 .. 1.
 * Null after an error, which was printed. One at a time. */
Sound* sound_open(const float* loop, int count);

/* Moves the source, in metres: x right, y up, the listener at 0 0 0 looks along -z. It sounds the same from
 * any distance. */
void sound_move(Sound* sound, const float* source);

/* Sets the low-pass of the source: the factors of all of its sound, and of its high frequencies, 0 to 1. */
void sound_filter(Sound* sound, float gain, float gain_high);

/* Renders samples[frames][CHANNELS]. 0 after an error, which was printed. */
int sound_render(Sound* sound, float* samples, int frames);

/* Null is fine. */
void sound_close(Sound* sound);

#endif
